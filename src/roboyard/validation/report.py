"""The results of a validation: gates, each with a figure, a threshold, a curve and advice."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Curve:
    """Lines over one axis."""

    x: Array
    """(n,) values of the axis, in the unit of `x_label`."""
    lines: Mapping[str, Array]
    """Label to (n,) values, in the unit of `y_label`."""
    x_label: str
    y_label: str


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Gate:
    """The result of one test."""

    name: str
    title: str
    """The requirement in a few words."""
    figure: float
    """Measured value, in `unit`."""
    threshold: float
    """Limit of the figure, in `unit`."""
    unit: str
    sense: Literal["at most", "at least"] = "at most"
    """Side of the threshold that passes."""
    detail: str = ""
    """How the figure was measured."""
    advice: str = ""
    """Parameters to check when the gate fails."""
    findings: Sequence[str] = ()
    """Single failures, the worst first."""
    warnings: Sequence[str] = ()
    """Faults that do not fail the gate."""
    curve: Curve | None = None
    skipped: str = ""
    """Why the test does not apply; empty where it does."""

    @property
    def passed(self) -> bool:
        """Whether the figure is within the threshold; a skipped gate passes."""
        if self.skipped:
            return True
        if math.isnan(self.figure):
            return False
        return self.figure <= self.threshold if self.sense == "at most" else self.figure >= self.threshold

    def to_json(self) -> dict[str, Any]:
        """Return the result as plain data, without its curve."""
        return {
            "name": self.name,
            "title": self.title,
            "passed": self.passed,
            "figure": self.figure if math.isfinite(self.figure) else None,
            "threshold": self.threshold,
            "sense": self.sense,
            "unit": self.unit,
            "detail": self.detail,
            "findings": list(self.findings),
            "warnings": list(self.warnings),
            "advice": "" if self.passed else self.advice,
            "skipped": self.skipped,
        }

    def line(self) -> str:
        """Return the result as one line for a terminal."""
        if self.skipped:
            return f"  --  {self.title}: {self.skipped}"
        mark = " ok " if self.passed else "FAIL"
        line = (
            f" {mark} {self.title}: {self.figure:.4g} {self.unit} ({self.sense} {self.threshold:g})".rstrip()
        )
        return "\n".join([line, *(f"      warning: {text}" for text in self.warnings)])


@dataclass(frozen=True, kw_only=True, slots=True)
class ValidationReport:
    """The results of all gates of one robot."""

    robot: str
    gates: tuple[Gate, ...]
    capabilities: tuple[str, ...] = ()
    joints: int = 0
    seconds: float = 0.0
    """Duration (s)."""
    notes: tuple[str, ...] = field(default=())

    @property
    def passed(self) -> bool:
        """Whether every gate passed."""
        return all(gate.passed for gate in self.gates)

    @property
    def failed(self) -> tuple[Gate, ...]:
        """Gates that failed."""
        return tuple(gate for gate in self.gates if not gate.passed)

    def gate(self, name: str) -> Gate:
        """Return the gate of this name.

        Raises:
            KeyError: there is none.
        """
        for gate in self.gates:
            if gate.name == name:
                return gate
        raise KeyError(name)

    def to_json(self) -> dict[str, Any]:
        """Return the report as plain data for JSON."""
        return {
            "robot": self.robot,
            "passed": self.passed,
            "capabilities": list(self.capabilities),
            "joints": self.joints,
            "seconds": round(self.seconds, 3),
            "notes": list(self.notes),
            "gates": [gate.to_json() for gate in self.gates],
        }
