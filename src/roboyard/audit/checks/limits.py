"""Limits of joints."""

from __future__ import annotations

import math

from roboyard.audit.findings import INFO, WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.description.urdf.elements import JointElement
from roboyard.description.urdf.parse import UrdfElements

ENDLESS = 1000.0
"""Bound beyond which a joint counts as unlimited (rad or m)."""
_ADD_LIMIT = 'add <limit lower="..." upper="..." effort="..." velocity="..."/>'


def _for_slides(joint: JointElement, remedy: str) -> str | None:
    """The remedy for a prismatic joint, which cannot be continuous; None for the remedy of the check."""
    return remedy if joint.type == "prismatic" else None


@check(
    "limit-missing",
    WARNING,
    remedy=f'{_ADD_LIMIT}, or use type="continuous"',
    example='<joint name="j" type="revolute"> without <limit>',
)
def limit_missing(urdf: UrdfElements) -> Faults:
    """A revolute or prismatic joint has no `<limit>`; Roboyard does not limit it, others lock it."""
    for joint in urdf.joints:
        if joint.type in ("revolute", "prismatic") and joint.limit is None:
            message = f"a {joint.type} joint needs a <limit>; it is not limited"
            yield Fault(at=joint, message=message, remedy=_for_slides(joint, _ADD_LIMIT))


@check(
    "limit-bounds-missing",
    WARNING,
    remedy="add lower and upper",
    example='<limit effort="10" velocity="1"/>',
)
def limit_bounds_missing(urdf: UrdfElements) -> Faults:
    """A revolute or prismatic joint's `<limit>` lacks a bound; some programs read it as 0."""
    for joint in urdf.joints:
        if joint.type not in ("revolute", "prismatic") or joint.limit is None:
            continue
        absent = [key for key in ("lower", "upper") if not (joint.limit.get(key) or "").strip()]
        if len(absent) == 2:
            yield Fault(at=joint, message="<limit> gives neither lower nor upper; the joint is not limited")
        elif absent:
            yield Fault(at=joint, message=f"<limit> gives no {absent[0]}; it is read as 0")


@check(
    "limit-reversed",
    WARNING,
    remedy='swap them, or use type="continuous" for no limits',
    example='<limit lower="1" upper="-1" .../>',
)
def limit_reversed(urdf: UrdfElements) -> Faults:
    """The upper limit is below the lower one; Roboyard, like Bullet, then reads no limits."""
    for joint in urdf.joints:
        if joint.type in ("revolute", "prismatic") and None not in (joint.lower, joint.upper):
            lower, upper = joint.lower or 0.0, joint.upper or 0.0
            if lower > upper:
                message = f"lower limit {lower:g} is above upper limit {upper:g} {joint.unit}"
                remedy = _for_slides(joint, "swap them, or remove both for no limits")
                yield Fault(at=joint, message=message, remedy=remedy)


@check(
    "limit-no-range",
    WARNING,
    remedy='give the range the joint really has, or use type="fixed"',
    example='<limit lower="0" upper="0" effort="10" velocity="1"/>',
)
def limit_no_range(urdf: UrdfElements) -> Faults:
    """Lower and upper limit are equal, zero mostly: the joint cannot move."""
    for joint in urdf.joints:
        if joint.type in ("revolute", "prismatic") and joint.lower is not None and joint.lower == joint.upper:
            yield Fault(at=joint, message=f"lower and upper limit are both {joint.lower:g}; it cannot move")


@check(
    "limit-effort-zero",
    WARNING,
    remedy="give the greatest force or torque of its drive",
    example='<limit effort="0" .../>',
)
def limit_effort_zero(urdf: UrdfElements) -> Faults:
    """The effort limit is zero: no drive can move the joint."""
    for joint in urdf.one_axis_joints:
        if joint.effort == 0.0 and joint.mimic is None:
            yield Fault(at=joint, message="effort limit is 0; no drive can move it")


@check(
    "limit-velocity-zero",
    WARNING,
    remedy="give the greatest speed of its drive",
    example='<limit velocity="0" .../>',
)
def limit_velocity_zero(urdf: UrdfElements) -> Faults:
    """The velocity limit is zero: no drive can move the joint."""
    for joint in urdf.one_axis_joints:
        if joint.velocity == 0.0 and joint.mimic is None:
            yield Fault(at=joint, message="velocity limit is 0; no drive can move it")


@check(
    "limit-negative",
    WARNING,
    remedy="give zero or more",
    example='<limit effort="-10" .../>',
)
def limit_negative(urdf: UrdfElements) -> Faults:
    """An effort or velocity limit is negative."""
    for joint in urdf.one_axis_joints:
        for name, value in (("effort", joint.effort), ("velocity", joint.velocity)):
            if value is not None and value < 0:
                yield Fault(at=joint, message=f"{name} limit is negative ({value:g})")


@check(
    "limit-incomplete",
    INFO,
    remedy="add effort and velocity",
    example='<limit lower="-1" upper="1"/>',
)
def limit_incomplete(urdf: UrdfElements) -> Faults:
    """A `<limit>` lacks effort or velocity, which URDF asks for."""
    for joint in urdf.one_axis_joints:
        if joint.limit is not None:
            absent = [key for key in ("effort", "velocity") if not (joint.limit.get(key) or "").strip()]
            if absent:
                yield Fault(at=joint, message=f"<limit> gives no {' and no '.join(absent)}")


@check(
    "continuous-with-limits",
    INFO,
    remedy='remove lower and upper, or use type="revolute"',
    fixable=True,
    example='<joint type="continuous"> with <limit lower="-1" upper="1" .../>',
)
def continuous_with_limits(urdf: UrdfElements) -> Faults:
    """A continuous joint has a range, which is ignored."""
    for joint in urdf.joints:
        if joint.type == "continuous" and joint.limit is not None:
            given = [key for key in ("lower", "upper") if joint.limit.get(key) is not None]
            if given:
                yield Fault(at=joint, message=f"a continuous joint ignores its {' and '.join(given)} limit")


@check(
    "limit-endless",
    INFO,
    remedy='use type="continuous"',
    example='<limit lower="-1e16" upper="1e16" .../>',
)
def limit_endless(urdf: UrdfElements) -> Faults:
    """A bound is beyond 1000 rad or m, which no joint reaches."""
    for joint in urdf.joints:
        bounds = [b for b in (joint.lower, joint.upper) if b is not None and math.isfinite(b)]
        if joint.type in ("revolute", "prismatic") and any(abs(bound) > ENDLESS for bound in bounds):
            shown = ", ".join(f"{bound:g}" for bound in bounds)
            remedy = _for_slides(joint, "give the range the joint really has, or remove both")
            yield Fault(
                at=joint, message=f"limits of {shown} {joint.unit} are beyond any motion", remedy=remedy
            )


@check(
    "limit-excludes-zero",
    INFO,
    remedy="give a rest position within the limits where the robot is used",
    example='<limit lower="-3" upper="-0.1" .../>',
)
def limit_excludes_zero(urdf: UrdfElements) -> Faults:
    """Zero is outside the limits, so that the robot cannot reach the pose with all joints at zero."""
    for joint in urdf.joints:
        if joint.type in ("revolute", "prismatic") and joint.has_range and joint.mimic is None:
            lower, upper = joint.lower or 0.0, joint.upper or 0.0
            if lower > 1e-9 or upper < -1e-9:
                yield Fault(at=joint, message=f"0 is outside its limits [{lower:g}, {upper:g}] {joint.unit}")
