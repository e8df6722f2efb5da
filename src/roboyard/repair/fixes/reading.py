"""Faults that the reader corrects when it reads the file."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from roboyard.audit.checks.xml import NUMBERS, read_elements
from roboyard.audit.registry import Fault
from roboyard.description.urdf.elements import JointElement, ShapeElement
from roboyard.description.urdf.numbers import UNIT_TOLERANCE, NumberParser, unit_quaternion
from roboyard.description.urdf.xml import line_of
from roboyard.repair.registry import Change, Changes, RepairContext, change, fix, shown, text


@fix("xml-tolerated")
def plain_xml(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Nothing to change in the tree: writing it gives well-formed UTF-8."""
    for fault in faults:
        yield change(fault, fault.message.partition(": ")[2], "well-formed XML in UTF-8")


@fix("robot-name-missing")
def robot_name(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Name the robot after the file, as the reader does."""
    for fault in faults:
        context.urdf.root.set("name", context.urdf.path.stem)
        yield change(fault, "<robot>", shown(context.urdf.root))


@fix("joint-type-spelling")
def joint_type(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Write the type in lower case."""
    for fault in faults:
        joint = fault.at
        assert isinstance(joint, JointElement)
        before = shown(joint.element)
        joint.element.set("type", joint.type)
        yield change(fault, before, shown(joint.element))


@fix("geometry-missing")
def empty_shape(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Remove visuals and collisions without a shape; the reader ignores them."""
    for fault in faults:
        shape = fault.at
        assert isinstance(shape, ShapeElement)
        for link in context.urdf.root.iterfind("link"):
            if shape.element in list(link):
                link.remove(shape.element)
        yield change(fault, shown(shape.element), "removed")


@fix("number-sloppy")
def plain_numbers(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Write numbers as they were read; remove blank attributes."""
    for element, owner in read_elements(context.urdf):
        for key in list(element.attrib):
            size = NUMBERS.get((element.tag, key))
            if size is None:
                continue
            size = _numbers_meant(element, key, size)
            numbers = NumberParser()
            values = numbers.vector(element, key, size)
            if key == "quat_xyzw" and values is not None and _is_long(values):
                values = unit_quaternion(values)
            elif not numbers.faults or any(fault.is_error for fault in numbers.faults):
                continue
            before = shown(element)
            if values is None:
                del element.attrib[key]
            else:
                element.set(key, text(values))
            yield Change(element=owner.who, line=line_of(element), before=before, after=shown(element))


def _is_long(quaternion: Sequence[float]) -> bool:
    """True for a quaternion that the reader scales to unit length with a note."""
    return unit_quaternion(quaternion) is not None and abs(math.hypot(*quaternion) - 1.0) > UNIT_TOLERANCE


def _numbers_meant(element: ET.Element, key: str, size: int) -> int:
    """Fewer where that has a meaning of its own: one factor of scale, a colour without alpha."""
    count = len((element.get(key) or "").split())
    return count if (key, count) in (("scale", 1), ("rgba", 3)) else size
