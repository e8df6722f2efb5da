"""Limits of a robot's joints, with what is taken where the file says nothing."""

from __future__ import annotations

import math

import numpy as np

from roboyard.robots.control.controller import GroupLimits
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.robots.joint_arrays import Indices, JointArrays
from roboyard.sim.joint import Joint

LIMITLESS = 1e5
"""rad, m: positions beyond count as none; rad/s, m/s: so do speeds."""
LIMITLESS_EFFORT = 1e10
SPEED_TURN, SPEED_SLIDE, EFFORT = 15.0, 1.0, 100.0
"""rad/s, m/s, N m or N: where a file gives none (OmniGibson's)."""
BASE_SPEED_SLIDE, BASE_SPEED_TURN, BASE_EFFORT = 1.5, math.pi, 1000.0
"""Of the virtual joints of a holonomic base."""


def joint_limits(joints: JointArrays) -> GroupLimits:
    """Limits of all joints, in their order."""
    rows = np.array([_limits_of(joint) for joint in joints.joints], dtype=float).reshape(-1, 4)
    return GroupLimits(lower=rows[:, 0], upper=rows[:, 1], velocity=rows[:, 2], effort=rows[:, 3])


def of_group(limits: GroupLimits, places: Indices) -> GroupLimits:
    """Limits of some of the joints."""
    return GroupLimits(
        lower=limits.lower[places],
        upper=limits.upper[places],
        velocity=limits.velocity[places],
        effort=limits.effort[places],
    )


def _limits_of(joint: Joint) -> tuple[float, float, float, float]:
    lower, upper = joint.limits or (-math.inf, math.inf)
    lower = -math.inf if lower < -LIMITLESS else lower
    upper = math.inf if upper > LIMITLESS else upper
    limit, slides = joint.limit, joint.type == "prismatic"
    virtual = joint.name in VIRTUAL_JOINTS
    speed = limit.velocity if limit is not None else None
    if not speed or speed > LIMITLESS:
        usual = (BASE_SPEED_SLIDE, BASE_SPEED_TURN) if virtual else (SPEED_SLIDE, SPEED_TURN)
        speed = usual[0] if slides else usual[1]
    effort = limit.effort if limit is not None else None
    if not effort or effort > LIMITLESS_EFFORT:
        effort = BASE_EFFORT if virtual else EFFORT
    return lower, upper, abs(speed), abs(effort)
