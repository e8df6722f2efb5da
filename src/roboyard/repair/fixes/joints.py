"""Axes and limits."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from roboyard.audit.registry import Fault
from roboyard.description.urdf.elements import JointElement
from roboyard.repair.registry import Changes, RepairContext, change, fix, shown, text


@fix("axis-missing")
def default_axis(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Write the axis that URDF takes by default."""
    for fault in faults:
        joint = fault.at
        assert isinstance(joint, JointElement)
        axis = joint.element.find("axis")
        if axis is None:
            axis = ET.SubElement(joint.element, "axis")
        axis.set("xyz", "1 0 0")
        yield change(fault, "no <axis>", shown(axis))


@fix("axis-not-unit")
def unit_axis(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Scale the axis to length 1."""
    for fault in faults:
        joint = fault.at
        assert isinstance(joint, JointElement)
        axis = joint.element.find("axis")
        assert axis is not None
        assert joint.axis is not None
        length = math.hypot(*joint.axis)
        before = shown(axis)
        axis.set("xyz", text([value / length for value in joint.axis]))
        yield change(fault, before, shown(axis))


@fix("continuous-with-limits")
def unlimited(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Remove the range that a continuous joint ignores; effort and velocity stay."""
    for fault in faults:
        joint = fault.at
        assert isinstance(joint, JointElement)
        assert joint.limit is not None
        limits = [child for child in joint.element if child.tag == joint.limit.tag]
        for limit in limits:  # of which others become the joint's once the first one is removed
            before = shown(limit)
            if [limit.attrib.pop(key, None) for key in ("lower", "upper")] == [None, None]:
                continue
            if not limit.attrib and not len(limit):
                joint.element.remove(limit)
                yield change(fault, before, "removed")
            else:
                yield change(fault, before, shown(limit))
