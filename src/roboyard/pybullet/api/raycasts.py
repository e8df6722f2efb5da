"""Ray tests, axis-aligned bounding boxes and overlap queries."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from math import hypot, isfinite, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

import roboyard.pybullet.bullet_rules.ray_kernels as kernels
from roboyard._lazy import lazy_module
from roboyard._records import NamedTuple
from roboyard.pybullet.bullet_rules.ray_starts import MOST_GRAZING
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import number, vector3, vector3_or, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import (
    is_machine_code,
    replace_boxes,
    replace_overlaps,
    replace_rays,
)
from roboyard.pybullet.fast.ray_masks import LARGEST_MASK, key_of
from roboyard.pybullet.state.bodies.body_records import MULTIBODY, RIGID_BODY
from roboyard.pybullet.state.frames import BROADPHASE_MARGIN
from roboyard.sim.queries.rays import ShapeHit, shapes_on_ray, surfaces_on_ray
from roboyard.transforms import matrix_from_quaternion

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord, LinkBoxes, SceneBoxes
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Vector = Sequence[float]
Triple = tuple[float, ...]
Hit = tuple[int, int, float, tuple[float, ...], tuple[float, ...]]
_NOTHING = (0.0, 0.0, 0.0)
_MISS: Hit = (-1, -1, 1.0, _NOTHING, _NOTHING)
link_groups = lazy_module("roboyard.pybullet.state.bodies.link_groups")
_MOST_MASKS = 32
"""Masks for which machine code casts rays, counted twice where it also finds hits by numbers."""
_RESUME_OFFSET = 1e-5
"""Fraction of the ray beyond a hit where the search for the next one starts."""


@command()
def rayTest(
    client: Client,
    rayFromPosition: Vector,
    rayToPosition: Vector,
    collisionFilterMask: int = -1,
    reportHitNumber: int = -1,
) -> tuple[Hit, ...]:
    """Return the first hit (or the one of reportHitNumber) between two points (m); see rayTestBatch.

    A point without three numbers is the origin, as in PyBullet.
    """
    start = vector3_or(rayFromPosition, _NOTHING)
    end = vector3_or(rayToPosition, _NOTHING)
    scene = client.scene
    if not scene.bodies:
        return (_MISS,)
    mask, wanted = whole(collisionFilterMask), whole(reportHitNumber)
    (hit,) = _cast(scene, (start,), (end,), mask, wanted)
    return (hit,)


@command()
def rayTestBatch(
    client: Client,
    rayFromPositions: Sequence[Vector],
    rayToPositions: Sequence[Vector],
    numThreads: int = 1,
    parentObjectUniqueId: int = -1,
    parentLinkIndex: int = -1,
    reportHitNumber: int = -1,
    collisionFilterMask: int = -1,
    fractionEpsilon: float = 1.0,
) -> tuple[Hit, ...]:
    """Return the first hit of each of k rays.

    Args:
        rayFromPositions: (k, 3) start points (m) in the world, or in the parent link's inertial frame.
        rayToPositions: (k, 3) end points (m).
        numThreads: ignored; all rays use one thread.
        parentObjectUniqueId: body that the rays move with; -1 for none.
        parentLinkIndex: link of that body; with one that is not there, rays do not move.
        reportHitNumber: report the n-th (from 0) of all shapes that the ray enters instead of the nearest,
        counted from the shape created last, which is mostly Bullet's order.
        collisionFilterMask: hit only shapes whose filter group has one of these bits.
        fractionEpsilon: ignored; each shape is hit once.

    Returns:
        For each ray: body, link, fraction, position (m), normal; (-1, -1, 1.0, zeros, zeros) for a miss.

    Raises:
        error: the lists differ in length, are not made of points, or are too long.
    """
    starts, ends = _points(rayFromPositions), _points(rayToPositions)
    if len(starts) != len(ends):
        raise failure(
            "Size of from_positions need to be equal to size of to_positions.",
            f"got {len(starts)} start points and {len(ends)} end points",
        )
    if len(starts) > c.MAX_RAY_INTERSECTION_BATCH_SIZE:
        raise failure(
            "Number of rays exceed the maximum batch size.",
            f"got {len(starts)} rays, at most {c.MAX_RAY_INTERSECTION_BATCH_SIZE}",
        )
    scene, record = client.scene, None
    if whole(parentObjectUniqueId) in scene.bodies:
        record = scene.ready(parentObjectUniqueId, "")
        link = -1 if record.kind == RIGID_BODY else whole(parentLinkIndex)
        if -1 <= link < record.joint_count:
            position, orientation = record.to_inertial(*record.body.links[link + 1].pose, link)
            turned = matrix_from_quaternion(orientation).T
            starts, ends = position + starts @ turned, position + ends @ turned
    number(fractionEpsilon)
    found = _cast(scene, starts, ends, whole(collisionFilterMask), whole(reportHitNumber))
    if record is not None and record.kind == MULTIBODY:
        _prepare_parent(scene, record)
    return found


@command()
def getAABB(
    client: Client, bodyUniqueId: int, linkIndex: int = -1
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the lower and upper corner (m) of the box around a link's collision shapes, in the world.

    Raises:
        error: the body or link does not exist.
    """
    scene = client.scene
    if whole(bodyUniqueId) < 0:
        raise failure("getAABB failed; invalid bodyUniqueId", f"body ids start at 0, got {bodyUniqueId}")
    if whole(linkIndex) < -1:
        raise failure("getAABB failed; invalid linkIndex", f"links start at -1, got {linkIndex}")
    record = scene.bodies.get(bodyUniqueId)
    if record is None or record.revision != scene.world.revision or scene.world.is_stale:
        boxes = None if record is None else _awaiting_boxes(scene, record, linkIndex)
        if boxes is not None:
            return boxes.read(linkIndex)
        record = scene.ready(bodyUniqueId, "getAABB failed.")
    if linkIndex >= record.joint_count:
        raise failure("getAABB failed.", f"body {bodyUniqueId} has no link {linkIndex}")
    if record.soft is not None:
        nodes = record.soft.positions
        lower, upper = nodes.min(axis=0) - record.soft.radius, nodes.max(axis=0) + record.soft.radius
        return tuple(lower.tolist()), tuple(upper.tolist())
    return (record.link_boxes or _boxes(scene, record)).read(linkIndex)


