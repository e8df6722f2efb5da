"""A button for each thing that people are told to check by eye; it checks, says what it found, and points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from roboyard.errors import RoboyardError
from roboyard.viewer.inspector.checks import CHECKS, CheckContext, CheckResult, Violation
from roboyard.viewer.page.markdown import plain

MOST_SHOWN = 6
"""Offences told; the rest is counted"""


class CheckPanel:
    """Pressed again, a button points at the next thing that it found."""

    def __init__(
        self,
        gui: Any,
        subject: Callable[[], CheckContext],
        do: Callable[[Callable[[], None]], None],
        point: Callable[[str], None],
    ) -> None:
        """Add the buttons; `subject` gives the robot as it stands, `point` shows a link."""
        self._subject, self._do, self._point = subject, do, point
        self.verdicts: dict[str, CheckResult] = {}
        self._pointed: dict[str, int] = {}
        self.all_button = gui.add_button("Check everything", color="blue")
        self.summary = gui.add_markdown("In the posture in which the robot stands now.")
        self.buttons: dict[str, Any] = {}
        self.texts: dict[str, Any] = {}
        for title in CHECKS:
            button = self.buttons[title] = gui.add_button(title, color="gray")
            button.on_click(lambda _, title=title: self._do(lambda: self.run(title)))
            self.texts[title] = gui.add_markdown("", visible=False)
        self.all_button.on_click(lambda _: self._do(self.run_all))

    def run_all(self) -> None:
        """Try everything; points at nothing."""
        for title in CHECKS:
            self._judge(title)
        failed = sum(bool(verdict.offences) for verdict in self.verdicts.values())
        open_ = sum(verdict.is_open for verdict in self.verdicts.values())
        passed = len(self.verdicts) - failed - open_
        self.summary.content = f"**{passed} in order, {failed} to look at, {open_} without an answer.**"

    def run(self, title: str) -> None:
        """Try one thing, and point at what it found; at the next one each time."""
        verdict = self._judge(title)
        places = [offence.link for offence in verdict.offences if offence.link is not None]
        if places:
            index = self._pointed.get(title, -1) + 1
            self._pointed[title] = index % len(places)
            self._point(places[self._pointed[title]])

    def _judge(self, title: str) -> CheckResult:
        try:
            verdict = CHECKS[title](self._subject())
        except RoboyardError as error:
            verdict = CheckResult(told="This could not be tried.", offences=[Violation(told=str(error))])
        self.verdicts[title] = verdict
        mark, color = ("–", "gray") if verdict.is_open else ("✓", "green") if verdict.passed else ("✗", "red")
        button = self.buttons[title]
        button.label, button.color = f"{mark} {title}", color
        self.texts[title].content = _told(verdict)
        self.texts[title].visible = True
        return verdict


def _told(verdict: CheckResult) -> str:
    lines = [plain(verdict.told), ""]
    lines += [f"- {plain(offence.told)}" for offence in verdict.offences[:MOST_SHOWN]]
    if len(verdict.offences) > MOST_SHOWN:
        lines.append(f"- ... and {len(verdict.offences) - MOST_SHOWN} more")
    return "\n".join(lines)
