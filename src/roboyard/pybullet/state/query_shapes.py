"""Shapes that are put somewhere for one question, without being part of the world."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

from roboyard.description.model import Link, RobotDescription
from roboyard.pybullet.face.arguments import quaternion, vector3
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.physics_scene import PhysicsScene
from roboyard.sim.body import Body
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.world import World

Geoms = list[tuple[int, int, int]]
LOOSE = -2
"""Link that stands for a shape of no body."""
Side = tuple[int, int, int, Sequence[float] | None, Sequence[float] | None]


class QueryShapes:
    """A world beside the scene's, where two shapes are put to ask how near they are."""

    def __init__(self) -> None:
        self._world = World(profile=BULLET, visual_geoms=False)
        self._kept: dict[tuple[int, int], tuple[Any, Body]] = {}

    def placed(self, scene: PhysicsScene, first: Side, second: Side) -> tuple[World, Geoms, Geoms]:
        """The world and (-1, -2, MuJoCo geom) of both sides."""
        bodies = [self._body(scene, number, side) for number, side in enumerate((first, second))]
        for body, side in zip(bodies, (first, second), strict=True):
            body.set_pose(*_pose(side))
        one, two = ([(-1, LOOSE, geom) for geom in body.links[0].geom_ids] for body in bodies)
        return self._world, one, two

    def let_go(self) -> None:
        """Free MuJoCo's arrays now."""
        vars(self._world).clear()
        self._kept.clear()

    def _body(self, scene: PhysicsScene, number: int, side: Side) -> Body:
        shapes = _shapes(scene, side)
        held = self._kept.get((number, side[2]))
        if held is not None and held[0] is shapes:
            return held[1]
        if held is not None:
            self._world.remove(held[1])
        body = _add(self._world, side, shapes)
        self._kept[(number, side[2])] = (shapes, body)
        return body


@contextmanager
def placed(scene: PhysicsScene, first: Side, second: Side) -> Iterator[tuple[World, Geoms, Geoms]]:
    """A world and (body, link, MuJoCo geom) of both sides: body, link, shape id, position, orientation each.

    Shapes are there while the context lasts; they count as body -1, link -2.
    """
    from roboyard.pybullet.api.contact_points import geoms_of

    if first[2] >= 0 and second[2] >= 0:
        yield scene.loose_shapes.placed(scene, first, second)
        return
    with ExitStack() as stack:
        loose = [_put(scene, side) if side[2] >= 0 else None for side in (first, second)]
        for body in loose:
            if body is not None:
                stack.callback(scene.world.remove, body)
        found = []
        for side, body in zip((first, second), loose, strict=True):
            if body is None:
                found.append(geoms_of(scene, side[0], side[1]))
            else:
                found.append([(-1, LOOSE, geom) for geom in body.links[0].geom_ids])
        yield scene.world, found[0], found[1]


def _put(scene: PhysicsScene, side: Side) -> Body:
    return _add(scene.world, side, _shapes(scene, side))


def _add(world: World, side: Side, shapes: Any) -> Body:
    link = Link(name="shape", collisions=shapes.shapes)
    description = RobotDescription(name="loose", links=(link,))
    return world.add_description(description, *_pose(side), fixed_base=True, drives=False)


def _shapes(scene: PhysicsScene, side: Side) -> Any:
    shapes = scene.collision_shapes.get(side[2])
    if shapes is None:
        raise failure("Couldn't get closest points", f"there is no collision shape {side[2]}")
    return shapes


def _pose(side: Side) -> tuple[tuple[float, ...], tuple[float, ...]]:
    position = (0.0, 0.0, 0.0) if side[3] is None else vector3(side[3], "collisionShapePosition")
    turn = (0.0, 0.0, 0.0, 1.0) if side[4] is None else quaternion(side[4], "collisionShapeOrientation")
    return position, turn
