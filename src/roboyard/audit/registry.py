"""The list of checks. A check is a small generator function over a `UrdfElements`, with a docstring and a
test:

    @check("axis-zero", ERROR, remedy="give a non-zero axis", example='<axis xyz="0 0 0"/>')
    def axis_zero(urdf: UrdfElements) -> Faults:
        '''A moving joint's axis has length zero.'''
        for joint in urdf.moving_joints:
            if joint.axis is not None and not any(joint.axis):
                yield Fault(at=joint, message="<axis> is (0, 0, 0)")

The docstring's first line describes the code in `docs/findings.md`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from roboyard.audit.findings import Finding, Severity

if TYPE_CHECKING:
    from roboyard.description.urdf.parse import UrdfElements


LONGEST_MESSAGE, LONGEST_ELEMENT = 400, 120
"""Characters; messages repeat text of the file, which may be of any length."""


class HasLocation(Protocol):
    """Element that a fault can point at: link, joint, shape, ..."""

    @property
    def who(self) -> str:
        """As in `joint "elbow"`."""
        ...

    @property
    def line(self) -> int | None:
        """1-based line in the file."""
        ...

    @property
    def link_names(self) -> tuple[str, ...]:
        """Links that it concerns."""
        ...


@dataclass(frozen=True, kw_only=True, slots=True)
class Fault:
    """Result of a check; severity and remedy default to those of the check."""

    at: HasLocation | None = None
    message: str
    remedy: str | None = None
    severity: Severity | None = None
    fixable: bool | None = None
    links: tuple[str, ...] | None = None
    line: int | None = None
    """Line, where it differs from that of `at`."""


Faults = Iterator[Fault]
CheckFunction = Callable[["UrdfElements"], Faults]


@dataclass(frozen=True, kw_only=True, slots=True)
class Check:
    """One kind of fault."""

    code: str
    severity: Severity
    remedy: str
    example: str
    """XML, or words in parentheses where XML cannot show it."""
    fixable: bool
    topic: str
    """Module it lives in."""
    run: CheckFunction

    @property
    def about(self) -> str:
        """First line of the function's docstring."""
        return (self.run.__doc__ or "").strip().splitlines()[0]

    def finding(self, fault: Fault) -> Finding:
        """Return the fault as a finding of this check."""
        at = fault.at
        links = fault.links
        if links is None:
            links = () if at is None else at.link_names
        line = fault.line
        if line is None and at is not None:
            line = at.line
        return Finding(
            code=self.code,
            severity=self.severity if fault.severity is None else fault.severity,
            element="" if at is None else shortened(at.who, LONGEST_ELEMENT),
            message=shortened(fault.message, LONGEST_MESSAGE),
            remedy=self.remedy if fault.remedy is None else fault.remedy,
            line=line,
            fixable=self.fixable if fault.fixable is None else fault.fixable,
            links=links,
        )


def shortened(text: str, most: int) -> str:
    """Return the text, without its middle if it has more than `most` characters."""
    if len(text) <= most:
        return text
    half = (most - 5) // 2
    return f"{text[:half]} ... {text[-half:]}"


CHECKS: dict[str, Check] = {}
"""Every check by its code, in the order of definition."""


def check(
    code: str, severity: Severity, *, remedy: str, example: str, fixable: bool = False
) -> Callable[[CheckFunction], CheckFunction]:
    """Register a check; see the module's docstring."""

    def register(function: CheckFunction) -> CheckFunction:
        assert code not in CHECKS, f"{code} is registered twice"
        CHECKS[code] = Check(
            code=code,
            severity=severity,
            remedy=remedy,
            example=example,
            fixable=fixable,
            topic=function.__module__.rpartition(".")[2],
            run=function,
        )
        return function

    return register
