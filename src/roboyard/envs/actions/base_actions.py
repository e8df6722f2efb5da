"""Actions of mobile bases: forward speed, sideways speed and turning rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np

from roboyard.envs.actions.action import Action, BoundAction, Place, group_of
from roboyard.errors import ConfigError
from roboyard.robots.control.differential_drive import DifferentialDriveController
from roboyard.robots.control.holonomic_base import HolonomicBaseJointController
from roboyard.robots.robot import Robot
from roboyard.transforms import Array


@dataclass(frozen=True)
class BaseTwist(Action):
    """Velocity of a base in its own frame: forwards and turning; also sideways, for a holonomic base.

    Speeds change by at most the accelerations given.
    """

    speed: float = 1.0
    """Largest speed (m/s)."""
    turn: float = 2.0
    """Largest turning rate (rad/s)."""
    acceleration: float = 1.5
    """Largest change of speed (m/s²)."""
    turn_acceleration: float = 6.0
    """Largest change of the turning rate (rad/s²)."""
    kind: ClassVar[Literal["position", "velocity"]] = "velocity"

    def bind(self, place: Place) -> BoundAction:
        """Return the action of n environments.

        Raises:
            ConfigError: the group is no base with a controller for velocities.
        """
        controller = place.robot.groups[place.group].controller
        if isinstance(controller, DifferentialDriveController):
            wheels = np.stack(
                [controller.wheel_speeds(np.array(t)) for t in ((1.0, 0.0), (0.0, 1.0))], axis=1
            )
            largest = np.array([self.speed, self.turn])
            return _Wheels(place, wheels, largest, np.array([self.acceleration, self.turn_acceleration]))
        if isinstance(controller, HolonomicBaseJointController):
            largest = np.array([self.speed, self.speed, self.turn])
            rise = np.array([self.acceleration, self.acceleration, self.turn_acceleration])
            return _Holonomic(place, largest, rise)
        raise ConfigError(
            f"BaseTwist of {place.group!r}: the base has a {type(controller).__name__}; wheels on one axle "
            "or a holonomic base are needed"
        )

    def controller(self, robot: Robot, group: str) -> dict[str, Any]:
        """Return the keys of the robot's base controller that does the same."""
        controller = group_of(robot, group).controller
        if isinstance(controller, DifferentialDriveController):
            bound, rise = [self.speed, self.turn], [self.acceleration, self.turn_acceleration]
        else:
            bound = [self.speed, self.speed, self.turn]
            rise = [self.acceleration, self.acceleration, self.turn_acceleration]
        return {
            "name": type(controller).__name__,
            "command_output_limits": [[-b for b in bound], bound],
            "max_acceleration": rise,
        }


class _Twist(BoundAction):
    """A twist of the base that approaches the commanded one."""

    def __init__(self, place: Place, largest: Array, rise: Array) -> None:
        self.size = len(largest)
        self._place, self._largest, self._change = place, largest, rise * place.dt
        self.twist = np.zeros((place.physics.count, self.size))

    def reset(self, rows: np.ndarray) -> None:
        self.twist[rows] = 0.0

    def apply(self, command: Array) -> None:
        goal = command * self._largest
        self.twist = np.clip(goal, self.twist - self._change, self.twist + self._change)
        self._place.drives.velocity[:, self._place.indices] = self._speeds()

    def _speeds(self) -> Array:
        raise NotImplementedError


class _Wheels(_Twist):
    def __init__(self, place: Place, wheels: Array, largest: Array, rise: Array) -> None:
        super().__init__(place, largest, rise)
        self._wheels = wheels

    def _speeds(self) -> Array:
        # no matrix product: its last bits depend on the number of rows
        speeds = self.twist[:, :1] * self._wheels[:, 0] + self.twist[:, 1:] * self._wheels[:, 1]
        limits = self._place.velocity_limits
        excess = (np.abs(speeds) / limits).max(axis=1, keepdims=True)
        return speeds / np.maximum(excess, 1.0)


class _Holonomic(_Twist):
    def __init__(self, place: Place, largest: Array, rise: Array) -> None:
        super().__init__(place, largest, rise)
        self._base = place.arrays.base
        self._root = place.arrays.root

    def _speeds(self) -> Array:
        # the virtual joints move along the axes of the root link, which is fixed
        x, y, z, w = np.moveaxis(self._base.quaternion, -1, 0)
        heading = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        x, y, z, w = np.moveaxis(self._root.quaternion, -1, 0)
        heading = heading - np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        heading = heading + self.twist[:, 2] * self._place.dt / 2
        c, s = np.cos(heading), np.sin(heading)
        forward, left, turn = np.moveaxis(self.twist, -1, 0)
        return np.stack([c * forward - s * left, s * forward + c * left, turn], axis=1)
