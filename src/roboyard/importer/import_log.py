"""What an import decided, step by step: `import_log.json`."""

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
"""(step, share done from 0 to 1, what is being worked on)"""


@dataclass(frozen=True, kw_only=True, slots=True)
class Decision:
    """One thing that a step decided."""

    step: str
    level: Level
    element: str
    """As in `link "arm"`; empty for the robot as a whole."""
    message: str
    code: str = ""
    """Of the audit's finding that it is about, if any."""


@dataclass(kw_only=True)
class ImportLog:
    """Grows while the steps run."""

    progress: ProgressCallback | None = None
    decisions: list[Decision] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    facts: dict[str, Any] = field(default_factory=dict)
    """Plain data of steps, by topic: source, mends, links, spheres, validation, ..."""
    _step: str = ""

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Time a step and give its name to what is noted in it."""
        self._step = name
        self.tell(0.0)
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = round(time.perf_counter() - begin, 4)
        self.tell(1.0)

    def tell(self, share: float, what: str = "") -> None:
        """Show progress of the present step."""
        if self.progress is not None:
            self.progress(self._step, share, what)

    def note(self, message: str, element: str = "") -> None:
        """Record a decision."""
        self.decisions.append(Decision(step=self._step, level="note", element=element, message=message))

    def warn(self, message: str, element: str = "", *, code: str = "") -> None:
        """Record something that the user should look at; `code` of the audit's finding, if it is one."""
        self.decisions.append(
            Decision(step=self._step, level="warning", element=element, message=message, code=code)
        )

    def settle(self) -> None:
        """Turn the warnings about the audit's findings into notes."""
        self.decisions = [replace(d, level="note") if d.code else d for d in self.decisions]

    @property
    def warnings(self) -> tuple[Decision, ...]:
        """What the user should look at."""
        return tuple(decision for decision in self.decisions if decision.level == "warning")

    def to_json(self) -> dict[str, Any]:
        """Plain data for JSON."""
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

    def write(self, path: Path) -> None:
        """Write `import_log.json`."""
        text = json.dumps(self.to_json(), indent=2, ensure_ascii=False, allow_nan=False)
        path.write_text(text + "\n", encoding="utf-8")


def unique_warnings(decisions: Iterable[Decision]) -> list[tuple[str, list[str]]]:
    """Messages in order of their first appearance, each with the elements that it was said of.

    Findings of one kind are told once: the first one's message stands for them.
    """
    messages: dict[str, dict[str, None]] = {}
    elements: dict[str, dict[str, None]] = {}
    for decision in decisions:
        key = decision.code or decision.message
        messages.setdefault(key, {})[decision.message] = None
        elements.setdefault(key, {})[decision.element] = None
    told = []
    for key, said in messages.items():
        more = f" (and {len(said) - 1} more like this)" if len(said) > 1 else ""
        told.append((next(iter(said)) + more, list(elements[key])))
    return told
