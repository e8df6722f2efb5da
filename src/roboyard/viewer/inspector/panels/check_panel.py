"""One button per check, which runs it, lists the violations and shows their links."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from roboyard.errors import RoboyardError
from roboyard.viewer.inspector.checks import CHECKS, CheckContext, CheckResult, Violation
from roboyard.viewer.page.callbacks import in_order
from roboyard.viewer.page.markdown import plain

MOST_SHOWN = 6
"""Violations listed; further ones are counted."""


class CheckPanel:
    """Buttons of all checks; pressed again, a button shows the link of the next violation."""

    def __init__(
        self,
        gui: Any,
        context: Callable[[], CheckContext],
        do: Callable[[Callable[[], None]], None],
        point: Callable[[str], None],
    ) -> None:
        """Add the buttons; `context` returns the robot's current state, `point` shows a link."""
        self._context, self._do, self._point = context, do, point
        self.results: dict[str, CheckResult] = {}
        self._pointed: dict[str, int] = {}
        self.all_button = gui.add_button("Check everything", color="blue")
        self.summary = gui.add_markdown("Checks the current posture.")
        self.buttons: dict[str, Any] = {}
        self.texts: dict[str, Any] = {}
        for title in CHECKS:
            button = self.buttons[title] = gui.add_button(title, color="gray")
            button.on_click(in_order(lambda _, title=title: self._do(lambda: self.run(title))))
            self.texts[title] = gui.add_markdown("", visible=False)
        self.all_button.on_click(in_order(lambda _: self._do(self.run_all)))

    def run_all(self) -> None:
        """Run all checks; shows no link."""
        for title in CHECKS:
            self._check(title)
        failed = sum(bool(result.violations) for result in self.results.values())
        open_ = sum(result.is_open for result in self.results.values())
        passed = len(self.results) - failed - open_
        self.summary.content = f"**{passed} passed, {failed} failed, {open_} not applicable.**"

    def run(self, title: str) -> None:
        """Run one check and show the link of a violation, the next one at each call."""
        result = self._check(title)
        links = [violation.link for violation in result.violations if violation.link is not None]
        if links:
            index = self._pointed.get(title, -1) + 1
            self._pointed[title] = index % len(links)
            self._point(links[self._pointed[title]])

    def _check(self, title: str) -> CheckResult:
        """Run a check and show its result."""
        try:
            result = CHECKS[title](self._context())
        except RoboyardError as error:
            result = CheckResult(text="The check failed to run.", violations=[Violation(text=str(error))])
        self.results[title] = result
        mark, color = ("–", "gray") if result.is_open else ("✓", "green") if result.passed else ("✗", "red")
        button = self.buttons[title]
        button.label, button.color = f"{mark} {title}", color
        self.texts[title].content = _text(result)
        self.texts[title].visible = True
        return result


def _text(result: CheckResult) -> str:
    """Format a result as Markdown."""
    lines = [plain(result.text), ""]
    lines += [f"- {plain(violation.text)}" for violation in result.violations[:MOST_SHOWN]]
    if len(result.violations) > MOST_SHOWN:
        lines.append(f"- ... and {len(result.violations) - MOST_SHOWN} more")
    return "\n".join(lines)
