"""Motors of joints whose file says nothing of them: an effort limit of 0 where 0 stands for "not known".

Exporters and whole families of descriptions write `effort="0"` for every joint. Taken at its word no joint of
such a robot could ever be driven. Where a good part of its limited joints say so, each of them gets what
holds everything behind it stretched out level, twice. Single joints at 0 among others with figures mean it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from roboyard.description.model import Joint, RobotDescription

COMMON = 1 / 3
"""Share of the limited joints at an effort of 0 from which on 0 means that it is not known."""
SPARE = 2.0
"""Effort / effort that holds the load: half is left to speed it up."""
PAYLOAD = 0.05
"""Share of the strongest motor's effort that each has at least: a wrist carries more than its own flange."""
LEAST = {"revolute": 1.0, "prismatic": 10.0}
"""N m and N: what the smallest motors give."""
VELOCITY = {"revolute": np.pi, "prismatic": 0.5}
"""rad/s and m/s, where the velocity limit is 0 too."""
GRAVITY = 9.81


def with_motors(description: RobotDescription) -> tuple[RobotDescription, tuple[str, ...]]:
    """The description with limits for joints that say nothing of their motors, and the names of these."""
    limited = [joint for joint in description.joints if joint.type in LEAST and joint.mimic is None]
    silent = [joint for joint in limited if joint.limit is not None and joint.limit.effort == 0]
    if not silent or len(silent) < COMMON * len(limited):
        return description, ()
    loads = _loads(description)
    names = {joint.name for joint in silent}
    least = {
        kind: max(
            LEAST[kind], PAYLOAD * SPARE * max((loads[j.name] for j in silent if j.type == kind), default=0)
        )
        for kind in LEAST
    }
    joints = tuple(
        _driven(joint, max(least[joint.type], SPARE * loads[joint.name])) if joint.name in names else joint
        for joint in description.joints
    )
    return replace(description, joints=joints), tuple(joint.name for joint in silent)


def _driven(joint: Joint, effort: float) -> Joint:
    assert joint.limit is not None
    velocity = joint.limit.velocity or VELOCITY[joint.type]
    return replace(joint, limit=replace(joint.limit, effort=float(f"{effort:.2g}"), velocity=velocity))


def _loads(description: RobotDescription) -> Mapping[str, float]:
    """Joint name to the effort that holds what it carries at full stretch: N m, of sliding joints N."""
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
