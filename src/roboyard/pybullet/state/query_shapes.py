"""Collision shapes placed for one distance query, without being part of the world."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from roboyard._records import NamedTuple
from roboyard.description.model import Link, RobotDescription
from roboyard.pybullet.face.arguments import Quaternion, Vector3, quaternion, vector3
from roboyard.pybullet.face.errors import failure
from roboyard.sim.body import Body
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.world import World

Geoms = list[tuple[int, int, int]]
"""Body, link and MuJoCo geom of each collision shape."""
Vector = Sequence[float]
_ORIGIN, _IDENTITY = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
QUERY_LINK = -2
"""Link index reported for a shape that belongs to no body."""


class QuerySide(NamedTuple):
    """One side of getClosestPoints: a body's link, or a collision shape at a pose."""

    body: int
    link: int
    shape: int
    """Id of createCollisionShape; negative for a body."""
    position: Sequence[float] | None
    """Position of the shape in the world (m); None: the origin."""
    orientation: Sequence[float] | None
    """Orientation of the shape (x, y, z, w); None: the identity."""


class QueryShapes:
    """A second world, in which two shapes are placed to compute their distance."""

    def __init__(self) -> None:
        """Create an empty world."""
        self._world = World(profile=BULLET, visual_geoms=False)
        self._cache: dict[tuple[int, int], tuple[Any, Body]] = {}
        self.copies: Any = None
        """`ClosestCopies` of shapes and bodies that are used again."""

    def place(
        self, known: Mapping[int, Any], first: QuerySide, second: QuerySide
    ) -> tuple[World, list[Body]]:
        """Place two shapes of `known` (shape sets by id); return the world and the bodies of both sides."""
        bodies = [self._body(known, number, side) for number, side in enumerate((first, second))]
        for body, side in zip(bodies, (first, second), strict=True):
            body.set_pose(*pose_of(side.position, side.orientation))
        return self._world, bodies

    def release(self) -> None:
        """Free MuJoCo's arrays."""
        vars(self._world).clear()
        self._cache.clear()
        if self.copies is not None:
            self.copies.release()

    def _body(self, known: Mapping[int, Any], number: int, side: QuerySide) -> Body:
        shapes = known.get(side.shape)
        cached = self._cache.get((number, side.shape))
        if cached is not None and cached[0] is shapes:
            return cached[1]
        if cached is not None:
            self._world.remove(cached[1])
        body = add_query_body(self._world, known, side)
        self._cache[(number, side.shape)] = (shapes, body)
        return body


def add_query_body(world: World, known: Mapping[int, Any], side: QuerySide) -> Body:
    """Add the shape of a side to a world as a fixed body.

    Raises:
        error: the shape does not exist.
    """
    shapes = known.get(side.shape)
    if shapes is None:
        raise failure("Couldn't get closest points", f"there is no collision shape {side.shape}")
    link = Link(name="shape", collisions=shapes.shapes)
    description = RobotDescription(name="query shape", links=(link,))
    return world.add_description(
        description, *pose_of(side.position, side.orientation), fixed_base=True, drives=False
    )


def query_geoms(body: Body) -> Geoms:
    """Return (-1, QUERY_LINK, MuJoCo geom) of each shape of a query body."""
    return [(-1, QUERY_LINK, geom) for geom in body.links[0].geom_ids]


def pose_of(position: Vector | None, orientation: Vector | None) -> tuple[Vector3, Quaternion]:
    """Return the position (m) and orientation (x, y, z, w) of a shape, which may be None.

    Raises:
        error: one has another length.
    """
    return (
        _ORIGIN if position is None else vector3(position, "collisionShapePosition"),
        _IDENTITY if orientation is None else quaternion(orientation, "collisionShapeOrientation"),
    )
