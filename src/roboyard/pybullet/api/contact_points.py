"""Contacts and closest points: getContactPoints and getClosestPoints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from roboyard.pybullet.bullet_rules.hull_margins import geom_margins
from roboyard.pybullet.face.arguments import number, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.fast.fast_commands import is_machine_code, replace_closest, replace_contacts
from roboyard.pybullet.state.bodies.body_records import NO_SIDE, Side, side_of
from roboyard.pybullet.state.contacts import ANY_LINK, Point, contacts_between, selected, touching

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.fast.closest.copies import ClosestCopies, Key
    from roboyard.pybullet.fast.closest.search import ClosestSearch
    from roboyard.pybullet.state.physics_scene import PhysicsScene
    from roboyard.pybullet.state.query_shapes import Geoms, QuerySide
    from roboyard.sim.world import World

Vector = Sequence[float]
_ZEROS = (0.0, 0.0, 0.0)
_SEARCH = "closest points"
"""Name in `Engine.of_arrays`."""
_FIELD = 1
"""MuJoCo's type of height fields."""


@command()
def getContactPoints(
    client: Client, bodyA: int = -1, bodyB: int = -1, linkIndexA: int = ANY_LINK, linkIndexB: int = ANY_LINK
) -> tuple[Point, ...]:
    """Return the contacts between bodies, as of the last step or performCollisionDetection.

    Args:
        bodyA: only contacts of this body, which is then listed first; -1 for all.
        bodyB: only contacts with this body.
        linkIndexA: only contacts of this link of bodyA.
        linkIndexB: only contacts with this link of bodyB.

    Returns:
        For each contact: 0, body A, body B, link A, link B, point on A and on B (m, world frame), normal on B
        towards A, distance (m, negative for penetration), normal force (N), then friction force (N) and
        direction, twice. Friction acts on the body that Bullet lists first (see `contact_order`).
    """
    wanted = whole(bodyA), whole(bodyB), whole(linkIndexA), whole(linkIndexB)
    found = contacts_between(client.scene, wanted)
    if found is not None:
        if is_machine_code("getContactPoints"):
            client.scene.last_step.prepare()
        return found
    kept = client.scene.last_step.kept_rows
    return selected(touching(client.scene), wanted) if kept is None else kept.between(wanted)


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
    """Return the closest points of two bodies' links, for pairs of shapes within a distance (m).

    For a body and itself, every link is also compared with itself; the distance is then minus its thickness.
    With collisionShapeA or collisionShapeB, a shape at a pose replaces that body.

    Returns:
        The fields of getContactPoints, with all forces 0.

    Raises:
        error: a collision shape does not exist.
    """
    scene = client.scene
    limit = number(distance)
    if collisionShapeA == collisionShapeB == -1:
        _show_triangles(scene.world, limit)
        first = _geoms_of(scene, whole(bodyA), whole(linkIndexA))
        second = _geoms_of(scene, whole(bodyB), whole(linkIndexB))
        if not first.places or not second.places:
            return ()
        search = _search(scene)
        if search is None or search.has_field(first) or search.has_field(second):
            return _closest_points(scene, scene.world, first.places, second.places, limit)
        found = search.points(first, second, limit)
        if is_machine_code("getClosestPoints"):
            from roboyard.pybullet.fast.closest.entries import prepare

            prepare(search, ((whole(linkIndexA), first), (whole(linkIndexB), second)))
        return found
    key = (
        (whole(bodyA), whole(linkIndexA), whole(collisionShapeA)),
        (whole(bodyB), whole(linkIndexB), whole(collisionShapeB)),
    )
    poses = (
        (collisionShapePositionA, collisionShapeOrientationA),
        (collisionShapePositionB, collisionShapeOrientationB),
    )
    copies = scene.shapes.query_shapes.copies or _make_copies(scene)
    found = copies.points(key, poses, limit)
    if found is None and copies.plan(key, _shapes_of(scene, key)):
        found = copies.points(key, poses, limit)
    if found is not None:
        if is_machine_code("getClosestPoints"):
            copies.prepare(key)
        return found
    from roboyard.pybullet.state.query_shapes import QuerySide

    sides = QuerySide(*key[0], *poses[0]), QuerySide(*key[1], *poses[1])
    with _placed(scene, *sides, limit) as (world, one, two):
        return _closest_points(scene, world, one, two, limit)


