"""Gains of the drives where nobody gives any: from what each joint moves, and what it can exert.

    position   kp = max(M ω², E / e),  kd = 2 √(kp M),   ω = 2π · 10 Hz, e = 0.5 rad or 0.05 m
    velocity   kd = max(M ω_v, E / (0.01 v_max)),        ω_v = 2π · 40 Hz

M is the largest inertia that the joint sees over postures drawn from its range (all other joints held), E its
effort limit, v_max its velocity limit. The second terms give a joint that moves little a firm grip: full effort at
an error of e, or at 1 % of its speed. kp is bounded so that no joint is stiffer than 60 Hz.

Drives integrate kd implicitly, so these mean the same at every time step (OmniGibson's kp = 1e7, kd = 1e5 mean
"as stiff as the solver can" and depend on it).
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from roboyard.poses import Array
from roboyard.robots.controllers.base import GroupLimits
from roboyard.robots.joints import JointArrays

NATURAL_FREQUENCY = 2 * np.pi * 10.0
VELOCITY_FREQUENCY = 2 * np.pi * 40.0
STIFFEST_FREQUENCY = 2 * np.pi * 60.0
"""rad/s"""
FULL_EFFORT_TURN, FULL_EFFORT_SLIDE = 0.5, 0.05
"""rad and m"""
FULL_EFFORT_SPEED = 0.01
"""Share of the velocity limit."""
POSTURES = 24


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Gains:
    """(n,) each, in the robot's joint order."""

    position_kp: Array
    """N m/rad or N/m"""
    position_kd: Array
    """N m s/rad or N s/m"""
    velocity_kd: Array
    """N m s/rad or N s/m"""


def default_gains(joints: JointArrays, limits: GroupLimits) -> Gains:
    """Gains of all joints of a robot by the formulas above."""
    inertia = largest_inertia(joints, limits)
    slides = np.array([joint.type == "prismatic" for joint in joints.joints])
    firm = np.where(np.isfinite(limits.effort), limits.effort, 0.0)
    by_effort = firm / np.where(slides, FULL_EFFORT_SLIDE, FULL_EFFORT_TURN)
    kp = np.minimum(
        np.maximum(inertia * NATURAL_FREQUENCY**2, by_effort), inertia * STIFFEST_FREQUENCY**2
    )
    return Gains(
        position_kp=kp,
        position_kd=2.0 * np.sqrt(kp * inertia),
        velocity_kd=np.maximum(
            inertia * VELOCITY_FREQUENCY, firm / (FULL_EFFORT_SPEED * np.maximum(limits.velocity, 1e-3))
        ),
    )


def largest_inertia(joints: JointArrays, limits: GroupLimits) -> Array:
    """(n,) kg m² or kg: largest diagonal of the mass matrix over seeded postures; leaves the world alone."""
    joints.bind()
    model = joints.world.model
    data = mujoco.MjData(model)
    data.qpos[:] = joints.world.data.qpos
    lower = np.where(np.isfinite(limits.lower), limits.lower, -np.pi)
    upper = np.where(np.isfinite(limits.upper), limits.upper, np.pi)
    # a slide without end (a base) goes nowhere for this; its inertia does not depend on where it is
    moving = np.array([joint.type != "prismatic" or joint.limits is not None for joint in joints.joints])
    rng = np.random.default_rng(0)
    full = np.zeros((model.nv, model.nv))
    largest = np.zeros(len(joints.names))
    for posture in range(POSTURES):
        if posture:
            data.qpos[joints._qpos[moving]] = rng.uniform(lower, upper)[moving]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_makeM(model, data)
        mujoco.mj_fullM(model, data, full)
        np.maximum(largest, np.diagonal(full)[joints._dofs], out=largest)
    return np.maximum(largest, 1e-9)
