"""Ray casts against the shapes of a world, one or many."""

from __future__ import annotations

import math
import typing
from struct import Struct

import numpy as np
from numpy.typing import ArrayLike

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


_PACK = Struct("3d").pack_into
_COLLISIONS = np.array([1, 1, 0, 1, 1, 1], dtype=np.uint8)
"""Groups of shapes that rays may hit: all but the visual ones."""
_VISUALS = np.array([1, 1, 1, 0, 1, 1], dtype=np.uint8)
"""All but the collision shapes."""


def cast(world: Engine[Body], starts: ArrayLike, ends: ArrayLike, *, visual: bool = False) -> RayHits:
    """Cast rays from `starts` to `ends`.

    Rays from one common start share their broad phase and are several times faster. A ray that starts inside
    a shape hits that shape's surface from inside.

    Args:
        world: the world.
        starts: (k, 3) or (3,) points in the world frame (m).
        ends: (k, 3) or (3,) points in the world frame (m).
        visual: cast against the visual shapes instead of the collision shapes.

    Raises:
        RoboyardError: points do not have three coordinates, or a coordinate is not finite.
    """
    import mujoco

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
    world.kinematics()
    model, data = world.live_model, world.live_data
    groups = _VISUALS if visual else _COLLISIONS
    geoms = np.full((k, 1), -1, dtype=np.int32)
    normals = np.zeros((k, 3))
    # rays of one start skip bodies by boxes around what collides, which may not hold what is seen
    if not visual and (k == 0 or len(origins) == 1 or (origins == origins[0]).all()):
        distances = np.full(k, -1.0)
        cutoff = float(lengths.max()) if k else 0.0
        origin = origins[0] if k else np.zeros(3)
        mujoco.mj_multiRay(
            model,
            data,
            origin,
            directions.ravel(),
            groups,
            True,
            -1,
            geoms.ravel(),
            distances,
            normals.ravel(),
            k,
            cutoff,
        )
    else:
        ray = mujoco.mj_ray
        rows = zip(np.broadcast_to(origins, (k, 3)), directions, geoms, normals, strict=True)
        distances = np.array(
            [
                ray(model, data, start, way, groups, True, -1, geom, normal)
                for start, way, geom, normal in rows
            ]
        )
    geoms = geoms.ravel()
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
    import mujoco

    x, y, z = way
    length = math.hypot(x, y, z)
    if length == 0.0 or behind >= 1.0 or not math.isfinite(length + start[0] + start[1] + start[2]):
        return None
    world.show_triangles()
    data = world.kinematics()
    given = world.one_ray
    if given is None:
        vectors = np.zeros(3), np.zeros(3), np.zeros(1, dtype=np.int32), np.zeros(3)
        given = world.one_ray = (*vectors, vectors[0].data, vectors[1].data)
    origin, direction, geom, normal, origin_words, direction_words = given
    a, b, c = start
    _PACK(origin_words, 0, a + behind * x, b + behind * y, c + behind * z)
    _PACK(direction_words, 0, x / length, y / length, z / length)
    distance = mujoco.mj_ray(world.live_model, data, origin, direction, _COLLISIONS, True, -1, geom, normal)
    fraction = behind + distance / length
    if distance < 0.0 or fraction > 1.0:
        return None
    return geom.item(), fraction, tuple(normal.tolist())


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
