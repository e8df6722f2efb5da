"""Numbers that look like degrees or millimetres."""

from __future__ import annotations

import math

from roboyard.audit.findings import WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.description.urdf.parse import UrdfElements


@check(
    "origin-degrees",
    WARNING,
    remedy="give roll, pitch and yaw in radians",
    example='<origin rpy="90 0 0"/>',
)
def origin_degrees(urdf: UrdfElements) -> Faults:
    """A joint's roll, pitch or yaw is beyond a full turn: degrees, mostly."""
    for joint in urdf.joints:
        if joint.pose.rpy is not None and max(map(abs, joint.pose.rpy)) > 2.0 * math.pi + 0.01:
            shown = " ".join(f"{angle:g}" for angle in joint.pose.rpy)
            yield Fault(
                at=joint, message=f"<origin rpy> is ({shown}) rad, over a full turn; is it in degrees?"
            )


@check(
    "limit-degrees",
    WARNING,
    remedy='give the limits in radians, or use type="continuous" where no turn is too many',
    example='<limit lower="-180" upper="180" .../>',
)
def limit_degrees(urdf: UrdfElements) -> Faults:
    """A revolute joint's limits are whole numbers of degrees, over two turns if read in radians."""
    for joint in urdf.joints:
        if joint.type == "revolute" and joint.has_range:
            lower, upper = joint.lower or 0.0, joint.upper or 0.0
            whole = lower == int(lower) and upper == int(upper)
            if whole and 4.0 * math.pi < max(abs(lower), abs(upper)) <= 720.0:
                message = f"limits [{lower:g}, {upper:g}] rad look like degrees"
                yield Fault(at=joint, message=message)


@check(
    "origin-far",
    WARNING,
    remedy="give positions in metres",
    example='<origin xyz="0 0 250"/>',
)
def origin_far(urdf: UrdfElements) -> Faults:
    """A joint is over 20 m from its parent, mostly in millimetres."""
    for joint in urdf.joints:
        distance = math.hypot(*joint.origin[:3, 3])
        if distance > 20.0:
            message = f"<origin> is {distance:g} m from its parent; is it in millimetres?"
            yield Fault(at=joint, message=message)
