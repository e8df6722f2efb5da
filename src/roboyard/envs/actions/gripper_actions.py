"""Actions of grippers: one number opens and closes all fingers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from roboyard.envs.actions.action import Action, BoundAction, Place, group_of
from roboyard.errors import ConfigError
from roboyard.robots.control.gripper import MultiFingerGripperController
from roboyard.robots.robot import Robot
from roboyard.transforms import Array


@dataclass(frozen=True)
class GripperOpening(Action):
    """One number: -1 closes a gripper, 1 opens it."""

    is_binary: bool = False
    """Whether a gripper is either open (0 and above) or closed."""

    def bind(self, place: Place) -> BoundAction:
        """Return the action of n environments.

        Raises:
            ConfigError: the group is no gripper.
        """
        controller = place.robot.groups[place.group].controller
        if not isinstance(controller, MultiFingerGripperController):
            raise ConfigError(f"GripperOpening of {place.group!r}, which is no gripper")
        return _Opening(place, *controller.postures, is_binary=self.is_binary)

    def controller(self, robot: Robot, group: str) -> dict[str, Any]:
        """Return the keys of the robot's gripper controller that does the same."""
        group_of(robot, group)
        if not self.is_binary:
            return super().controller(robot, group)
        return {"name": "MultiFingerGripperController", "mode": "binary", "motor_type": "position"}


class _Opening(BoundAction):
    size = 1

    def __init__(self, place: Place, opened: Array, closed: Array, *, is_binary: bool) -> None:
        self._place, self._open, self._closed, self._is_binary = place, opened, closed, is_binary

    def apply(self, command: Array) -> None:
        share = np.where(command >= 0.0, 1.0, 0.0) if self._is_binary else (command + 1.0) / 2.0
        self._place.drives.position[:, self._place.indices] = self._closed + share * (
            self._open - self._closed
        )
