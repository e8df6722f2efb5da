"""The list of fixes. A fix corrects every fault of one code in the XML, and yields each change:

    @fix("axis-not-unit")
    def unit_axis(context: Bench, faults: Sequence[Fault]) -> Changes:
        '''Scale the axis to length 1.'''

Its arguments are the context and the fixable faults that the check of its code found, in file order.
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
    """One change made by a fix."""

    element: str
    """As in `joint "elbow"`."""
    line: int | None
    """In the original file."""
    before: str
    after: str


@dataclass(kw_only=True, eq=False)
class RepairContext:
    """The robot under repair, shared by all fixes."""

    urdf: UrdfElements
    copier: FileCopier
    keep: frozenset[str] = frozenset()
    """Codes that are not fixed."""
    moved: set[int] = field(default_factory=set)
    """`id` of each `<mesh>` element that names a copied file already."""
    link_renames: dict[str, str] = field(default_factory=dict)
    joint_renames: dict[str, str] = field(default_factory=dict)


Changes = Iterator[Change]
FixFunction = Callable[[RepairContext, Sequence[Fault]], Changes]

FIXES: dict[str, FixFunction] = {}
"""Every fix by its code, in the order in which they are made."""


def fix(code: str) -> Callable[[FixFunction], FixFunction]:
    """Register a fix for the code of a check; see the module's docstring."""

    def register(function: FixFunction) -> FixFunction:
        assert code in CHECKS, f"no check has the code {code}"
        assert code not in FIXES, f"{code} has two fixes"
        FIXES[code] = function
        return function

    return register


def change(fault: Fault, before: str, after: str) -> Change:
    """Return a change at the location of a fault."""
    at = fault.at
    line = fault.line
    if line is None and at is not None:
        line = at.line
    return Change(element="" if at is None else at.who, line=line, before=before, after=after)


def shown(element: ET.Element) -> str:
    """Return the start tag of an element, for the log."""
    attributes = "".join(f' {key}="{value}"' for key, value in element.attrib.items())
    return f"<{element.tag}{attributes}>"


def text(values: float | Sequence[float]) -> str:
    """Return numbers as text, with as many digits as they need."""
    numbers = [values] if isinstance(values, int | float) else values
    return " ".join(repr(float(number)).removesuffix(".0") for number in numbers)


def rounded(values: float | Sequence[float]) -> str:
    """Return computed numbers as text, to nine digits."""
    numbers = [values] if isinstance(values, int | float) else values
    return " ".join(f"{float(number):.9g}" for number in numbers)
