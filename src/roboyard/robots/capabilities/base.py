"""The pose and velocity of a robot's base: of its root link, or of the virtual joints of a holonomic base."""

from __future__ import annotations

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.robots.capabilities.robot_parts import RobotParts
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.transforms import (
    Array,
    conjugate,
    inverse_pose,
    matrix_from_quaternion,
    pose_matrix,
    quaternion_from_matrix,
    rotate,
)


class FixedBase:
    """The base of a robot that is fixed to the world."""

    def __init__(self, robot: RobotParts) -> None:
        """Create the base of a robot."""
        self._robot = robot

    def set_pose(self, position: Array, quaternion: Array) -> None:
        """Move the base frame; joint positions stay.

        Args:
            position: (3,) in the world frame (m).
            quaternion: (4,) x, y, z, w in the world frame.
        """
        body, link = self._robot.body, self._robot.base_link
        if link.index == 0:
            body.set_pose(position, quaternion)
            return
        T_world_root = pose_matrix(*body.pose)
        T_world_base = pose_matrix(*link.pose)
        T_world_new_root = pose_matrix(position, quaternion) @ inverse_pose(T_world_base) @ T_world_root
        body.set_pose(T_world_new_root[:3, 3], quaternion_from_matrix(T_world_new_root[:3, :3]))

    def set_velocity(self, linear: Array | None, angular: Array | None) -> None:
        """Refuse a velocity, which a fixed base cannot have.

        Args:
            linear: (3,) in world axes (m/s); None keeps it.
            angular: (3,) in world axes (rad/s); None keeps it.

        Raises:
            RoboyardError: always.
        """
        raise RoboyardError(
            f"robot {self._robot.name!r} has a fixed base and cannot move with velocity {linear}, {angular}; "
            "add it with fixed_base=False"
        )

    def stop(self) -> None:
        """Set the velocity of the base to zero; a fixed base has none."""


class FloatingBase(FixedBase):
    """The base of a robot that moves freely, supported by wheels or legs."""

    def set_velocity(self, linear: Array | None, angular: Array | None) -> None:
        """Set the velocity of the root link.

        Args:
            linear: (3,) in world axes (m/s); None keeps it.
            angular: (3,) in world axes (rad/s); None keeps it.
        """
        self._robot.body.set_velocity(linear, angular)

    def stop(self) -> None:
        """Set the velocity of the root link to zero."""
        self._robot.body.set_velocity(np.zeros(3), np.zeros(3))


class HolonomicBase(FixedBase):
    """The base of a robot on six virtual joints, of which x, y and rz are driven."""

    def __init__(self, robot: RobotParts) -> None:
        """Create the base of a robot whose description has the virtual joints."""
        super().__init__(robot)
        self._indices = robot.joint_arrays.indices_of(VIRTUAL_JOINTS)

    @property
    def joint_positions(self) -> Array:
        """(6,) x, y, z (m), rx, ry, rz (rad, about the rotated axes) relative to the spawn pose."""
        return self._robot.joint_arrays.q[self._indices]

    def set_pose(self, position: Array, quaternion: Array) -> None:
        """Move the base frame by the virtual joints; their fixed frame stays.

        The rotation from that frame to the base is R = Rx Ry Rz.

        Args:
            position: (3,) in the world frame (m).
            quaternion: (4,) x, y, z, w in the world frame.
        """
        robot = self._robot
        T_root_base = inverse_pose(pose_matrix(*robot.body.pose)) @ pose_matrix(position, quaternion)
        R = T_root_base[:3, :3]
        ry = np.arctan2(R[0, 2], np.hypot(R[0, 0], R[0, 1]))
        rx, rz = np.arctan2(-R[1, 2], R[2, 2]), np.arctan2(-R[0, 1], R[0, 0])
        q, v = robot.joint_arrays.q, robot.joint_arrays.v
        q[self._indices] = (*T_root_base[:3, 3], rx, ry, rz)
        v[self._indices] = 0.0
        robot.joint_arrays.q, robot.joint_arrays.v = q, v

    def set_velocity(self, linear: Array | None, angular: Array | None) -> None:
        """Set the velocities of the virtual joints; exact where the base is level.

        Args:
            linear: (3,) in world axes (m/s); None keeps it.
            angular: (3,) in world axes (rad/s); None keeps it.
        """
        robot = self._robot
        v = robot.joint_arrays.v
        quaternion_root_world = conjugate(robot.body.pose[1])
        if linear is not None:
            v[self._indices[:3]] = rotate(quaternion_root_world, linear)
        if angular is not None:
            rx, ry, _ = self.joint_positions[3:]
            axis_x = np.array([1.0, 0.0, 0.0])
            R_x = matrix_from_quaternion([np.sin(rx / 2), 0, 0, np.cos(rx / 2)])
            R_xy = R_x @ matrix_from_quaternion([0, np.sin(ry / 2), 0, np.cos(ry / 2)])
            axes = np.stack([axis_x, R_x[:, 1], R_xy[:, 2]], axis=1)
            v[self._indices[3:]] = np.linalg.solve(axes, rotate(quaternion_root_world, angular))
        robot.joint_arrays.v = v
