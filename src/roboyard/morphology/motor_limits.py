"""Effort limits for joints whose file gives 0 for "unknown".

Some exporters write `effort="0"` for every joint, so that none could be driven. Where at least a third of the
limited joints have effort 0, each of these gets twice the effort that holds everything it carries, stretched
out horizontally. A few joints at 0 among others with limits keep 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from roboyard.description.mass_properties import GRAVITY
from roboyard.description.model import Joint, RobotDescription

COMMON = 1 / 3
"""Share of limited joints with effort 0 from which 0 counts as unknown."""
SAFETY_FACTOR = 2.0
"""Effort limit as a multiple of the effort that holds the load; half of it accelerates."""
PAYLOAD = 0.05
"""Smallest effort limit as a share of the largest: a wrist carries more than its own flange."""
MIN_EFFORT = {"revolute": 1.0, "prismatic": 10.0}
"""Smallest effort limits (N m and N)."""
VELOCITY = {"revolute": np.pi, "prismatic": 0.5}
"""Velocity limits for joints whose velocity limit is 0 too (rad/s and m/s)."""


def with_motors(description: RobotDescription) -> tuple[RobotDescription, tuple[str, ...]]:
    """Return the description with effort limits for joints whose limit is unknown, and the names of these."""
    limited = [joint for joint in description.joints if joint.type in MIN_EFFORT and joint.mimic is None]
    unknown = [joint for joint in limited if joint.limit is not None and joint.limit.effort == 0]
    if not unknown or len(unknown) < COMMON * len(limited):
        return description, ()
    loads = _loads(description)
    names = {joint.name for joint in unknown}
    least = {
        kind: max(
            MIN_EFFORT[kind],
            PAYLOAD * SAFETY_FACTOR * max((loads[j.name] for j in unknown if j.type == kind), default=0),
        )
        for kind in MIN_EFFORT
    }
    joints = tuple(
        _driven(joint, max(least[joint.type], SAFETY_FACTOR * loads[joint.name]))
        if joint.name in names
        else joint
        for joint in description.joints
    )
    return replace(description, joints=joints), tuple(joint.name for joint in unknown)


def _driven(joint: Joint, effort: float) -> Joint:
    assert joint.limit is not None
    velocity = joint.limit.velocity or VELOCITY[joint.type]
    return replace(joint, limit=replace(joint.limit, effort=float(f"{effort:.2g}"), velocity=velocity))


def _loads(description: RobotDescription) -> Mapping[str, float]:
    """Return the effort that holds what each joint carries at full stretch (N m; N for prismatic joints)."""
    mass: dict[str, float] = {}
    moment: dict[str, float] = {}
    for link in description.links:
        inertial = link.inertial
        mass[link.name] = inertial.mass if inertial is not None else 0.0
        reach = float(np.linalg.norm(inertial.origin.position)) if inertial is not None else 0.0
        moment[link.name] = mass[link.name] * reach
    loads: dict[str, float] = {}
    for joint in reversed(description.depth_first_joints):
        limits = joint.position_limits() if joint.type == "prismatic" else None
        out = max(abs(limits[0]), abs(limits[1])) if limits is not None else 0.0
        carried = mass[joint.child]
        loads[joint.name] = GRAVITY * (carried if joint.type == "prismatic" else moment[joint.child])
        away = float(np.linalg.norm(joint.origin.position)) + (out if np.isfinite(out) else 0.0)
        mass[joint.parent] += carried
        moment[joint.parent] += moment[joint.child] + carried * away
    return loads
