"""The meaning of the numbers of an action: base classes.

Every number is between -1 and 1; an action scales it. It writes targets of joints in n environments at once.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np

from roboyard.envs.batch_physics import BatchPhysics
from roboyard.envs.body_arrays import RobotArrays
from roboyard.envs.drive_rows import DriveRows
from roboyard.errors import ConfigError, unknown_name
from roboyard.robots.control.setup import Group
from roboyard.robots.robot import Robot
from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True)
class Place:
    """Where an action acts: a robot's joints in n environments."""

    physics: BatchPhysics
    arrays: RobotArrays
    drives: DriveRows
    group: str
    indices: np.ndarray
    """(k,) indices of the joints in the robot's joint vectors."""
    dt: float
    """Time between actions (s)."""

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.arrays.robot

    @property
    def velocity_limits(self) -> Array:
        """(k,) largest speeds of the joints (rad/s or m/s)."""
        return self.robot.limits.velocity[self.indices]


class BoundAction(ABC):
    """An action of n environments."""

    size: int
    """Numbers for each environment."""

    def reset(self, rows: np.ndarray) -> None:  # noqa: B027 - most actions keep nothing
        """Forget what the episodes of `rows` (k,) left, after the joints were moved."""

    @abstractmethod
    def apply(self, command: Array) -> None:
        """Set the targets of the joints.

        Args:
            command: (n, size) within -1 to 1.
        """


@dataclass(frozen=True)
class Action(ABC):
    """The meaning of some numbers of an action; bound to a robot's joints when the task is set up."""

    kind: ClassVar[Literal["position", "velocity"]] = "position"
    """Whether the joints follow positions or velocities."""

    def joints(self, robot: Robot, group: str) -> tuple[str, ...]:
        """Return the joints that the action drives: those of the group.

        Raises:
            ConfigError: the robot has no such group; the message lists the nearest.
        """
        return group_of(robot, group).joints

    @abstractmethod
    def bind(self, place: Place) -> BoundAction:
        """Return the action of n environments."""

    def controller(self, robot: Robot, group: str) -> dict[str, Any]:
        """Return the keys of the robot's own controller to which the same numbers mean the same.

        Raises:
            ConfigError: the robot's controllers have no equivalent.
        """
        raise ConfigError(f"{type(self).__name__} has no equivalent among the controllers of a robot")


def group_of(robot: Robot, name: str) -> Group:
    """Return a group of joints by name.

    Raises:
        ConfigError: there is none; the message lists the nearest.
    """
    if name not in robot.groups:
        raise ConfigError(f"robot {robot.name!r}: {unknown_name('group of joints', name, robot.groups)}")
    return robot.groups[name]
