"""A furnished world: what a scene function gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from roboyard.errors import RoboyardError, unknown_name
from roboyard.transforms import Array, quaternion_from_rpy

if TYPE_CHECKING:
    from roboyard.rendering import Camera
    from roboyard.sim import Body, Joint, World

Vector3 = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Scene:
    """A world with things in it, a place for a robot and a good point of view."""

    name: str
    world: World
    bodies: Mapping[str, Body]
    """Everything the scene added, by name."""
    spawn: Vector3 = (0.0, 0.0, 0.0)
    """Where a robot's base goes, on the floor; m"""
    spawn_yaw: float = 0.0
    """Which way the robot looks there, from +x about +z; rad"""
    eye: Vector3 = (2.5, -2.5, 1.8)
    """Where the camera of the scene's own view stands; m"""
    target: Vector3 = (0.0, 0.0, 0.4)
    """What it looks at; m"""
    rooms: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Free places to stand, (x, y) in m, by room; empty for a scene of one room."""
    notes: tuple[str, ...] = ()
    """What of a scene file was left out or changed."""

    @property
    def spawn_orientation(self) -> Array:
        """(4,) x, y, z, w"""
        return quaternion_from_rpy((0.0, 0.0, self.spawn_yaw))

    @property
    def joints(self) -> dict[str, Joint]:
        """Whatever opens, as "body/joint": doors, drawers, lids."""
        return {
            f"{name}/{joint.name}": joint
            for name, body in self.bodies.items()
            for joint in body.joints
            if joint.is_scalar
        }

    def body(self, name: str) -> Body:
        """The scene's body of this name.

        Raises:
            RoboyardError: there is none; the message lists the nearest.
        """
        if name not in self.bodies:
            raise RoboyardError(f"scene {self.name!r}: {unknown_name('body', name, self.bodies)}")
        return self.bodies[name]

    def camera(self, *, width: int = 640, height: int = 480) -> Camera:
        """The scene's own view."""
        from roboyard.rendering import Camera

        return Camera.look_at(self.eye, self.target, width=width, height=height, fovy=np.radians(45.0))


def let_sleep(world: World) -> None:
    """Let whatever lies still sleep until it is touched: it then costs nothing to step.

    Bodies with motors never sleep. A body wakes when something awake touches it, and when it is moved.
    """
    import mujoco

    world.spec.option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    world.mark_stale()


def world_or_new(world: World | None) -> World:
    """The world that was given, or a fresh one."""
    if world is not None:
        return world
    from roboyard.sim import World

    return World()
