"""Contacts and nearest points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.arguments import number, whole
from roboyard.pybullet.commands import command

if TYPE_CHECKING:
    from roboyard.pybullet.clients import Client
    from roboyard.pybullet.scene import Scene

Vector = Sequence[float]
Point = tuple[Any, ...]
ANY_LINK = -2


@command()
def getContactPoints(
    client: Client, bodyA: int = -1, bodyB: int = -1, linkIndexA: int = ANY_LINK, linkIndexB: int = ANY_LINK
) -> tuple[Point, ...]:
    """Where bodies touch, as of the last step or performCollisionDetection.

    Args:
        bodyA: only contacts of this body, which then comes first; -1 for all.
        bodyB: only contacts with this body.
        linkIndexA: only contacts of this link of bodyA.
        linkIndexB: only contacts with this link of bodyB.

    Returns:
        for each contact: 0, body A, body B, link A, link B, point on A and on B (m), normal on B towards A,
        distance (m, negative where they overlap), normal force (N), friction force and direction, twice.
    """
    scene = client.scene
    wanted = whole(bodyA), whole(bodyB), whole(linkIndexA), whole(linkIndexB)
    if scene.world.is_stale or scene.world.live_data.ncon == 0:
        return ()
    from roboyard.sim.contacts import contact_arrays

    arrays = contact_arrays(scene.world)
    points = []
    for i in range(len(arrays.distance)):
        distance = float(arrays.distance[i])
        normal_force, first, second = arrays.force[i].tolist()
        if distance > 0.0 and normal_force <= 0.0:
            continue
        world_a, link_a, world_b, link_b = arrays.owners[i].tolist()
        a, b = (scene.of_world(world_a).number, link_a - 1), (scene.of_world(world_b).number, link_b - 1)
        order = _order(a, b, wanted)
        if order is None:
            continue
        normal, *tangents = arrays.frame[i]
        half = 0.5 * distance * normal
        on_a, on_b = arrays.position[i] - half, arrays.position[i] + half
        sign = -1.0
        if order < 0:
            a, b, on_a, on_b, sign = b, a, on_b, on_a, 1.0
        points.append(
            (
                *(0, a[0], b[0], a[1], b[1], tuple(on_a.tolist()), tuple(on_b.tolist())),
                *(tuple((sign * normal).tolist()), distance, normal_force),
                *(sign * first, tuple(tangents[0].tolist()), sign * second, tuple(tangents[1].tolist())),
            )
        )
    return tuple(points)


@command()
def getClosestPoints(
    client: Client,
    bodyA: int,
    bodyB: int,
    distance: float,
    linkIndexA: int = ANY_LINK,
    linkIndexB: int = ANY_LINK,
    collisionShapeA: int = -1,
    collisionShapeB: int = -1,
    collisionShapePositionA: Vector | None = None,
    collisionShapePositionB: Vector | None = None,
    collisionShapeOrientationA: Vector | None = None,
    collisionShapeOrientationB: Vector | None = None,
) -> tuple[Point, ...]:
    """Nearest points of two bodies' links, for pairs of shapes within a distance (m); forces are 0.

    With collisionShapeA or collisionShapeB a shape at a pose takes the place of that body.
    """
    import mujoco

    from roboyard.pybullet.loose_shapes import placed

    scene = client.scene
    limit = number(distance)
    with placed(
        scene,
        (
            whole(bodyA),
            whole(linkIndexA),
            whole(collisionShapeA),
            collisionShapePositionA,
            collisionShapeOrientationA,
        ),
        (
            whole(bodyB),
            whole(linkIndexB),
            whole(collisionShapeB),
            collisionShapePositionB,
            collisionShapeOrientationB,
        ),
    ) as (world, first, second):
        if not first or not second:
            return ()
        data, model = world.kinematics(), world.live_model
        points, ends = [], np.zeros(6)
        for body_a, link_a, geom_a in first:
            for body_b, link_b, geom_b in second:
                if (body_a, link_a) == (body_b, link_b) and body_a >= 0:
                    continue
                gap = mujoco.mj_geomDistance(model, data, geom_a, geom_b, max(limit, 1e-6), ends)
                if gap > limit or (gap == limit and not ends.any()):
                    continue
                points.append(_nearest(body_a, body_b, link_a, link_b, float(gap), ends))
        return tuple(points)


def _nearest(body_a: int, body_b: int, link_a: int, link_b: int, gap: float, ends: np.ndarray) -> Point:
    on_a, on_b = ends[:3].copy(), ends[3:].copy()
    normal = on_a - on_b
    length = float(np.linalg.norm(normal))
    normal = normal / length if length > 1e-12 else np.array([0.0, 0.0, 1.0])
    if gap < 0.0:
        normal = -normal
    nothing = (0.0, 0.0, 0.0)
    return (
        *(0, body_a, body_b, link_a, link_b, tuple(on_a.tolist()), tuple(on_b.tolist())),
        *(tuple(normal.tolist()), gap, 0.0, 0.0, nothing, 0.0, nothing),
    )


def _order(a: tuple[int, int], b: tuple[int, int], wanted: tuple[int, int, int, int]) -> int | None:
    """1 where a contact fits as it is, -1 where it fits the other way round, None where it does not."""
    body_a, body_b, link_a, link_b = wanted
    for sign, first, second in ((1, a, b), (-1, b, a)):
        fits_a = (body_a < 0 or first[0] == body_a) and (link_a == ANY_LINK or first[1] == link_a)
        fits_b = (body_b < 0 or second[0] == body_b) and (link_b == ANY_LINK or second[1] == link_b)
        if fits_a and fits_b:
            return sign
    return None


def geoms_of(scene: Scene, body: int, link: int) -> list[tuple[int, int, int]]:
    """(body, link, MuJoCo geom) of a body's collision shapes, or of one link's."""
    if body not in scene.bodies:
        return []
    record = scene.ready(body, "")
    found = []
    for index, handle in enumerate(record.body.links):
        if link in (ANY_LINK, index - 1):
            found += [(body, index - 1, geom) for geom in handle.geom_ids]
    return found
