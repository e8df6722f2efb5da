"""Limits of a robot's joints, with defaults where its file has none."""

from __future__ import annotations

import math

import numpy as np

from roboyard.robots.control.controller import GroupLimits
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.robots.joint_arrays import Indices, JointArrays
from roboyard.sim.joint import Joint

LIMITLESS = 1e5
"""Position limits (rad or m) and velocity limits (rad/s or m/s) above this count as none."""
LIMITLESS_SPEED = 100.0
"""Velocity limits of joints with position limits above this (rad/s or m/s) count as none: files that know
none say 1000, and a reference that moves as fast would throw the joint through its end stops."""
LIMITLESS_EFFORT = 1e10
"""Effort limits above this (N m or N) count as none."""
DEFAULT_TURN_SPEED, DEFAULT_SLIDE_SPEED, DEFAULT_EFFORT = 15.0, 1.0, 100.0
"""Velocity (rad/s, m/s) and effort (N m or N) limits of joints whose file has none; OmniGibson's values."""
BASE_SLIDE_SPEED, BASE_TURN_SPEED, BASE_EFFORT = 1.5, math.pi, 1000.0
"""Velocity (m/s, rad/s) and effort (N or N m) limits of the virtual joints of a holonomic base."""


def joint_limits(joints: JointArrays) -> GroupLimits:
    """Return the limits of all joints, in their order."""
    rows = np.array([_limits_of(joint) for joint in joints.joints], dtype=float).reshape(-1, 4)
    return GroupLimits(lower=rows[:, 0], upper=rows[:, 1], velocity=rows[:, 2], effort=rows[:, 3])


def select_limits(limits: GroupLimits, indices: Indices) -> GroupLimits:
    """Return the limits of the joints at (k,) `indices`."""
    return GroupLimits(
        lower=limits.lower[indices],
        upper=limits.upper[indices],
        velocity=limits.velocity[indices],
        effort=limits.effort[indices],
    )


def _limits_of(joint: Joint) -> tuple[float, float, float, float]:
    """Return lower, upper (rad or m), velocity (rad/s or m/s) and effort (N m or N) limit of a joint."""
    lower, upper = joint.limits or (-math.inf, math.inf)
    lower = -math.inf if lower < -LIMITLESS else lower
    upper = math.inf if upper > LIMITLESS else upper
    limit, slides = joint.limit, joint.type == "prismatic"
    virtual = joint.name in VIRTUAL_JOINTS
    speed = limit.velocity if limit is not None else None
    bounded = math.isfinite(lower) and math.isfinite(upper) and joint.type != "continuous"
    if not speed or speed > (LIMITLESS_SPEED if bounded else LIMITLESS):
        slide, turn = (
            (BASE_SLIDE_SPEED, BASE_TURN_SPEED) if virtual else (DEFAULT_SLIDE_SPEED, DEFAULT_TURN_SPEED)
        )
        speed = slide if slides else turn
    effort = limit.effort if limit is not None else None
    if not effort or effort > LIMITLESS_EFFORT:
        effort = BASE_EFFORT if virtual else DEFAULT_EFFORT
    return lower, upper, abs(speed), abs(effort)
