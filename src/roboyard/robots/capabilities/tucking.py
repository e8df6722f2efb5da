"""Two postures of a mobile manipulator: tucked for driving, untucked for working."""

from __future__ import annotations

from roboyard.robots.capabilities.robot_parts import RobotParts
from roboyard.robots.definition.postures import ResetMode, tuck_posture
from roboyard.transforms import Array


class MobileManipulation:
    """The tucked and the untucked posture of a robot."""

    def __init__(self, robot: RobotParts) -> None:
        """Create the postures of a robot whose definition has a `mobile_manipulation` block."""
        self._robot = robot

    def posture(self, mode: ResetMode) -> Array:
        """Return the tucked or untucked posture.

        Args:
            mode: "tuck" or "untuck".

        Returns:
            (n,) joint positions in the robot's joint order (rad or m).
        """
        robot = self._robot
        found = tuck_posture(robot.definition, robot.description, robot.joint_names, mode)
        assert found is not None
        return found
