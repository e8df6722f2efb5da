"""Two postures: tucked for driving, untucked for working."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard.robots.definition.postures import ResetMode, tuck_posture
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.robots.robot_body import RobotBody


class MobileManipulation:
    """Sets the robot's arms and torso into one of two postures; the base stays."""

    def __init__(self, robot: RobotBody) -> None:
        self._robot = robot

    def posture(self, mode: ResetMode) -> Array:
        """(n,) the posture, in the robot's joint order."""
        found = tuck_posture(self._robot.definition, self._robot.joint_names, mode)
        assert found is not None
        return found

    def tuck(self) -> None:
        """Jump into the tucked posture."""
        self._set("tuck")

    def untuck(self) -> None:
        """Jump into the untucked posture."""
        self._set("untuck")

    def _set(self, mode: ResetMode) -> None:
        self._robot.set_joint_positions(self._robot.keeping_base(self.posture(mode)))
