"""Decisions of an import, step by step: `import_log.json`."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

Level = Literal["note", "warning"]
ProgressCallback = Callable[[str, float, str], None]
"""Called with the step, the completed share (0 to 1) and the current item."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Decision:
    """A decision of one step."""

    step: str
    level: Level
    element: str
    """For example `link "arm"`; empty for the robot as a whole."""
    message: str
    code: str = ""
    """Code of the audit finding that the decision concerns, if any."""


@dataclass(kw_only=True)
class ImportLog:
    """Decisions, durations and facts, recorded while the steps run."""

    progress: ProgressCallback | None = None
    decisions: list[Decision] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    facts: dict[str, Any] = field(default_factory=dict)
    """Plain data of steps, by topic: source, fixes, links, spheres, validation, ..."""
    _step: str = ""

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Time a step, and record the decisions made inside under its name."""
        self._step = name
        self.report_progress(0.0)
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = round(time.perf_counter() - begin, 4)
        self.report_progress(1.0)

    def report_progress(self, share: float, item: str = "") -> None:
        """Report the completed share (0 to 1) and the current item of the running step."""
        if self.progress is not None:
            self.progress(self._step, share, item)

    def note(self, message: str, element: str = "") -> None:
        """Record a decision."""
        self.decisions.append(Decision(step=self._step, level="note", element=element, message=message))

    def warn(self, message: str, element: str = "", *, code: str = "") -> None:
        """Record a warning; `code` is that of the audit finding it repeats, if any."""
        self.decisions.append(
            Decision(step=self._step, level="warning", element=element, message=message, code=code)
        )

    def downgrade_findings(self) -> None:
        """Turn the warnings about the audit's findings into notes."""
        self.decisions = [replace(d, level="note") if d.code else d for d in self.decisions]

    @property
    def warnings(self) -> tuple[Decision, ...]:
        """Decisions that the user should check."""
        return tuple(decision for decision in self.decisions if decision.level == "warning")

    def to_json(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        from roboyard._version import __version__

        return {
            "roboyard": __version__,
            **self.facts,
            "seconds": self.seconds,
            "decisions": [
                {"step": d.step, "level": d.level, "element": d.element, "message": d.message}
                for d in self.decisions
            ],
        }

    def write(self, path: Path, portable: Callable[[Any], Any] | None = None) -> None:
        """Write `import_log.json`; `portable` takes the machine's folders out of its texts."""
        data = self.to_json() if portable is None else portable(self.to_json())
        text = json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False)
        path.write_text(text + "\n", encoding="utf-8", errors="backslashreplace")


def unique_warnings(decisions: Iterable[Decision]) -> list[tuple[str, list[str]]]:
    """Return messages in order of their first appearance, each with the elements that it names.

    Findings of one kind are merged into the message of the first.
    """
    messages: dict[str, dict[str, None]] = {}
    elements: dict[str, dict[str, None]] = {}
    for decision in decisions:
        key = decision.code or decision.message
        messages.setdefault(key, {})[decision.message] = None
        elements.setdefault(key, {})[decision.element] = None
    merged = []
    for key, texts in messages.items():
        more = f" (and {len(texts) - 1} more like this)" if len(texts) > 1 else ""
        merged.append((next(iter(texts)) + more, list(elements[key])))
    return merged