def _closest_points(
    scene: PhysicsScene, world: World, first: Geoms, second: Geoms, limit: float
) -> tuple[Point, ...]:
    """Return the closest points of all pairs of two sides' shapes within a distance (m)."""
    if not first or not second:
        return ()
    from roboyard.pybullet.bullet_rules.round_edges import edges_of_pair, gap_of

    windows = world.windows
    has_windows = windows.shows_slots
    if has_windows:
        first, second = ([k for k in geoms if not windows.hides(k[2])] for geoms in (first, second))
    data, model = world.kinematics(), world.live_model
    points, ends = list[Point](), np.zeros(6)
    kinds, has_fields = model.geom_type, model.nhfield > 0
    hulls = scene.shapes.geom_margins() if world is scene.world else geom_margins(model)
    others = [(*place, hulls.item(place[2])) for place in second]
    for body_a, link_a, geom_a in first:
        hull_a = hulls.item(geom_a)
        for body_b, link_b, geom_b, margin_b in others:
            margin_a = hull_a - windows.inset(geom_a, geom_b) if has_windows else hull_a
            reach = max(limit + (margin_a + margin_b), 1e-6)
            if has_fields and (kinds[geom_a] == _FIELD) != (kinds[geom_b] == _FIELD):
                on_field = _on_field(world, geom_a, geom_b, reach)
                if on_field is not None:
                    points += _rows((body_a, body_b, link_a, link_b), on_field, margin_a, margin_b)
                    continue
            edges = edges_of_pair(model, geom_a, geom_b, (hull_a, margin_b))
            far = reach + edges[0] + edges[1]
            gap = gap_of(model, data, geom_a, geom_b, far, edges, ends)
            if gap > far or (gap == far and not ends.any()):
                continue
            normal, widths = _direction(gap, ends), (margin_a + edges[0], margin_b + edges[1])
            points.append(_closest(body_a, body_b, link_a, link_b, gap, ends, normal, *widths))
    return tuple(points)


def _show_triangles(world: World, limit: float) -> None:
    """Give geoms to the triangles of concave meshes near other shapes, where these are not searched."""
    world.ensure_compiled()
    if world.windows.shows_slots:
        world.windows.update(limit, everything=True)


@contextmanager
def _placed(
    scene: PhysicsScene, first: QuerySide, second: QuerySide, limit: float
) -> Iterator[tuple[World, Geoms, Geoms]]:
    """Yield a world and the geoms of both sides; query shapes exist while the context lasts."""
    from roboyard.pybullet.state.query_shapes import add_query_body, query_geoms

    shapes = scene.collision_shapes
    if first.shape >= 0 and second.shape >= 0:
        world, bodies = scene.shapes.query_shapes.place(shapes, first, second)
        _show_triangles(world, limit)
        one, two = (query_geoms(body) for body in bodies)
        yield world, one, two
        return
    with ExitStack() as stack:
        added = [
            add_query_body(scene.world, shapes, side) if side.shape >= 0 else None for side in (first, second)
        ]
        for body in added:
            if body is not None:
                stack.callback(scene.world.remove, body)
        _show_triangles(scene.world, limit)
        one, two = (
            _geoms_of(scene, side.body, side.link).places if body is None else query_geoms(body)
            for side, body in zip((first, second), added, strict=True)
        )
        yield scene.world, one, two


def _make_copies(scene: PhysicsScene) -> ClosestCopies:
    """Return the copies of shapes and bodies that are used again, which the scene keeps."""
    from roboyard.pybullet.fast.closest.copies import ClosestCopies

    copies = scene.shapes.query_shapes.copies = ClosestCopies(scene)
    return copies


def _shapes_of(scene: PhysicsScene, key: Key) -> tuple[Side | None, Side | None]:
    """Return the shapes of both sides in the World; None for a shape at a pose."""
    first, second = (None if shape >= 0 else _geoms_of(scene, body, link) for body, link, shape in key)
    return first, second


