"""STABLE_PD_CONTROL: spring-damper torques worked out for the end of the step: stiff gains stay stable.

tau = kp (q* - q - dt v) + kd (v* - v - dt a), with the acceleration a that this very torque brings about.
Source: Tan, Liu, Turk: Stable Proportional-Derivative Controllers (2011).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.face.arguments import number
from roboyard.transforms import Array, conjugate, multiply

if TYPE_CHECKING:
    from roboyard.pybullet.state.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene


def drive(
    scene: PhysicsScene,
    record: BodyRecord,
    joints: Sequence[int],
    positions: Sequence[Any],
    velocities: Sequence[Any],
    forces: Sequence[Any],
    kps: Sequence[float],
    kds: Sequence[float],
) -> None:
    """Push a body's joints for one step; what is None in the lists is zero, or no bound for a force.

    Args:
        positions: for each joint, one number (rad or m) or x, y, z, w.
        velocities: for each joint, one number or three.
        forces: for each joint, the greatest torque or force, one number or three; N m or N.
    """
    import mujoco

    world, step = scene.world, scene.time_step
    world.ensure_compiled()
    model, data = world.live_model, scene.spare_data()
    data.qpos[:], data.qvel[:] = world.live_data.qpos, world.live_data.qvel
    for work in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_crb, mujoco.mj_comVel):
        work(model, data)
    bias, mass = np.zeros(model.nv), np.zeros((model.nv, model.nv))
    mujoco.mj_rne(model, data, 0, bias)
    mujoco.mj_fullM(model, data, mass)
    push, damping, bound = np.zeros(model.nv), np.zeros(model.nv), np.full(model.nv, np.inf)
    driven: list[int] = []
    for k, joint in enumerate(joints):
        place = record.velocities_of(joint)
        size = place.stop - place.start
        if not size:
            continue
        now = data.qvel[place]
        wanted = _numbers(velocities[k], size, 0.0)
        error = _error(data.qpos[record.positions_of(joint)], positions[k], size)
        push[place] = kps[k] * (error - step * now) + kds[k] * (wanted - now)
        damping[place] = kds[k]
        bound[place] = _numbers(forces[k], size, np.inf)
        driven += range(place.start, place.stop)
    own = [d for j in range(record.joint_count) for d in range(*record.velocities_of(j).indices(model.nv))]
    if record.free is not None:
        own = [*range(record.body.free_dof, record.body.free_dof + 6), *own]
    matrix = mass[np.ix_(own, own)] + np.diag(damping[own]) * step
    acceleration = np.zeros(model.nv)
    acceleration[own] = np.linalg.solve(matrix, push[own] - bias[own])
    torque = np.clip(push - damping * step * acceleration, -bound, bound)
    world.live_data.qfrc_applied[driven] += torque[driven]
    world.wrenches.pending = True


def _numbers(values: Any, size: int, default: float) -> Array:
    if values is None:
        return np.full(size, default)
    found = [number(value) for value in values]
    return np.array((found * size if len(found) == 1 else found)[:size])


def _error(now: Array, target: Any, size: int) -> Array:
    """Way from the present position to the target; of a ball a rotation vector in the child's axes."""
    if target is None:
        return np.zeros(size)
    wanted = [number(value) for value in target]
    if len(now) != 4:
        return np.array(wanted[:1]) - now
    w, x, y, z = now
    turn = multiply(conjugate((x, y, z, w)), wanted)
    turn = turn if turn[3] >= 0 else -turn
    sine = float(np.linalg.norm(turn[:3]))
    return turn[:3] * (2.0 * np.arctan2(sine, turn[3]) / sine) if sine > 1e-12 else 2.0 * turn[:3]
