"""A robot on a floor, ready to be tried: every gate starts from a fresh one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.robots import RegisteredRobot, Robot, add_robot
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.sensor_frames import CameraFrame
from roboyard.sim.world import World
from roboyard.transforms import Array

SUNK = 2e-3
"""m: a robot that reaches further below the floor is lifted onto it"""


@dataclass(kw_only=True, slots=True)
class TestWorld:
    """Builds worlds with the robot under test."""

    name: str
    source: RegisteredRobot | RobotDescription
    definition: RobotDefinition
    timestep: float = 1 / 240
    seed: int = 0
    cameras: tuple[CameraFrame, ...] = ()
    scene: Any = None
    """Called with each new world; a floor by default."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Of `add_robot`."""
    joint_count: int | None = None
    """Joints of the robot, known once one was made."""

    def robot(self, *, visual: bool = False, **options: Any) -> Robot:
        """A fresh robot on the floor of a fresh world, without its visual shapes unless they are asked for:
        nothing touches them, and dense ones take most of the time and memory of a world.
        """
        world = World(timestep=self.timestep, visual_geoms=visual)
        if self.scene is None:
            world.add_plane()
        else:
            self.scene(world)
        robot = add_robot(
            world, self.source, definition=self.definition, name=self.name, **{**self.options, **options}
        )
        lowest = float(robot.body.bounds[0, 2])
        if not robot.body.is_fixed or lowest < -SUNK:
            robot.set_pose(robot.position - [0.0, 0.0, lowest])
        self.joint_count = len(robot.joint_names)
        return robot


def advance(robot: Robot, seconds: float, action: Array | None = None) -> None:
    """Step on, with an action repeated at each control step if one is given."""
    steps = max(1, round(seconds * robot.control_freq))
    for _ in range(steps):
        if action is not None:
            robot.apply_action(action)
        robot.world.step(robot.steps_per_control)


def zero_action(robot: Robot) -> Array:
    """(action_dim,) zeros."""
    return np.zeros(robot.action_dim)


def all_contacts(robot: Robot) -> set[tuple[str, str]]:
    """Pairs that touch now: links of the robot with one another ("arm", "base"), or with another body."""
    robot.world.detect_contacts()
    found = set()
    for contact in robot.world.contacts(robot.body):
        other = contact.link_b.name if contact.body_b is robot.body else f"{contact.body_b.name}/"
        a, b = sorted((contact.link_a.name, other))
        found.add((a, b))
    return found


def own_contacts(robot: Robot) -> list[tuple[str, str, float]]:
    """Links of the robot that overlap one another now, with the depth in m, the deepest first; one entry a
    pair.
    """
    robot.world.detect_contacts()
    deepest: dict[tuple[str, str], float] = {}
    for contact in robot.world.contacts(robot.body, robot.body):
        pair = tuple(sorted((contact.link_a.name, contact.link_b.name)))
        key = (pair[0], pair[1])
        deepest[key] = max(deepest.get(key, 0.0), -contact.distance)
    return sorted(((a, b, depth) for (a, b), depth in deepest.items()), key=lambda entry: -entry[2])
