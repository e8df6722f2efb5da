"""Findings with a code, a severity and a location, and the audit that lists them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any


class Severity(IntEnum):
    """Severity of a finding; smaller is worse."""

    ERROR = 0
    WARNING = 1
    INFO = 2

    @property
    def label(self) -> str:
        """Name in reports: "error", "warning" or "info"."""
        return self.name.lower()


ERROR, WARNING, INFO = Severity


@dataclass(frozen=True, kw_only=True, slots=True)
class Finding:
    """One fault of one element."""

    code: str
    """Stable name of the kind of fault, as in `axis-zero`; docs/findings.md lists all."""
    severity: Severity
    element: str
    """As in `joint "elbow"`; empty for the file as a whole."""
    message: str
    """The fault in one sentence, with the value found."""
    remedy: str
    """How to fix it."""
    line: int | None = None
    """1-based line of the element in the file."""
    fixable: bool = False
    """True where `repair` fixes it without guessing."""
    links: tuple[str, ...] = ()
    """Links that it concerns."""

    def to_json(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "code": self.code,
            "severity": self.severity.label,
            "element": self.element,
            "line": self.line,
            "message": self.message,
            "remedy": self.remedy,
            "fixable": self.fixable,
            "links": list(self.links),
        }


@dataclass(frozen=True, kw_only=True, slots=True)
class Facts:
    """Size of the robot, as far as it can be read."""

    links: int = 0
    joints: int = 0
    moving_joints: int = 0
    mimic_joints: int = 0
    visuals: int = 0
    collisions: int = 0
    mesh_files: int = 0
    triangles: int = 0
    """Of all mesh files that can be read, each counted once."""
    mass: float | None = None
    """Sum over the links that give one; kg"""

    def to_json(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {name: getattr(self, name) for name in self.__slots__}


@dataclass(frozen=True, kw_only=True, slots=True)
class Audit:
    """The findings of one robot description."""

    file: Path
    robot: str
    """The robot's name; empty where it has none."""
    findings: tuple[Finding, ...]
    """Worst first, then in file order."""
    facts: Facts

    @property
    def is_usable(self) -> bool:
        """True where the robot can be used as it is, or after the fixes that the findings name."""
        return not any(finding.severity == ERROR and not finding.fixable for finding in self.findings)

    @property
    def status(self) -> str:
        """One of `ok`, `usable`, `usable after repair`, `not usable`."""
        if not self.is_usable:
            return "not usable"
        if any(finding.severity == ERROR for finding in self.findings):
            return "usable after repair"
        if any(finding.severity == WARNING for finding in self.findings):
            return "usable"
        return "ok"

    def of(self, code: str) -> tuple[Finding, ...]:
        """The findings with one code."""
        return tuple(finding for finding in self.findings if finding.code == code)

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes found, worst first, each once."""
        return tuple(dict.fromkeys(finding.code for finding in self.findings))

    def counts(self) -> dict[Severity, int]:
        """How many findings of each severity."""
        found = Counter(finding.severity for finding in self.findings)
        return {severity: found[severity] for severity in Severity}

    def to_json(self) -> dict[str, Any]:
        """Plain data for JSON; the keys are stable (docs/findings.md)."""
        return {
            "file": str(self.file),
            "robot": self.robot,
            "status": self.status,
            "usable": self.is_usable,
            "counts": {severity.label: count for severity, count in self.counts().items()},
            "facts": self.facts.to_json(),
            "findings": [finding.to_json() for finding in self.findings],
        }
