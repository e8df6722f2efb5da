"""Names of a scene: bodies, rooms, joints, and places on top of furniture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from roboyard.errors import RoboyardError, unknown_name
from roboyard.planning.body_points import body_points
from roboyard.scenes.scene import Scene
from roboyard.sim.body import Body
from roboyard.sim.joint import Joint
from roboyard.sim.queries.rays import RayHit
from roboyard.sim.world import World
from roboyard.transforms import Array

DROP = 0.004
"""Height above a surface at which an object is let go (m)."""


_BEHIND = 1e-4
"""Distance behind a surface from which rays go on (m)."""


class Names:
    """Bodies, joints and rooms by name."""

    def __init__(self, world: World, scene: Scene | None = None, own: Body | None = None) -> None:
        """Collect the names of a world, and of a scene in it; `own` is the robot."""
        self.world = world
        self.rooms: Mapping[str, tuple[float, float]] = {} if scene is None else scene.rooms
        self._own = own

    @property
    def bodies(self) -> dict[str, Body]:
        """Bodies by name, without the robot."""
        return {body.name: body for body in self.world.bodies if body is not self._own}

    def body(self, name: str) -> Body:
        """Return a body.

        Raises:
            RoboyardError: there is none of this name; the message lists the nearest.
        """
        if name not in self.bodies:
            raise RoboyardError(unknown_name("body", name, self.bodies))
        return self.bodies[name]

    def joint(self, name: str) -> Joint:
        """Return the joint "body/joint" of a piece of furniture.

        Raises:
            RoboyardError: there is none of this name; the message lists the nearest.
        """
        found = {
            f"{body.name}/{joint.name}": joint
            for body in self.bodies.values()
            for joint in body.joints
            if joint.is_scalar
        }
        if name not in found:
            raise RoboyardError(unknown_name("joint", name, found))
        return found[name]


def surface_spots(
    world: World,
    support: Body,
    footprint: float,
    random: np.random.Generator,
    count: int,
    near: Array | None,
    ignored: Sequence[Body] = (),
) -> list[Array]:
    """Return (3,) free points on top of a body (m), where a round object of a radius (m) stands level.

    Args:
        world: holds the body.
        support: what the object is to stand on.
        footprint: radius of the object (m).
        random: source of the draws.
        count: number of points to draw.
        near: (2,) point in the world frame that spots are to be near (m); anywhere by default. It is tried
            itself, and spots are sorted by their distance from it.
        ignored: bodies above the surface that do not take room, such as the robot and what it holds.
    """
    points = body_points(support, 1000)
    low, high = points.min(axis=0), points.max(axis=0)
    found = []
    for k in range(count):
        if near is None:
            x, y = random.uniform(low[:2] + footprint, np.maximum(high[:2] - footprint, low[:2] + footprint))
        else:
            x, y = near + random.normal(size=2) * (0.02 if k else 0.0)
        heights = []
        for dx, dy in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)):
            at = (x + dx * footprint, y + dy * footprint)
            hit = _first_hit(world, (*at, float(high[2]) + 0.3), float(low[2]) - 0.01, ignored)
            if hit is None or hit.body is not support:
                break
            heights.append(float(hit.position[2]))
        if len(heights) == 5 and np.ptp(heights) < 0.003:
            found.append(np.array([x, y, max(heights)]))
    return found if near is None else sorted(found, key=lambda spot: float(np.hypot(*(spot[:2] - near))))


def _first_hit(
    world: World, start: tuple[float, float, float], end: float, ignored: Sequence[Body]
) -> RayHit | None:
    """Return the first surface below a point (3,) down to a height (m), but for those of some bodies."""
    x, y, z = start
    while z > end:
        hit = world.ray((x, y, z), (x, y, end))
        if hit is None or hit.body not in ignored:
            return hit
        z = float(hit.position[2]) - _BEHIND
    return None
