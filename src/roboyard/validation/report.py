"""What validation found: gates, each with a figure, a threshold, a curve to look at and a word of advice."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Curve:
    """Some lines over one axis."""

    x: Array
    """(n,)"""
    lines: Mapping[str, Array]
    """Label to (n,) values."""
    x_label: str
    y_label: str


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Gate:
    """One question with its answer."""

    name: str
    title: str
    """The question in a few words."""
    figure: float
    threshold: float
    unit: str
    sense: Literal["at most", "at least"] = "at most"
    detail: str = ""
    """What was measured, and where the figure comes from."""
    advice: str = ""
    """Which parameter to look at when the gate fails."""
    findings: Sequence[str] = ()
    """Single cases, the worst first."""
    curve: Curve | None = None
    skipped: str = ""
    """Why the gate does not apply; empty where it does."""

    @property
    def passed(self) -> bool:
        """Whether the figure keeps to the threshold; a gate that does not apply passes."""
        if self.skipped:
            return True
        if math.isnan(self.figure):
            return False
        return self.figure <= self.threshold if self.sense == "at most" else self.figure >= self.threshold

    def to_json(self) -> dict[str, Any]:
        """Plain data, curves left out."""
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
            "advice": "" if self.passed else self.advice,
            "skipped": self.skipped,
        }

    def line(self) -> str:
        """One line for a terminal."""
        if self.skipped:
            return f"  --  {self.title}: {self.skipped}"
        mark = " ok " if self.passed else "FAIL"
        return (
            f" {mark} {self.title}: {self.figure:.4g} {self.unit} ({self.sense} {self.threshold:g})".rstrip()
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class ValidationReport:
    """All gates of one robot."""

    robot: str
    gates: tuple[Gate, ...]
    capabilities: tuple[str, ...] = ()
    joints: int = 0
    seconds: float = 0.0
    """How long it took."""
    notes: tuple[str, ...] = field(default=())

    @property
    def passed(self) -> bool:
        return all(gate.passed for gate in self.gates)

    @property
    def failed(self) -> tuple[Gate, ...]:
        return tuple(gate for gate in self.gates if not gate.passed)

    def gate(self, name: str) -> Gate:
        """The gate of this name; raises KeyError."""
        for gate in self.gates:
            if gate.name == name:
                return gate
        raise KeyError(name)

    def to_json(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "robot": self.robot,
            "passed": self.passed,
            "capabilities": list(self.capabilities),
            "joints": self.joints,
            "seconds": round(self.seconds, 3),
            "notes": list(self.notes),
            "gates": [gate.to_json() for gate in self.gates],
        }