@command()
def getOverlappingObjects(
    client: Client, aabbMin: Vector, aabbMax: Vector
) -> tuple[tuple[int, int], ...] | None:
    """Return body and link of every link whose box, enlarged by 2 cm, overlaps a box (m); None if none does.

    Boxes of bodies that were added since the last step are not enlarged, until they are placed. The body
    created last comes first, which is mostly Bullet's order.

    Raises:
        error: a corner does not have three numbers.
    """
    low = vector3(aabbMin, "getOverlappingObjects: aabbMin")
    high = vector3(aabbMax, "getOverlappingObjects: aabbMax")
    scene = client.scene
    if not scene.bodies:
        return None
    world, kept = scene.world, scene.link_boxes
    if kept is None or kept[0] != world.revision or world.is_stale:
        kept = _all_boxes(scene)
    return kept[1].inside(low, high, BROADPHASE_MARGIN) or None


def _all_boxes(scene: PhysicsScene) -> tuple[int, SceneBoxes]:
    """Return the World's revision and the boxes around all links, which the scene keeps."""
    scene.world.ensure_compiled()
    in_order = sorted(scene.bodies.values(), key=lambda record: record.body.id)
    records = [scene.ready(record.number, "") for record in in_order]
    arrays = [(record.link_boxes or _boxes(scene, record)).arrays for record in records]
    found = scene.link_boxes = scene.world.revision, link_groups().SceneBoxes(scene, records, arrays)
    return found


def _awaiting_boxes(scene: PhysicsScene, record: BodyRecord, link: int) -> LinkBoxes | None:
    """Return the boxes around a body's links while a compile is awaited; None where that has to be now."""
    lone = scene.alone(record)
    if link >= record.joint_count or (lone is None and not scene.has_awaited_frames(record)):
        return None
    if lone is None:
        return link_groups().AwaitingBoxes(record, scene.world.awaited_frames)
    if record.link_boxes is None:
        record.link_boxes = link_groups().AwaitingBoxes(record, lone.kinematics)
    return record.link_boxes


