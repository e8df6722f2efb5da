"""Outcome of a skill: whether it succeeded, and what happened."""

from __future__ import annotations

from dataclasses import dataclass


class SkillError(Exception):
    """A step of a skill that failed; the skill backs out and reports the text."""

    def __init__(self, text: str, *, is_final: bool = False) -> None:
        """Note the cause and a remedy; with `is_final` trying again is of no use."""
        super().__init__(text)
        self.is_final = is_final


@dataclass(frozen=True, kw_only=True, slots=True)
class SkillResult:
    """Outcome of one skill; true where it succeeded."""

    skill: str
    """Name of the skill."""
    target: str
    """Object, joint or place that it was applied to."""
    succeeded: bool
    text: str
    """Value reached, or the cause of the failure and a remedy."""
    seconds: float
    """Simulated time (s)."""
    attempts: int = 1
    """How often it was tried."""

    def __bool__(self) -> bool:
        """Whether the skill succeeded."""
        return self.succeeded

    def __str__(self) -> str:
        state = "" if self.succeeded else "failed: "
        return f"{self.skill} {self.target}: {state}{self.text} ({self.seconds:.0f} s)"
