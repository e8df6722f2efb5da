"""Contacts and nearest points."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.bullet_rules.contact_order import kind_of, tangents
from roboyard.pybullet.bullet_rules.hull_margins import margins_of_hulls
from roboyard.pybullet.face.arguments import number, whole
from roboyard.pybullet.face.commands import command

if TYPE_CHECKING:
    from roboyard.pybullet.connections import Client
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Vector = Sequence[float]
Point = tuple[Any, ...]
Place = tuple[int, int]
"""Body and link."""
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
        distance (m, negative where they overlap), normal force (N), friction force and direction, twice: what
        the body feels that Bullet names first where no bodyA is given (see `contact_order`).
    """
    wanted = whole(bodyA), whole(bodyB), whole(linkIndexA), whole(linkIndexB)
    scene = client.scene
    rows = [_listed(pair, point, wanted) for pair, point in touching(scene)]
    return tuple([row for row in rows if row is not None]) if rows else ()


def touching(scene: PhysicsScene) -> Iterable[tuple[tuple[Place, Place], Point]]:
    """The links of each contact in Bullet's order, and the row of getContactPoints from point on A on."""
    if scene.world.is_stale or scene.world.live_data.ncon == 0:
        return ()
    return _touching(scene)


def _touching(scene: PhysicsScene) -> Iterator[tuple[tuple[Place, Place], Point]]:
    from roboyard.sim.queries.contacts import contact_arrays

    arrays = contact_arrays(scene.world)
    middles = arrays.position.tolist()
    normals = arrays.frame[:, 0].tolist()
    forces = np.einsum("ij,ijk->ik", arrays.force, arrays.frame).tolist()
    kinds: dict[Place, int] = {}
    for i, distance in enumerate(arrays.distance.tolist()):
        pushing = float(arrays.force[i, 0])
        if distance > 0.0 and pushing <= 0.0:
            continue
        world_a, link_a, world_b, link_b = arrays.owners[i].tolist()
        a, b = (scene.of_world(world_a).number, link_a - 1), (scene.of_world(world_b).number, link_b - 1)
        is_turned = _comes_second(scene, a, b, kinds)
        point = _point(middles[i], normals[i], distance, pushing, forces[i], is_turned=is_turned)
        yield ((b, a) if is_turned else (a, b)), point


def _comes_second(scene: PhysicsScene, a: Place, b: Place, kinds: dict[Place, int]) -> bool:
    """Whether Bullet names b first."""
    for body, link in (a, b):
        if (body, link) not in kinds:
            kinds[(body, link)] = kind_of(scene.bodies[body].model.links[link + 1])
    if kinds[a] != kinds[b]:
        return kinds[a] < kinds[b]
    age = scene.bodies[a[0]].body.id - scene.bodies[b[0]].body.id
    return age > 0 or (age == 0 and a[1] > b[1])


def _point(
    middle: list[float],
    normal: list[float],
    distance: float,
    pushing: float,
    force: list[float],
    *,
    is_turned: bool,
) -> tuple[Any, ...]:
    """Point on A, point on B, normal on B, distance, and the forces that A feels.

    Middle, normal and force are MuJoCo's: the normal points to its second geom, which feels the force.
    """
    half, sign = 0.5 * distance, 1.0 if is_turned else -1.0
    on_b = (sign * normal[0], sign * normal[1], sign * normal[2])
    first, second = tangents(on_b)
    on_a = tuple(m + half * n for m, n in zip(middle, on_b, strict=True))
    across = (sum(f * t for f, t in zip(force, way, strict=True)) * sign for way in (first, second))
    first_force, second_force = across
    return (
        on_a, tuple(m - half * n for m, n in zip(middle, on_b, strict=True)), on_b, distance, pushing,
        first_force, first, second_force, second,
    )  # fmt: skip


def _listed(pair: tuple[Place, Place], point: Point, wanted: tuple[int, int, int, int]) -> Point | None:
    """The row of a contact as scripts get it: bodyA first where it is the second; None where unwanted.

    Only bodies and places change sides then, as in Bullet: friction stays what the pair's first link feels.
    """
    (body_a, link_a), (body_b, link_b) = pair
    on_a, on_b, normal, *rest = point
    wanted_a, wanted_b, wanted_link_a, wanted_link_b = wanted
    if wanted_a >= 0 and wanted_a != body_a:
        if wanted_a != body_b:
            return None
        body_a, link_a, body_b, link_b = body_b, link_b, body_a, link_a
        on_a, on_b, normal = on_b, on_a, (-normal[0], -normal[1], -normal[2])
    if wanted_b >= 0 and wanted_b != body_b:
        return None
    if wanted_link_a not in (ANY_LINK, link_a) or wanted_link_b not in (ANY_LINK, link_b):
        return None
    return (0, body_a, body_b, link_a, link_b, on_a, on_b, normal, *rest)


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

    Of a body and itself every link also meets itself: as deep as the link is thin.

    With collisionShapeA or collisionShapeB a shape at a pose takes the place of that body.
    """
    import mujoco

    from roboyard.pybullet.state.query_shapes import placed

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
        hulls = scene.hull_margins() if world is scene.world else margins_of_hulls(model)
        for body_a, link_a, geom_a in first:
            for body_b, link_b, geom_b in second:
                margins = float(hulls[geom_a]), float(hulls[geom_b])
                reach = max(limit + sum(margins), 1e-6)
                gap = mujoco.mj_geomDistance(model, data, geom_a, geom_b, reach, ends)
                if gap > reach or (gap == reach and not ends.any()):
                    continue
                points.append(_nearest(body_a, body_b, link_a, link_b, float(gap), ends, margins))
        return tuple(points)


def _nearest(
    body_a: int,
    body_b: int,
    link_a: int,
    link_b: int,
    gap: float,
    ends: np.ndarray,
    margins: tuple[float, float],
) -> Point:
    on_a, on_b = ends[:3].copy(), ends[3:].copy()
    normal = on_a - on_b
    length = float(np.linalg.norm(normal))
    normal = normal / length if length > 1e-12 else np.array([0.0, 0.0, 1.0])
    if gap < 0.0:
        normal = -normal
    on_a, on_b = on_a - margins[0] * normal, on_b + margins[1] * normal
    nothing = (0.0, 0.0, 0.0)
    return (
        *(0, body_a, body_b, link_a, link_b, tuple(on_a.tolist()), tuple(on_b.tolist())),
        *(tuple(normal.tolist()), gap - sum(margins), 0.0, 0.0, nothing, 0.0, nothing),
    )


def geoms_of(scene: PhysicsScene, body: int, link: int) -> list[tuple[int, int, int]]:
    """(body, link, MuJoCo geom) of a body's collision shapes, or of one link's."""
    if body not in scene.bodies:
        return []
    record = scene.ready(body, "")
    found = []
    for index, handle in enumerate(record.body.links):
        if link in (ANY_LINK, index - 1):
            found += [(body, index - 1, geom) for geom in handle.geom_ids]
    return found
