"""Ray casts against the shapes of a world, one or many."""

from __future__ import annotations

import math
import typing
from collections.abc import Iterator
from typing import Any

import numpy as np

import roboyard.sim.queries.shape_rays as shape_rays
from roboyard._arrays import ArrayLike
from roboyard._records import dataclass
from roboyard.errors import RoboyardError
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.link import Link
from roboyard.sim.queries.ray_kernels import keep_hits, point_rays
from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True)
class RayHit:
    """The first surface along one ray."""

    link: Link
    position: Array
    """(3,) point in the world frame (m)."""
    normal: Array
    """(3,) unit normal, outwards, in the world frame."""
    distance: float
    """Distance from the ray's start (m)."""
    fraction: float
    """0 at the ray's start, 1 at its end"""

    @property
    def body(self) -> Body:
        """The body of the link."""
        return typing.cast(Body, self.link.body)


@dataclass(frozen=True, kw_only=True, slots=True)
class RayHits:
    """The first surfaces along k rays; rays without a hit have owner -1 and fraction 1."""

    owners: np.ndarray
    """(k, 2) int32: body id and link index; -1, -1 for a miss."""
    fraction: Array
    """(k,) 0 at the ray's start, 1 at its end."""
    position: Array
    """(k, 3) points in the world frame (m); the ray's end for a miss."""
    normal: Array
    """(k, 3) unit normals in the world frame; zeros for a miss."""
    geoms: np.ndarray
    """(k,) int32: MuJoCo geoms; -1 for a miss or a soft body."""

    @property
    def hit(self) -> np.ndarray:
        """(k,) bool: whether a ray has a hit."""
        return self.owners[:, 0] >= 0


_COLLISIONS = np.array([1, 1, 0, 1, 1, 1], dtype=np.uint8)
"""Groups of shapes that rays may hit: all but the visual ones."""
_SLACK = 1e-9
"""Share by which bounding spheres are taken larger, and length (m)."""
_VISUALS = np.array([1, 1, 1, 0, 1, 1], dtype=np.uint8)
"""All but the collision shapes."""
_TOUCHED, _SEEN = "shapes that rays meet", "shapes that rays show"
"""Names in `Engine.of_arrays`."""


def cast(world: Engine[Body], starts: ArrayLike, ends: ArrayLike, *, visual: bool = False) -> RayHits:
    """Cast rays from `starts` to `ends`.

    A ray that starts inside a shape hits that shape's surface from inside.

    Args:
        world: the world.
        starts: (k, 3) or (3,) points in the world frame (m).
        ends: (k, 3) or (3,) points in the world frame (m).
        visual: cast against the visual shapes instead of the collision shapes.

    Raises:
        RoboyardError: points do not have three coordinates, or a coordinate is not finite.
    """
    origins, targets = np.atleast_2d(starts).astype(float), np.atleast_2d(ends).astype(float)
    if origins.shape[-1] != 3 or targets.shape[-1] != 3:
        raise RoboyardError(f"rays need (k, 3) starts and ends, got {origins.shape} and {targets.shape}")
    k = max(len(origins), len(targets)) if len(origins) and len(targets) else 0
    if len(origins) not in (1, k) or len(targets) not in (1, k):
        raise RoboyardError(f"rays need as many starts as ends, got {len(origins)} and {len(targets)}")
    vectors, directions, lengths = np.empty((k, 3)), np.empty((k, 3)), np.empty(k)
    row = point_rays(origins, targets, vectors, directions, lengths)
    if row >= 0:
        start, end = (points[row if len(points) > 1 else 0].tolist() for points in (origins, targets))
        raise RoboyardError(f"ray {row}: start {start} and end {end} must be finite")
    world.show_triangles()
    world.link_frames(keeps_last=True)
    geoms, normals = np.full(k, -1, dtype=np.int32), np.zeros((k, 3))
    distances = _meet(world, origins, directions, lengths, geoms, normals, visual=visual)
    fraction, owners = np.empty(k), np.empty((k, 2), dtype=np.int32)
    keep_hits(distances, lengths, world.geom_owners, geoms, normals, owners, fraction)
    surfaces = world.soft_surfaces()
    if surfaces:
        from roboyard.sim.soft.rays import first_hits

        soft = first_hits(surfaces, np.broadcast_to(origins, (k, 3)), vectors)
        nearer = soft.fraction < np.where(geoms >= 0, fraction, np.inf)
        fraction[nearer], normals[nearer], geoms[nearer] = soft.fraction[nearer], soft.normal[nearer], -1
        owners[nearer, 0], owners[nearer, 1] = soft.body[nearer], 0
    return RayHits(
        owners=owners,
        fraction=fraction,
        position=origins + fraction[:, None] * vectors,
        normal=normals,
        geoms=geoms,
    )