def _boxes(scene: PhysicsScene, record: BodyRecord) -> LinkBoxes:
    """Return the boxes around a body's links, which the record keeps."""
    found = record.link_boxes = link_groups().LinkBoxes(scene, record)
    return found


def _points(values: Sequence[Vector]) -> np.ndarray:
    try:
        points = np.array(values, dtype=float)
        if points.ndim == 2 or points.size == 0:
            return points.reshape(-1, 3)
    except (TypeError, ValueError):
        pass
    raise failure(
        "Items in the from/to positions need to be an [x,y,z] list of 3 floats/doubles",
        f"got {str(values)[:80]}",
    )


def _cast(
    scene: PhysicsScene,
    starts: Sequence[Any] | np.ndarray,
    ends: Sequence[Any] | np.ndarray,
    mask: int,
    wanted: int,
) -> tuple[Hit, ...]:
    """Return the hits of (k, 3) rays (m); rays pass cores that they start in and shapes outside the mask.

    Rays that are not finite hit nothing, as in Bullet.
    """
    count = len(starts)
    if not scene.bodies or not count:
        return (_MISS,) * count
    room, shapes = None, scene.shapes.margin_shapes
    if not scene.world.soft:
        if wanted < 0:
            room = shapes.enter_first(starts, ends, mask)
        else:
            room = shapes.enter_numbered(starts, ends, mask, wanted)
    if room is None:
        return tuple(
            _numbered_hit(scene, tuple(start), tuple(end), mask, wanted)
            for start, end in zip(np.asarray(starts).tolist(), np.asarray(ends).tolist(), strict=True)
        )
    is_prepared = is_machine_code("rayTest") or is_machine_code("rayTestBatch")
    if is_prepared and shapes.uses > 1:  # for one call between changes it would take longer
        _prepare(scene, mask, is_numbered=wanted >= 0)
    if count == 1:
        return (_hit_of(scene, room.geoms.item(0), room.hits[0].tolist()),)
    found = zip(room.geoms[:count].tolist(), room.hits[:count].tolist(), strict=True)
    return tuple(_hit_of(scene, geom, numbers) for geom, numbers in found)


def _hit_of(scene: PhysicsScene, geom: int, numbers: list[float]) -> Hit:
    """Return a hit of a MuJoCo geom, -1 for none, from its (7,) fraction, point (m) and normal."""
    if geom < 0:
        return _MISS
    fraction, x, y, z, i, j, k = numbers
    number_, link, _ = scene.shapes.place_of(geom)
    return number_, link, fraction, (x, y, z), (i, j, k)


def _prepare(scene: PhysicsScene, mask: int, *, is_numbered: bool) -> None:
    """Let machine code cast as many rays as there is room for, and find hits by numbers."""
    if abs(mask) > LARGEST_MASK:
        return
    world, bundle, key = scene.world, scene.shapes.margin_shapes.bundle(mask), key_of(mask, is_numbered)
    known = world.prepared.get("rays")
    if known is None or bundle is None or (key in known and known[key][4] is bundle):
        return
    if len(known) >= _MOST_MASKS:
        known.clear()
    room = bundle.records[2]
    owners = [
        scene.shapes.place_of(geom)[:2] if body >= 0 else (-1, -1)
        for geom, (body, _) in enumerate(world.geom_owners)
    ]
    loop = kernels.enter_numbered if is_numbered else kernels.enter_first
    parents: Any = next(iter(known.values()))[-2] if known else {}
    known[key] = (
        *(world, scene.filters, partial(world.link_frames, keeps_last=True)),
        *(loop, bundle, MOST_GRAZING, room.starts, room.ends, room.geoms, room.hits),
        *(np.array(owners, np.int64).reshape(-1), *scene.shapes.margin_shapes.numbering),
        *(link_groups().chain_kernels().carry_rays, link_groups().chain_of(world), parents),
        scene.filters.changes,
    )


def _prepare_parent(scene: PhysicsScene, record: BodyRecord) -> None:
    """Let machine code cast rays that move with a body's links."""
    known: Any = scene.world.prepared.get("rays")
    if not known or record.soft is not None:
        return
    parents = next(iter(known.values()))[-2]
    if record.number not in parents:
        frames, rows = link_groups().inertial_frames(record), np.array(record.rows, np.int64)
        parents[record.number] = frames, rows


