"""Odometry and discrete actions of a robot on two driven wheels."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.robots.capabilities.parts import Locomotion
from roboyard.robots.capabilities.robot_parts import RobotParts
from roboyard.robots.control import DifferentialDriveController
from roboyard.robots.control.differential_drive import wheel_odometry
from roboyard.robots.definition.schema import TwoWheel as Block
from roboyard.robots.stability.wheels import rolling_signs
from roboyard.transforms import Array

DISCRETE_SPEED = 0.5
"""Speed of a discrete action, as a fraction of the highest speed."""


class TwoWheel:
    """Odometry and the five discrete actions of a robot on two wheels."""

    def __init__(self, robot: RobotParts, block: Block, locomotion: Locomotion) -> None:
        """Create the capability of a robot from its definition's `two_wheel` block and its wheel joints."""
        self._robot = robot
        self._locomotion = locomotion
        self.wheel_radius = block.wheel_radius
        """Radius of both wheels (m)."""
        self.wheel_axle_length = block.wheel_axle_length
        """Distance between the wheels (m)."""
        signs = rolling_signs(robot.definition, robot.description)
        self._signs = np.array(signs or np.ones(len(locomotion.joint_names)))

    def odometry(self) -> tuple[float, float]:
        """Return forward speed (m/s) and yaw rate (rad/s) from the wheel speeds, without slip."""
        forwards = self._signs * self._locomotion.joint_velocities
        return wheel_odometry(forwards, self.wheel_radius, self.wheel_axle_length)

    def proprioception(self, q: Array, v: Array) -> dict[str, Any]:
        """Return the odometry under OmniGibson's keys.

        Args:
            q: (n,) joint positions of the robot (rad or m).
            v: (n,) joint velocities of the robot (rad/s or m/s).

        Returns:
            "dd_base_lin_vel": (1,) m/s, "dd_base_ang_vel": (1,) rad/s.
        """
        linear, angular = self.odometry()
        return {"dd_base_lin_vel": np.array([linear]), "dd_base_ang_vel": np.array([angular])}

    def discrete_commands(self) -> Array:
        """Return the five discrete commands of the base group.

        Returns:
            (5, 2) commands, scaled as in an action: forwards, backwards, left, right, stop.

        Raises:
            RoboyardError: the base has another controller than a differential drive.
        """
        group = self._robot.groups.get("base")
        controller = None if group is None else group.controller
        if not isinstance(controller, DifferentialDriveController):
            raise RoboyardError(
                "discrete actions need a DifferentialDriveController on the base; "
                f"robot {self._robot.name!r} has {type(controller).__name__ if controller else 'none'}"
            )
        v = DISCRETE_SPEED * float(controller.limits.velocity[0]) * self.wheel_radius
        yaw_rate = 2.0 * v / self.wheel_axle_length
        twists = np.array([[v, 0], [-v, 0], [0, yaw_rate], [0, -yaw_rate], [0, 0]], dtype=float)
        return np.stack([controller.scaling.invert(twist) for twist in twists])