def _meet(
    world: Engine[Body],
    origins: Array,
    directions: Array,
    lengths: Array,
    geoms: np.ndarray,
    normals: Array,
    *,
    visual: bool,
) -> Array:
    """Fill in MuJoCo's geom, -1 without one, and the normal of the first hit of each ray.

    Returns:
        (k,) distances (m), negative without a hit; hits beyond a ray's length may be missing.
    """
    from roboyard._mujoco import mujoco

    distances, count = np.full(len(lengths), -1.0), len(lengths)
    shapes, work = world.kept_rays.get(visual) or _keep_shapes(world, visual=visual)
    if shapes is not None:
        shape_rays.cast_rays(shapes, origins, directions, lengths, work, geoms, distances, normals)
        return distances
    model, data, groups = world.live_model, world.live_data, _VISUALS if visual else _COLLISIONS
    # rays of one start skip bodies by boxes around what collides, which may not hold what is seen
    if count and not visual and (origins == origins[0]).all():
        places = geoms, distances, normals.ravel(), count, float(lengths.max())
        mujoco.mj_multiRay(model, data, origins[0], directions.ravel(), groups, True, -1, *places)
    else:
        starts = np.broadcast_to(origins, directions.shape)
        for i, (start, way) in enumerate(zip(starts, directions, strict=True)):
            found = geoms[i : i + 1], normals[i]
            distances[i] = mujoco.mj_ray(model, data, start, way, groups, True, -1, *found)
    if world.profile.hard_contacts:
        _meet_backs(model, data, groups, origins, directions, geoms, distances, normals)
    return distances


def _meet_backs(
    model: Any,
    data: Any,
    groups: np.ndarray,
    origins: Array,
    directions: Array,
    geoms: np.ndarray,
    distances: Array,
    normals: Array,
) -> None:
    """Fill in planes that rays meet from behind; see `shape_rays.distance_from_behind`."""
    shown = groups[np.clip(model.geom_group, 0, len(groups) - 1)] > 0
    for geom in np.flatnonzero(shown & (model.geom_type == shape_rays.PLANE)).tolist():
        axis = data.geom_xmat[geom, 2::3]
        height, along = (origins - data.geom_xpos[geom]) @ axis, directions @ axis
        meets = (height < 0.0) & (along > shape_rays.ALONG)
        apart = np.where(meets, -height / np.where(meets, along, 1.0), np.inf)
        nearer = apart < np.where(distances < 0.0, np.inf, distances)
        distances[nearer], geoms[nearer], normals[nearer] = apart[nearer], geom, -axis


def kept_shapes(world: Engine[Body]) -> shape_rays.RayShapes | None:
    """Return the collision shapes that rays meet, until MuJoCo's arrays change; None without machine code."""
    world.show_triangles()
    kept = world.kept_rays.get(False)
    if kept is None:
        return _records_of(world, visual=False)
    shapes: shape_rays.RayShapes | None = None if kept[0] is None else kept[0].records[0]
    return shapes


def _keep_shapes(world: Engine[Body], *, visual: bool) -> tuple[Any, Array]:
    """Return the shapes as `shape_rays` takes them, or None where it does not, and its memory."""
    records = _records_of(world, visual=visual)
    shapes = None if records is None else shape_rays.SHAPES.of(records)
    found = world.kept_rays[visual] = shapes, np.zeros(shape_rays.WORK)
    return found


def _records_of(world: Engine[Body], *, visual: bool) -> shape_rays.RayShapes | None:
    """Return the shapes as arrays; other rows of the same where bodies only took or left rows of MuJoCo."""
    groups, name = (_VISUALS, _SEEN) if visual else (_COLLISIONS, _TOUCHED)
    model, data = world.live_model, world.live_data
    before: shape_rays.RayShapes | None = world.of_arrays.get(name)
    has_backs = world.profile.hard_contacts
    found = shape_rays.ray_records(model, data, groups, has_backs=has_backs, before=before)
    if found is not None:
        world.of_arrays[name] = found
    return found


