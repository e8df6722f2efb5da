"""Which numbers of an action go to which joints, and the drives that they need."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from roboyard.envs.actions.action import Action, BoundAction, Place
from roboyard.envs.batch_physics import BatchPhysics
from roboyard.envs.drive_rows import DriveRows, prepare_drives
from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.task import Task
from roboyard.errors import ConfigError, unknown_name
from roboyard.robots.robot import Robot
from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True)
class PlacedAction:
    """An action of a task, before there are environments."""

    label: str
    """Key in the task's `actions`."""
    robot: str
    """The robot by the task's name."""
    group: str
    joints: tuple[str, ...]
    action: Action


def place_actions(task: Task, robots: Mapping[str, Robot]) -> list[PlacedAction]:
    """Return the actions of a task, in order.

    Raises:
        ConfigError: a robot, group or joint does not exist, or two actions drive one joint.
    """
    first = next(iter(robots))
    given = task.actions(robots[first]) if callable(task.actions) else task.actions
    placed: list[PlacedAction] = []
    taken: dict[tuple[str, str], str] = {}
    for label, action in given.items():
        name, slash, group = label.partition("/")
        if not slash:
            name, group = first, label
        if name not in robots:
            raise ConfigError(f"actions: {unknown_name('robot', name, robots)}")
        joints = action.joints(robots[name], group)
        for joint in joints:
            other = taken.setdefault((name, joint), label)
            if other != label:
                raise ConfigError(f"actions: {other!r} and {label!r} both drive joint {joint!r}")
        placed.append(PlacedAction(label=label, robot=name, group=group, joints=joints, action=action))
    if not placed:
        raise ConfigError("actions: a task needs at least one")
    return placed


def prepare_all_drives(robots: Mapping[str, Robot], placed: list[PlacedAction]) -> None:
    """Write the gains of all robots' drives into their world."""
    for name, robot in robots.items():
        driven = [joint for p in placed if p.robot == name for joint in p.joints]
        prepare_drives(robot, _velocity_joints(name, placed), driven)


def _velocity_joints(robot: str, placed: list[PlacedAction]) -> list[str]:
    """Return the joints of a robot that actions drive by velocity."""
    return [j for p in placed if p.robot == robot and p.action.kind == "velocity" for j in p.joints]


class ActionRows:
    """All actions of n environments."""

    def __init__(self, env: EnvArrays, physics: BatchPhysics, placed: list[PlacedAction]) -> None:
        """Bind the actions to joints."""
        self._robots = env.robots
        self.drives = {
            name: DriveRows(
                physics,
                arrays,
                arrays.indices_of(_velocity_joints(name, placed)),
                [joint for p in placed if p.robot == name for joint in p.joints],
                env.dt,
            )
            for name, arrays in env.robots.items()
        }
        """Targets by robot."""
        self.parts: dict[str, slice] = {}
        """Label to its numbers in an action."""
        self._bound: list[tuple[slice, BoundAction]] = []
        at = 0
        for p in placed:
            arrays = env.robots[p.robot]
            place = Place(
                physics=physics,
                arrays=arrays,
                drives=self.drives[p.robot],
                group=p.group,
                indices=arrays.indices_of(p.joints),
                dt=env.dt,
            )
            bound = p.action.bind(place)
            self.parts[p.label] = part = slice(at, at + bound.size)
            self._bound.append((part, bound))
            at += bound.size
        self.size = at
        """Numbers of an action."""

    def apply(self, command: Array) -> None:
        """Set and send the targets of all joints.

        Args:
            command: (n, size) within -1 to 1.
        """
        for part, bound in self._bound:
            bound.apply(command[:, part])
        for drives in self.drives.values():
            drives.write()

    def reset(self, rows: np.ndarray) -> None:
        """Start the episodes of `rows` (k,), after the joints were moved."""
        for name, drives in self.drives.items():
            drives.reset(rows, self._robots[name].q[rows])
        for _, bound in self._bound:
            bound.reset(rows)
