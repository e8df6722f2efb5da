"""Two driven wheels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.robots.control import DifferentialDriveController
from roboyard.robots.definition.schema import TwoWheel as Block
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.robots.robot_body import RobotBody

DISCRETE_SPEED = 0.5
"""Share of the fastest speed that a discrete action means."""


class TwoWheel:
    """Odometry and the five discrete actions of a robot on two wheels."""

    def __init__(self, robot: RobotBody, block: Block) -> None:
        self._robot = robot
        self.wheel_radius = block.wheel_radius
        """m"""
        self.wheel_axle_length = block.wheel_axle_length
        """m"""

    def odometry(self) -> tuple[float, float]:
        """Forward speed (m/s) and turning rate (rad/s) by the wheels' speeds, as if they did not slip."""
        locomotion = self._robot.locomotion
        assert locomotion is not None
        left, right = locomotion.joint_velocities
        r = self.wheel_radius
        return float(left + right) / 2 * r, float(right - left) * r / self.wheel_axle_length

    def proprioception(self, q: Array, v: Array) -> dict[str, Any]:
        """The odometry."""
        linear, angular = self.odometry()
        return {"dd_base_lin_vel": np.array([linear]), "dd_base_ang_vel": np.array([angular])}

    def discrete_commands(self) -> Array:
        """(5, 2) commands of the base group: forwards, backwards, left, right, stand.

        Raises:
            RoboyardError: the base has another controller than a differential drive.
        """
        group = self._robot.groups.get("base")
        if group is None or not isinstance(group.controller, DifferentialDriveController):
            raise RoboyardError("discrete actions need a DifferentialDriveController on the base")
        limits = group.controller.limits
        v = DISCRETE_SPEED * float(limits.velocity[0]) * self.wheel_radius
        turn = 2.0 * v / self.wheel_axle_length
        twists = np.array([[v, 0], [-v, 0], [0, turn], [0, -turn], [0, 0]], dtype=float)
        return np.stack([group.controller.scaling.invert(twist) for twist in twists])