def _numbered_hit(scene: PhysicsScene, start: Triple, end: Triple, mask: int, wanted: int) -> Hit:
    """Return the first hit, or the `wanted`-th (from 0) of all, counted from the shape created last."""
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    if not isfinite(sum(start) + sum(way)) or way == _NOTHING:
        return _MISS
    if wanted < 0:
        return next(_entering_hits(scene, start, way, mask), _MISS)
    hits = list(_entering_hits(scene, start, way, mask))
    hits.sort(key=lambda hit: (-scene.bodies[hit[0]].body.id, -hit[1], hit[2]))
    return hits[wanted] if wanted < len(hits) else _MISS


class _Boxes(NamedTuple):
    """MuJoCo's arrays that `inwards_of_side` reads."""

    geom_type: np.ndarray
    geom_size: np.ndarray
    geom_xpos: np.ndarray
    geom_xmat: np.ndarray


def _entering_hits(scene: PhysicsScene, start: Triple, way: Triple, mask: int) -> Iterator[Hit]:
    """Yield the hits of all shapes that a ray enters and the mask selects, nearest first."""
    world = scene.world
    around = scene.shapes.margin_shapes.around_one(start, way, mask)
    if around is not None:
        yield _hit_at_start(scene, start, *around)
    hits = _soft_hits(scene, start, way, mask) if world.soft else []
    met, length = shapes_on_ray(world, start, way), hypot(*way)
    model, data, direction = world.live_model, world.live_data, (*start, *(part / length for part in way))
    boxes = _Boxes(model.geom_type, model.geom_size, data.geom_xpos, data.geom_xmat)
    for geom in met:
        *moved, passes = kernels.inwards_of_side(boxes, geom, direction, *start)
        if passes < 0.0:
            continue
        origin = tuple(s + m for s, m in zip(start, moved, strict=True))
        surfaces = surfaces_on_ray(world, geom, origin, way, _RESUME_OFFSET)
        if around is not None and geom == around[0]:
            next(surfaces, None)
        hits += filter(None, (_entering_hit(scene, start, way, mask, surface) for surface in surfaces))
    yield from sorted(hits, key=lambda hit: hit[2])


def _entering_hit(scene: PhysicsScene, start: Triple, way: Triple, mask: int, found: ShapeHit) -> Hit | None:
    """Return the hit of a shape that a ray meets; None if the ray leaves it, or the mask hides it."""
    geom, fraction, normal = found
    x, y, z = way
    slope = x * normal[0] + y * normal[1] + z * normal[2]
    if slope > 0.0:
        return None
    number_, link, margin = scene.shapes.place_of(geom)
    if not scene.filters.shows(number_, link, mask):
        return None
    if margin:
        length = sqrt(x * x + y * y + z * z)
        fraction = max(fraction - margin / max(-slope, length / MOST_GRAZING), 0.0)
    at = (start[0] + fraction * x, start[1] + fraction * y, start[2] + fraction * z)
    return number_, link, fraction, at, normal


def _hit_at_start(scene: PhysicsScene, start: Triple, geom: int, normal: Triple) -> Hit:
    """Return the hit of a ray that starts in a shape's margin."""
    number_, link, _ = scene.shapes.place_of(geom)
    return number_, link, 0.0, start, normal


def _soft_hits(scene: PhysicsScene, start: Triple, way: Triple, mask: int) -> list[Hit]:
    """Return the first hit of each soft body that the mask selects, nearest first."""
    from roboyard.sim.soft.rays import first_hits

    found = []
    for surface in scene.world.soft_surfaces():
        fraction, body, normal = first_hits([surface], np.array([start]), np.array([way]))
        if body[0] >= 0:
            number_ = scene.record_of(int(body[0])).number
            if scene.filters.group_of(number_, -1) & mask:
                at = tuple(s + fraction[0] * w for s, w in zip(start, way, strict=True))
                found.append((number_, -1, float(fraction[0]), at, tuple(normal[0].tolist())))
    return sorted(found, key=lambda hit: hit[2])


START.later(replace_boxes, "getAABB")
START.later(replace_overlaps, "getOverlappingObjects")
START.later(replace_rays, "rayTest", "rayTestBatch")
