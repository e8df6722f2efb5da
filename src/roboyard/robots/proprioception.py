"""A robot's own state, under OmniGibson's keys."""

from __future__ import annotations

import numpy as np

from roboyard.errors import RoboyardError, unknown_name
from roboyard.robots.robot_body import RobotBody
from roboyard.transforms import Array, matrix_from_quaternion, rpy_from_matrix


def own_state(robot: RobotBody, keys: tuple[str, ...] | None = None) -> tuple[Array, dict[str, Array]]:
    """Return the arrays of `keys` as one (k,) vector, and all arrays by key.

    Args:
        robot: that is observed.
        keys: of the vector; `default_keys` by default.

    Raises:
        RoboyardError: a key does not exist.
    """
    found = all_arrays(robot)
    for key in keys or ():
        if key not in found:
            raise RoboyardError(f"robot {robot.name!r}: {unknown_name('proprioception key', key, found)}")
    chosen = default_keys(robot) if keys is None else keys
    return np.concatenate([np.zeros(0), *(found[key] for key in chosen)]), found


def all_arrays(robot: RobotBody) -> dict[str, Array]:
    """Return the state of a robot by key.

    Joint vectors are (n,) in `joint_names` order (rad or m, rad/s or m/s, N m or N); poses of end effectors
    are in the base frame, position, orientation (roll, pitch, yaw) and velocity of the base in the world
    frame (m, rad, m/s, rad/s).
    """
    q, v = robot.joint_positions, robot.joint_velocities
    position, quaternion = robot.pose
    linear, angular = robot.velocity
    rpy = rpy_from_matrix(matrix_from_quaternion(quaternion))
    found: dict[str, Array] = {
        "joint_qpos": q,
        "joint_qpos_sin": np.sin(q),
        "joint_qpos_cos": np.cos(q),
        "joint_qvel": v,
        "joint_qeffort": robot.joint_efforts,
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


def default_keys(robot: RobotBody) -> tuple[str, ...]:
    """Return the default keys: those of the arms, else those of base, trunk and camera (as OmniGibson)."""
    if robot.manipulation is not None:
        return robot.manipulation.default_proprioception
    keys: tuple[str, ...] = ()
    if robot.two_wheel is not None:
        keys = ("dd_base_lin_vel", "dd_base_ang_vel")
    for part in (robot.trunk, robot.locomotion, robot.camera):
        if part is not None:
            keys = (*keys, *part.default_proprioception)
    return keys
