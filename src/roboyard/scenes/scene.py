"""The result of a scene function: a world with named bodies, a spawn pose and a view."""

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
    """A world with named bodies, a spawn pose for a robot and a camera view."""

    name: str
    """Name of the scene."""
    world: World
    """The world that contains it."""
    bodies: Mapping[str, Body]
    """All bodies that the scene added, by name."""
    spawn: Vector3 = (0.0, 0.0, 0.0)
    """Position of a robot's base on the floor (m)."""
    spawn_yaw: float = 0.0
    """Heading of the robot there, from +x about +z (rad)."""
    eye: Vector3 = (2.5, -2.5, 1.8)
    """Camera position of the scene's default view (m)."""
    target: Vector3 = (0.0, 0.0, 0.4)
    """Point that the camera looks at (m)."""
    rooms: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Free floor positions (x, y) (m) by room; empty for a scene of one room."""
    notes: tuple[str, ...] = ()
    """Elements of a scene file that were skipped or changed."""

    @property
    def spawn_orientation(self) -> Array:
        """(4,) quaternion x, y, z, w of the robot's base."""
        return quaternion_from_rpy((0.0, 0.0, self.spawn_yaw))

    @property
    def joints(self) -> dict[str, Joint]:
        """Single-DOF joints by "body/joint": doors, drawers, lids."""
        return {
            f"{name}/{joint.name}": joint
            for name, body in self.bodies.items()
            for joint in body.joints
            if joint.is_scalar
        }

    def body(self, name: str) -> Body:
        """Return a body by name.

        Raises:
            RoboyardError: no body has this name; the message lists the nearest.
        """
        if name not in self.bodies:
            raise RoboyardError(f"scene {self.name!r}: {unknown_name('body', name, self.bodies)}")
        return self.bodies[name]

    def camera(self, *, width: int = 640, height: int = 480) -> Camera:
        """Return the camera of the scene's default view; sizes in pixels."""
        from roboyard.rendering import Camera

        return Camera.look_at(self.eye, self.target, width=width, height=height, fovy=np.radians(45.0))


def let_sleep(world: World) -> None:
    """Enable MuJoCo's sleeping: bodies at rest are not simulated until something touches them.

    Bodies with motors never sleep. A body wakes when an awake body touches it, and when it is moved.
    """
    from roboyard._mujoco import mujoco

    world.spec.option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    world.mark_stale()


def world_or_new(world: World | None) -> World:
    """Return `world`, or a new one for None."""
    if world is not None:
        return world
    from roboyard.sim import World

    return World()
