"""Shapes that are put somewhere for one question, without being part of the world."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

from roboyard.pybullet.arguments import quaternion, vector3
from roboyard.pybullet.errors import failure
from roboyard.pybullet.scene import Scene
from roboyard.urdf.model import Link, RobotDescription

Geoms = list[tuple[int, int, int]]
Side = tuple[int, int, int, Sequence[float] | None, Sequence[float] | None]


@contextmanager
def placed(scene: Scene, first: Side, second: Side) -> Iterator[tuple[Geoms, Geoms]]:
    """(body, link, MuJoCo geom) of both sides: body, link, shape id, position and orientation each.

    Shapes are there while the context lasts; they count as body -1, link -1.
    """
    from roboyard.pybullet.contact_points import geoms_of

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
                found.append([(-1, -1, geom) for geom in body.links[0].geom_ids])
        yield found[0], found[1]


def _put(scene: Scene, side: Side) -> Any:
    shapes = scene.collision_shapes.get(side[2])
    if shapes is None:
        raise failure("Couldn't get closest points", f"there is no collision shape {side[2]}")
    position = (0.0, 0.0, 0.0) if side[3] is None else vector3(side[3], "collisionShapePosition")
    turn = (0.0, 0.0, 0.0, 1.0) if side[4] is None else quaternion(side[4], "collisionShapeOrientation")
    link = Link(name="shape", collisions=shapes.shapes)
    return scene.world.add_description(
        RobotDescription(name="loose", links=(link,)), position, turn, fixed_base=True, drives=False
    )
