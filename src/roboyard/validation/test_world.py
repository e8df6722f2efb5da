"""The world of a gate: the robot under test on a floor, new for every gate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.robots import RegisteredRobot, Robot, add_robot
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.sensor_frames import CameraFrame
from roboyard.sim.body import Body
from roboyard.sim.world import World
from roboyard.transforms import Array


@dataclass(kw_only=True, slots=True)
class TestWorld:
    """Creates worlds with the robot under test."""

    name: str
    source: RegisteredRobot | RobotDescription
    definition: RobotDefinition
    timestep: float = 1 / 240
    """Time step of the worlds (s)."""
    seed: int = 0
    """Of randomly sampled poses."""
    cameras: tuple[CameraFrame, ...] = ()
    scene: Any = None
    """Called with each new world to add its floor; None: a plane."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Options of `add_robot`."""
    understood: Mapping[str, Any] = field(default_factory=dict)
    """Kind and parts as they were understood (see `roboyard.description.understanding`); empty where its
    definition alone says so."""
    spheres: Mapping[str, Any] = field(default_factory=dict)
    """Link to the planner's collision spheres, each with `center` and `radius` (m); empty without a file."""
    joint_count: int | None = None
    """Number of joints; known after the first robot was added."""

    @property
    def description(self) -> RobotDescription:
        """The robot as its file has it."""
        source = self.source
        return source if isinstance(source, RobotDescription) else source.description(self.definition)

    def robot(self, *, visual: bool = False, **options: Any) -> Robot:
        """Return a new robot on the floor of a new world.

        Args:
            visual: also build visual shapes. They do not collide, and dense ones take most of the time and
                memory of a world.
            options: of `add_robot`, on top of `self.options`.
        """
        world = World(timestep=self.timestep, visual_geoms=visual)
        if self.scene is None:
            world.add_plane()
        else:
            self.scene(world)
        robot = add_robot(
            world, self.source, definition=self.definition, name=self.name, **{**self.options, **options}
        )
        self.joint_count = len(robot.joint_names)
        return robot


def advance(robot: Robot, seconds: float, action: Array | None = None) -> None:
    """Step the world for a time (s), with an (action_dim,) action at each control step if one is given."""
    steps = max(1, round(seconds * robot.control_freq))
    for _ in range(steps):
        if action is not None:
            robot.apply_action(action)
        robot.world.step(robot.steps_per_control)


def zero_action(robot: Robot) -> Array:
    """Return (action_dim,) zeros."""
    return np.zeros(robot.action_dim)


def hold_action(robot: Robot) -> Array:
    """Return the (action_dim,) action that keeps the present posture."""
    return robot.no_op_action()


def all_contacts(robot: Robot) -> set[tuple[str, str]]:
    """Return the pairs in contact: two links of the robot ("arm", "base"), or a link and "<body>/"."""
    robot.world.detect_contacts()
    found = set()
    for contact in robot.world.contacts(robot.body):
        other = contact.link_b.name if contact.body_b is robot.body else f"{contact.body_b.name}/"
        a, b = sorted((contact.link_a.name, other))
        found.add((a, b))
    return found


def own_contacts(world: World, body: Body) -> list[tuple[str, str, float]]:
    """Return the pairs of links of a robot that overlap, with their depth (m), the deepest first."""
    world.detect_contacts()
    deepest: dict[tuple[str, str], float] = {}
    for contact in world.contacts(body, body):
        pair = tuple(sorted((contact.link_a.name, contact.link_b.name)))
        key = (pair[0], pair[1])
        deepest[key] = max(deepest.get(key, 0.0), -contact.distance)
    return sorted(((a, b, depth) for (a, b), depth in deepest.items()), key=lambda entry: -entry[2])
