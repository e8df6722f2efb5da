"""Where a robot stands: through its root link, or through the virtual joints of a holonomic base."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.transforms import Array, inverse_pose, matrix_from_quaternion, pose_matrix, rotate

if TYPE_CHECKING:
    from roboyard.robots.robot_body import RobotBody


class FixedBase:
    """A robot bolted to the world."""

    def __init__(self, robot: RobotBody) -> None:
        self._robot = robot

    def set_pose(self, position: Array, quaternion: Array) -> None:
        """Put the base frame there; joints stay."""
        body, link = self._robot.body, self._robot.base_link
        if link.index == 0:
            body.set_pose(position, quaternion)
            return
        T_world_root = pose_matrix(*body.pose)
        T_world_base = pose_matrix(*link.pose)
        wanted = pose_matrix(position, quaternion) @ inverse_pose(T_world_base) @ T_world_root
        from roboyard.transforms import quaternion_from_matrix

        body.set_pose(wanted[:3, 3], quaternion_from_matrix(wanted[:3, :3]))

    def set_velocity(self, linear: Array | None, angular: Array | None) -> None:
        """A fixed base has none to set."""
        raise RoboyardError(f"robot {self._robot.name!r} has a fixed base and no velocity to set")


class FloatingBase(FixedBase):
    """A robot that moves freely and stands on its wheels or legs."""

    def set_velocity(self, linear: Array | None, angular: Array | None) -> None:
        """In world axes; m/s and rad/s."""
        self._robot.body.set_velocity(linear, angular)


class HolonomicBase(FixedBase):
    """A robot carried by six virtual joints, of which x, y and rz are driven."""

    def __init__(self, robot: RobotBody) -> None:
        super().__init__(robot)
        self._places = robot.joints.places(VIRTUAL_JOINTS)

    @property
    def joint_positions(self) -> Array:
        """(6,) x, y, z (m), rx, ry, rz (rad, about the turned axes) of the base from where it was spawned."""
        return self._robot.joints.q[self._places]

    def set_pose(self, position: Array, quaternion: Array) -> None:
        """Put the base frame there by the virtual joints; the frame they start from stays."""
        robot = self._robot
        T_root_base = inverse_pose(pose_matrix(*robot.body.pose)) @ pose_matrix(position, quaternion)
        R = T_root_base[:3, :3]
        # R = Rx Ry Rz
        ry = np.arctan2(R[0, 2], np.hypot(R[0, 0], R[0, 1]))
        rx, rz = np.arctan2(-R[1, 2], R[2, 2]), np.arctan2(-R[0, 1], R[0, 0])
        q, v = robot.joints.q, robot.joints.v
        q[self._places] = (*T_root_base[:3, 3], rx, ry, rz)
        v[self._places] = 0.0
        robot.joints.q, robot.joints.v = q, v

    def set_velocity(self, linear: Array | None, angular: Array | None) -> None:
        """In world axes; m/s and rad/s. Exact where the base stands level."""
        robot = self._robot
        v = robot.joints.v
        back = np.asarray(robot.body.pose[1]) * (-1, -1, -1, 1)
        if linear is not None:
            v[self._places[:3]] = rotate(back, linear)
        if angular is not None:
            rx, ry, _ = self.joint_positions[3:]
            first = np.array([1.0, 0.0, 0.0])
            turned_x = matrix_from_quaternion([np.sin(rx / 2), 0, 0, np.cos(rx / 2)])
            turned_y = turned_x @ matrix_from_quaternion([0, np.sin(ry / 2), 0, np.cos(ry / 2)])
            axes = np.stack([first, turned_x[:, 1], turned_y[:, 2]], axis=1)
            v[self._places[3:]] = np.linalg.solve(axes, rotate(back, angular))
        robot.joints.v = v
