"""The list of mends. A mend puts right every fault of one code, in place, and says what it changed:

    @mend("axis-not-unit")
    def unit_axis(bench: Bench, faults: Sequence[Fault]) -> Changes:
        '''Scale the axis to length 1.'''

It is given the faults that its code's check found and called mendable, in file order.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from roboyard.audit.registry import CHECKS, Fault
from roboyard.description.files.copy_files import FileCopier
from roboyard.description.urdf.parse import UrdfElements


@dataclass(frozen=True, kw_only=True, slots=True)
class Change:
    """One thing that a mend did."""

    element: str
    """As in `joint "elbow"`."""
    line: int | None
    """In the original file."""
    before: str
    after: str


@dataclass(kw_only=True, eq=False)
class RepairContext:
    """What a mend works on."""

    urdf: UrdfElements
    stage: FileCopier
    keep: frozenset[str] = frozenset()
    """Codes that are not to be mended."""
    moved: set[int] = field(default_factory=set)
    """`id` of each `<mesh>` element that names a staged file already."""
    link_renames: dict[str, str] = field(default_factory=dict)
    joint_renames: dict[str, str] = field(default_factory=dict)


Changes = Iterator[Change]
FixFunction = Callable[[RepairContext, Sequence[Fault]], Changes]

FIXES: dict[str, FixFunction] = {}
"""Every mend by its code, in the order in which they are done."""


def fix(code: str) -> Callable[[FixFunction], FixFunction]:
    """Register a mend for the code of a check; see the module's docstring."""

    def register(function: FixFunction) -> FixFunction:
        assert code in CHECKS, f"no check has the code {code}"
        assert code not in FIXES, f"{code} has two mends"
        FIXES[code] = function
        return function

    return register


def change(fault: Fault, before: str, after: str) -> Change:
    """A change at the place of a fault."""
    at = fault.at
    line = fault.line
    if line is None and at is not None:
        line = at.line
    return Change(element="" if at is None else at.who, line=line, before=before, after=after)


def shown(element: ET.Element) -> str:
    """The start tag of an element, as a log shows it."""
    attributes = "".join(f' {key}="{value}"' for key, value in element.attrib.items())
    return f"<{element.tag}{attributes}>"


def text(values: float | Sequence[float]) -> str:
    """Numbers as the repaired file writes them, with as many digits as they need."""
    numbers = [values] if isinstance(values, int | float) else values
    return " ".join(repr(float(number)).removesuffix(".0") for number in numbers)


def rounded(values: float | Sequence[float]) -> str:
    """Computed numbers, to nine digits."""
    numbers = [values] if isinstance(values, int | float) else values
    return " ".join(f"{float(number):.9g}" for number in numbers)
