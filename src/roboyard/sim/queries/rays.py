"""Ray casts against the shapes of a world, one or many."""

from __future__ import annotations

import math
import typing
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
_VISUALS = np.array([1, 1, 1, 0, 1, 1], dtype=np.uint8)
"""All but the collision shapes."""


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
    shapes, _ = world.kept_rays.get(False) or _keep_shapes(world, visual=False)
    return None if shapes is None else shapes.records[0]


def _keep_shapes(world: Engine[Body], *, visual: bool) -> tuple[Any, Array]:
    """Return the shapes as `shape_rays` takes them, or None where it does not, and its memory."""
    groups = _VISUALS if visual else _COLLISIONS
    shapes = shape_rays.ray_shapes(
        world.live_model, world.live_data, groups, has_backs=world.profile.hard_contacts
    )
    found = world.kept_rays[visual] = shapes, np.zeros(shape_rays.WORK)
    return found


ShapeHit = tuple[int, float, tuple[float, ...]]
"""MuJoCo geom, fraction of the ray, unit normal out of the surface."""


def first_shape(
    world: Engine[Body], start: tuple[float, ...], way: tuple[float, ...], behind: float = 0.0
) -> ShapeHit | None:
    """Return the first collision shape along one ray in plain numbers: `cast`, many times faster.

    Args:
        world: the world.
        start: (3,) point in the world frame (m).
        way: (3,) vector from there to the ray's end (m).
        behind: fraction of the ray that is skipped; fractions of hits still count from `start`.

    Returns:
        The shape, or None: the ray has no hit, no length, or is not finite.
    """
    x, y, z = way
    a, b, c = start
    length = math.hypot(x, y, z)
    if length == 0.0 or behind >= 1.0 or not math.isfinite(length + a + b + c):
        return None
    world.show_triangles()
    world.link_frames(keeps_last=True)
    shapes, work = world.kept_rays.get(False) or _keep_shapes(world, visual=False)
    if shapes is None:
        origin = np.array([[a + behind * x, b + behind * y, c + behind * z]])
        geoms, normal = np.zeros(1, dtype=np.int32), np.zeros((1, 3))
        ways = np.array([[x / length, y / length, z / length]])
        distance = _meet(world, origin, ways, np.array([length]), geoms, normal, visual=False).item()
        geom, normal = geoms.item(), tuple(normal[0].tolist())
    else:
        geom = shape_rays.cast_ray(
            *(shapes, a + behind * x, b + behind * y, c + behind * z),
            *(x / length, y / length, z / length, length, work),
        )
        *_, i, j, k, distance = work.tolist()
        normal = i, j, k
    fraction = behind + distance / length
    if geom < 0 or distance < 0.0 or fraction > 1.0:
        return None
    return geom, fraction, normal


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