ShapeHit = tuple[int, float, tuple[float, ...]]
"""MuJoCo geom, fraction of the ray, unit normal out of the surface."""


def shapes_on_ray(world: Engine[Body], start: tuple[float, ...], way: tuple[float, ...]) -> list[int]:
    """Return the collision shapes (MuJoCo's geoms) whose bounding spheres a ray meets.

    Args:
        world: the world.
        start: (3,) point in the world frame (m).
        way: (3,) vector from there to the ray's end (m); a ray without a length meets nothing.
    """
    world.show_triangles()
    model, data = world.live_model, world.link_frames(keeps_last=True)
    length = math.hypot(*way)
    if length == 0.0 or not math.isfinite(length + sum(start)):
        return []
    is_seen = _COLLISIONS[np.clip(model.geom_group, 0, len(_COLLISIONS) - 1)] > 0
    alpha = np.where(model.geom_matid >= 0, 1.0, model.geom_rgba[:, 3])
    if model.nmat:
        alpha = np.where(model.geom_matid >= 0, model.mat_rgba[model.geom_matid, 3], alpha)
    apart, direction = data.geom_xpos - start, np.array(way) / length
    along = np.clip(apart @ direction, 0.0, length)
    nearest = np.linalg.norm(apart - along[:, None] * direction, axis=1)
    reach = model.geom_rbound
    is_met = (reach <= 0.0) | (nearest <= reach + _SLACK * (1.0 + reach))
    found: list[int] = np.flatnonzero(is_seen & is_met & (alpha > 0.0)).tolist()
    return found


def surfaces_on_ray(
    world: Engine[Body], geom: int, start: tuple[float, ...], way: tuple[float, ...], step: float
) -> Iterator[ShapeHit]:
    """Yield the surfaces of one of `shapes_on_ray` that a ray enters and leaves, nearest first.

    Args:
        world: the world.
        geom: the shape.
        start: (3,) point in the world frame (m).
        way: (3,) vector from there to the ray's end (m).
        step: fraction of the ray beyond a surface where the search for the next one starts.
    """
    length, behind = math.hypot(*way), 0.0
    origin, direction = np.array(start), np.array(way) / length
    while behind < 1.0:
        distance, normal = _distance_to(world, geom, origin + behind * length * direction, direction)
        fraction = behind + distance / length
        if distance < 0.0 or fraction > 1.0:
            return
        yield geom, fraction, tuple(normal.tolist())
        behind = fraction + step


def _distance_to(world: Engine[Body], geom: int, start: Array, direction: Array) -> tuple[float, Array]:
    """Return the distance (m) to a shape along a unit vector, negative without a hit, and the normal."""
    from roboyard._mujoco import mujoco

    model, data, normal = world.live_model, world.live_data, np.zeros(3)
    kind = int(model.geom_type[geom])
    if kind == shape_rays.MESH:
        return mujoco.mj_rayMesh(model, data, geom, start, direction, normal), normal
    if kind == shape_rays.HEIGHTFIELD:
        return mujoco.mj_rayHfield(model, data, geom, start, direction, normal), normal
    place, turn = data.geom_xpos[geom], data.geom_xmat[geom]
    distance = mujoco.mju_rayGeom(place, turn, model.geom_size[geom], start, direction, kind, normal)
    if distance < 0.0 and kind == shape_rays.PLANE and world.profile.hard_contacts:
        height, along = (start - place) @ turn[2::3], direction @ turn[2::3]
        if height < 0.0 and along > shape_rays.ALONG:
            return -height / along, -turn[2::3]
    return distance, normal


def cast_one(world: Engine[Body], start: ArrayLike, end: ArrayLike, *, visual: bool = False) -> RayHit | None:
    """Return the first surface between two points (3,) in the world frame (m), or None."""
    hits = cast(world, start, end, visual=visual)
    if not hits.hit[0]:
        return None
    body_id, link = (int(v) for v in hits.owners[0])
    length = math.dist(np.asarray(start, dtype=float), np.asarray(end, dtype=float))
    return RayHit(
        link=world.body_by_id[body_id].links[link],
        position=hits.position[0],
        normal=hits.normal[0],
        distance=float(hits.fraction[0]) * length,
        fraction=float(hits.fraction[0]),
    )
