"""Axes and dynamics of joints."""

from __future__ import annotations

import math

from roboyard.audit.checks.xml import misspelt
from roboyard.audit.findings import ERROR, INFO, WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.description.urdf.parse import UrdfElements


@check("axis-zero", ERROR, remedy="give a non-zero axis", example='<axis xyz="0 0 0"/>')
def axis_zero(urdf: UrdfElements) -> Faults:
    """A moving joint's axis has length zero."""
    for joint in urdf.moving_joints:
        if (
            joint.axis is not None
            and math.hypot(*joint.axis) < 1e-12
            and joint.type not in ("floating", "spherical")
        ):
            yield Fault(at=joint, message="<axis> is (0, 0, 0)")


@check(
    "axis-not-unit",
    INFO,
    remedy="scale it to length 1",
    fixable=True,
    example='<axis xyz="0 0 2"/>',
)
def axis_not_unit(urdf: UrdfElements) -> Faults:
    """A moving joint's axis is not of unit length (to 0.1 %); programs differ on what that means."""
    for joint in urdf.one_axis_joints:
        if joint.axis is None:
            continue
        length = math.hypot(*joint.axis)
        if length >= 1e-12 and math.isfinite(length) and abs(length - 1.0) > 1e-3:
            yield Fault(at=joint, message=f"<axis> has length {length:.6g}")


@check(
    "axis-missing",
    INFO,
    remedy='write <axis xyz="1 0 0"/>, the default',
    fixable=True,
    example='<joint name="j" type="revolute"> without <axis>',
)
def axis_missing(urdf: UrdfElements) -> Faults:
    """A moving joint gives no axis; URDF's default is x, which is seldom what was meant."""
    for joint in urdf.one_axis_joints:
        axis = joint.element.find("axis")
        if axis is None or not (axis.get("xyz") or "").strip():
            message = f"a {joint.type} joint without <axis> turns or slides along x"
            wrong = None if axis is None else next((key for key in axis.attrib if misspelt(axis, key)), None)
            if wrong is None:
                yield Fault(at=joint, message=message)
                continue
            message += f"; <axis> gives {wrong}, which is not read"
            remedy = 'write its axis as xyz="..."'
            yield Fault(at=joint, message=message, remedy=remedy, severity=WARNING, fixable=False)


@check(
    "dynamics-negative",
    WARNING,
    remedy="give zero or more",
    example='<dynamics damping="-0.1"/>',
)
def dynamics_negative(urdf: UrdfElements) -> Faults:
    """Damping or friction is negative: the joint drives itself."""
    for joint in urdf.joints:
        for name, value in (("damping", joint.damping), ("friction", joint.friction)):
            if value is not None and value < 0:
                yield Fault(at=joint, message=f"{name} is negative ({value:g})")