def _search(scene: PhysicsScene) -> ClosestSearch | None:
    """Return the compiled search; None with geoms of triangles or without machine code."""
    world = scene.world
    if world.windows.shows_slots:
        return None
    known = world.of_arrays
    if _SEARCH not in known or (known[_SEARCH] is not None and known[_SEARCH].scene is not scene):
        from roboyard.pybullet.fast.closest.search import closest_search

        known[_SEARCH] = closest_search(scene)
    found: ClosestSearch | None = known[_SEARCH]
    return found


def _geoms_of(scene: PhysicsScene, body: int, link: int) -> Side:
    """Return the collision shapes of a body, or of one of its links."""
    if body not in scene.bodies:
        return NO_SIDE
    record = scene.ready(body, "")
    sides = record.sides
    if sides is None:
        sides = record.sides = {}
    found = sides.get(link)
    if found is None:
        found = sides[link] = side_of(
            (body, index - 1, geom)
            for index, handle in enumerate(record.body.links)
            if link in (ANY_LINK, index - 1)
            for geom in handle.geom_ids
        )
    return found


def _on_field(world: World, one: int, two: int, reach: float) -> np.ndarray | None:
    """Return (n, 10) distance (m), both closest points (m) and the direction from b to a of triangles near.

    One of the geoms is a field. None where the form of the other one is not known.
    """
    from roboyard.sim.queries.field_points import points_on_field

    is_first = world.live_model.geom_type[one] == _FIELD
    found = points_on_field(world, one, two, reach) if is_first else points_on_field(world, two, one, reach)
    if found is not None and is_first:  # the direction is from the field to the shape
        found[:, 1:7] = found[:, [4, 5, 6, 1, 2, 3]]
        found[:, 7:] *= -1.0
    return found


def _rows(
    names: tuple[int, int, int, int], found: np.ndarray, margin_a: float, margin_b: float
) -> list[Point]:
    """Return the rows of pairs of shapes from what `_on_field` returns; see `_closest`."""
    normals = found[:, 7:]
    on_a, on_b = found[:, 1:4] - margin_a * normals, found[:, 4:7] + margin_b * normals
    distances = found[:, 0] - (margin_a + margin_b)
    parts = *(map(tuple, part.tolist()) for part in (on_a, on_b, normals)), distances.tolist()
    return [
        (0, *names, a, b, normal, distance, 0.0, 0.0, _ZEROS, 0.0, _ZEROS)
        for a, b, normal, distance in zip(*parts, strict=True)
    ]


def _direction(gap: float, ends: np.ndarray) -> tuple[float, float, float]:
    """Return the direction from the second to the first of MuJoCo's closest points (6,) (m)."""
    ax, ay, az, bx, by, bz = ends.tolist()
    x, y, z = ax - bx, ay - by, az - bz
    length = sqrt(x * x + y * y + z * z)
    if length <= 1e-12:
        x, y, z, length = 0.0, 0.0, 1.0, 1.0
    if gap < 0.0:
        length = -length
    return x / length, y / length, z / length


def _closest(
    body_a: int,
    body_b: int,
    link_a: int,
    link_b: int,
    gap: float,
    ends: np.ndarray,
    normal: Sequence[float],
    margin_a: float,
    margin_b: float,
) -> Point:
    """Return the row of a pair of shapes.

    Args:
        body_a: first body.
        body_b: second body.
        link_a: link of the first body.
        link_b: link of the second body.
        gap: MuJoCo's distance (m), without margins.
        ends: (6,) closest points of the shapes without margins in the world frame (m).
        normal: direction from the second to the first shape.
        margin_a: margin of the first of Bullet's shapes (m), which brings the points closer.
        margin_b: that of the second one (m).
    """
    ax, ay, az, bx, by, bz = ends.tolist()
    x, y, z = normal
    return (
        *(0, body_a, body_b, link_a, link_b),
        *((ax - margin_a * x, ay - margin_a * y, az - margin_a * z),),
        *((bx + margin_b * x, by + margin_b * y, bz + margin_b * z),),
        *((x, y, z), gap - (margin_a + margin_b), 0.0, 0.0, _ZEROS, 0.0, _ZEROS),
    )


START.later(replace_contacts, "getContactPoints")
START.later(replace_closest, "getClosestPoints")
