"""STABLE_PD_CONTROL: spring-damper torques computed for the end of the step, so that stiff gains stay stable.

tau = kp (q* - q - dt v) + kd (v* - v - dt a), where a is the acceleration that this torque causes.
Source: Tan, Liu, Turk: Stable Proportional-Derivative Controllers (2011).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._records import dataclass
from roboyard.transforms import Array, conjugate, multiply

if TYPE_CHECKING:
    from roboyard._mujoco import mujoco

kernels = lazy_module("roboyard.pybullet.bullet_rules.motor_kernels")


@dataclass(kw_only=True, slots=True)
class StablePdTargets:
    """Gains and errors of all degrees of freedom of a model, (nv,) each; zero where nothing is controlled."""

    kp: Array
    """Position gains (N m/rad or N/m)."""
    kd: Array
    """Velocity gains (N m s/rad or N s/m)."""
    position_error: Array
    """q* - q (rad or m)."""
    velocity_target: Array
    """v* (rad/s or m/s)."""
    limit: Array
    """Largest torque or force (N m or N)."""

    @classmethod
    def zeros(cls, size: int) -> StablePdTargets:
        """Return targets for `size` degrees of freedom, none of which is controlled."""
        return cls(
            kp=np.zeros(size),
            kd=np.zeros(size),
            position_error=np.zeros(size),
            velocity_target=np.zeros(size),
            limit=np.full(size, np.inf),
        )


def stable_pd_torque(
    model: mujoco.MjModel, data: mujoco.MjData, timestep: float, targets: StablePdTargets, own: Sequence[int]
) -> Array:
    """Return the (nv,) torques (N m) and forces (N) of stable PD control.

    Args:
        model: MuJoCo model.
        data: its data at the current positions and velocities; overwritten.
        timestep: length of the coming step (s).
        targets: gains and errors.
        own: all degrees of freedom of the body, whose accelerations are coupled.
    """
    from roboyard._mujoco import mujoco

    for compute in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_crb, mujoco.mj_comVel):
        compute(model, data)
    bias, mass = np.zeros(model.nv), np.zeros((model.nv, model.nv))
    mujoco.mj_rne(model, data, 0, bias)
    mujoco.mj_fullM(model, data, mass)
    now = data.qvel
    push = targets.kp * (targets.position_error - timestep * now)
    push += targets.kd * (targets.velocity_target - now)
    acceleration, places = np.zeros(model.nv), np.array(own, np.int64)
    work = np.empty((len(own), len(own)))
    if not kernels().solve_damped(mass, targets.kd * timestep, places, push - bias, work, acceleration):
        matrix = mass[np.ix_(own, own)] + np.diag(targets.kd[own]) * timestep  # negative gains
        acceleration[own] = np.linalg.solve(matrix, push[own] - bias[own])
    return np.clip(push - targets.kd * timestep * acceleration, -targets.limit, targets.limit)


def rotation_error(now: Array, target: Sequence[float]) -> Array:
    """Return the (3,) rotation vector (rad, child axes) from one orientation to another.

    Args:
        now: (4,) current quaternion, w first.
        target: x, y, z, w.
    """
    w, x, y, z = now
    turn = multiply(conjugate((x, y, z, w)), target)
    turn = turn if turn[3] >= 0 else -turn
    sine = float(np.linalg.norm(turn[:3]))
    return turn[:3] * (2.0 * np.arctan2(sine, turn[3]) / sine) if sine > 1e-12 else 2.0 * turn[:3]
