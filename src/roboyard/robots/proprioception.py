"""What a robot feels of itself, under OmniGibson's keys."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import RoboyardError, unknown_name
from roboyard.robots.backends import Backend, as_backend
from roboyard.transforms import matrix_from_quaternion, rpy_from_matrix

if TYPE_CHECKING:
    from roboyard.robots.robot import Robot


def proprioception(
    robot: Robot, keys: tuple[str, ...] | None, backend: Backend
) -> tuple[Any, dict[str, Any]]:
    """The vector of `keys`, and every key's array."""
    found = everything(robot)
    for key in keys or ():
        if key not in found:
            raise RoboyardError(f"robot {robot.name!r}: {unknown_name('proprioception key', key, found)}")
    chosen = default_keys(robot) if keys is None else keys
    vector = np.concatenate([np.zeros(0), *(found[key] for key in chosen)])
    return as_backend(vector, backend), {key: as_backend(value, backend) for key, value in found.items()}


def everything(robot: Robot) -> dict[str, Any]:
    """All keys of a robot; angles in rad, poses of end effectors in the base frame, the rest in the world."""
    q, v = robot.joints.q, robot.joints.v
    position, quaternion = robot.base_link.pose
    linear, angular = robot.base_link.velocity
    rpy = rpy_from_matrix(matrix_from_quaternion(quaternion))
    found: dict[str, Any] = {
        "joint_qpos": q,
        "joint_qpos_sin": np.sin(q),
        "joint_qpos_cos": np.cos(q),
        "joint_qvel": v,
        "joint_qeffort": robot.joints.efforts,
        "robot_pos": position,
        "robot_ori_sin": np.sin(rpy),
        "robot_ori_cos": np.cos(rpy),
        "robot_2d_ori": rpy[2:],
        "robot_2d_ori_sin": np.sin(rpy[2:]),
        "robot_2d_ori_cos": np.cos(rpy[2:]),
        "robot_lin_vel": linear,
        "robot_ang_vel": angular,
    }
    for part in (robot.manipulation, robot.trunk, robot.locomotion, robot.two_wheel, robot.camera):
        if part is not None:
            found |= part.proprioception(q, v)
    return found


def default_keys(robot: Robot) -> tuple[str, ...]:
    """For robots with arms each arm's keys (the base and the trunk are left out, as in OmniGibson)."""
    if robot.manipulation is not None:
        return robot.manipulation.default_proprioception
    keys: tuple[str, ...] = ()
    if robot.two_wheel is not None:
        keys = ("dd_base_lin_vel", "dd_base_ang_vel")
    for part in (robot.trunk, robot.locomotion, robot.camera):
        if part is not None:
            keys = (*keys, *part.default_proprioception)
    return keys
