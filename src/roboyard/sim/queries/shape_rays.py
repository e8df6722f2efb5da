"""Rays against the collision shapes of a world, in compiled code.

MuJoCo intersects a ray with each shape; here it does so with those whose bounding spheres the ray meets.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from roboyard._records import NamedTuple
from roboyard.native import Bundle, c_function, can_call, compiled, record
from roboyard.sim.mujoco_library import mujoco_library

PLANE, MESH, HEIGHTFIELD, SDF = 0, 7, 1, 8
"""MuJoCo's kinds of shapes that rays meet in ways of their own."""
_TAKES_LONG = np.bincount([MESH, HEIGHTFIELD], minlength=16) > 0
"""(16,) whether rays meet a kind of shape in the two ways that take long: those of meshes and of fields."""
_SLACK = 1e-9
"""Share by which bounding spheres are taken larger, and length (m)."""
ALONG = 1e-15
"""Share of a ray that is along a plane's normal, at least; MuJoCo's `mjMINVAL`."""
_VECTOR = 24
"""Bytes of three numbers."""

mju_rayGeom = c_function("mju_rayGeom", "i8 i8 i8 i8 i8 i4 i8 -> f8", library=mujoco_library)
mj_rayMesh = c_function("mj_rayMesh", "i8 i8 i4 i8 i8 i8 -> f8", library=mujoco_library)
mj_rayHfield = c_function("mj_rayHfield", "i8 i8 i4 i8 i8 i8 -> f8", library=mujoco_library)


class RayShapes(NamedTuple):
    """The shapes that rays may meet, in MuJoCo's arrays."""

    rows: Any
    """(k,) MuJoCo's geoms; those that take long to intersect come last, when others may be nearer."""
    geom_type: Any
    geom_size: Any
    geom_rbound: Any
    geom_matid: Any
    geom_rgba: Any
    mat_rgba: Any
    geom_xpos: Any
    geom_xmat: Any
    model: int
    """Address of MuJoCo's model."""
    data: int
    """Address of MuJoCo's data."""
    has_backs: int
    """1 where planes are met from behind, too, as in Bullet; MuJoCo's are not."""


RAY_SHAPES = record(
    RayShapes, "i4[::1] i4[::1] f8[:,::1] f8[::1] i4[::1] f4[:,::1] f4[:,::1] f8[:,::1] f8[:,::1] i8 i8 i8"
)
SHAPES = Bundle((RAY_SHAPES,))
_OF_MODEL = ("geom_type", "geom_size", "geom_rbound", "geom_matid", "geom_rgba", "mat_rgba")
WORK = 13
"""Numbers of a ray: start (m), direction, a normal, then the normal and the distance (m) of the hit."""


def ray_records(
    model: Any, data: Any, groups: np.ndarray, *, has_backs: bool, before: RayShapes | None = None
) -> RayShapes | None:
    """Return the shapes of some of MuJoCo's groups for the loops below; None where these cannot take them.

    Args:
        model: MuJoCo's model.
        data: MuJoCo's data.
        groups: (6,) whether the shapes of each group are met.
        has_backs: whether planes are met from behind, too.
        before: shapes of the same arrays, of which only other ones may be in these groups now.
    """
    rows = np.flatnonzero(groups.take(model.geom_group, mode="clip")).astype(np.int32)
    kinds = model.geom_type[rows]
    if (before is None and not can_call(mujoco_library)) or (kinds == SDF).any():
        return None
    takes_long = _TAKES_LONG[kinds]
    if takes_long.any():
        rows = rows[np.argsort(takes_long, kind="stable")]
    if before is not None and before.has_backs == has_backs:
        return before._replace(rows=rows)
    fields = {name: getattr(model, name) for name in _OF_MODEL}
    addresses = {"model": model._address, "data": data._address, "has_backs": int(has_backs)}
    return RayShapes(rows, geom_xpos=data.geom_xpos, geom_xmat=data.geom_xmat, **fields, **addresses)


def is_hidden(shapes, geom):  # pragma: no cover
    """Return whether a shape is invisible, which MuJoCo's rays pass."""
    material = shapes.geom_matid[geom]
    if material >= 0:
        return shapes.mat_rgba[material, 3] == 0.0
    return shapes.geom_rgba[geom, 3] == 0.0


def distance_on_ray(shapes, geom, start, direction, normal, work):  # pragma: no cover
    """Return the distance (m) at which a ray meets a shape, negative where it does not, and its normal.

    start, direction, normal: addresses of three numbers each, the first ones of `work`.
    """
    kind = shapes.geom_type[geom]
    if kind == MESH:
        return mj_rayMesh(shapes.model, shapes.data, geom, start, direction, normal)
    if kind == HEIGHTFIELD:
        return mj_rayHfield(shapes.model, shapes.data, geom, start, direction, normal)
    distance = mju_rayGeom(
        shapes.geom_xpos.ctypes.data + _VECTOR * geom,
        shapes.geom_xmat.ctypes.data + 3 * _VECTOR * geom,
        shapes.geom_size.ctypes.data + _VECTOR * geom,
        start,
        direction,
        kind,
        normal,
    )
    if distance < 0.0 and kind == PLANE and shapes.has_backs > 0:
        return distance_from_behind(shapes, geom, work)
    return distance


def distance_from_behind(shapes, geom, work):  # pragma: no cover
    """Return the distance (m) at which a ray meets a plane from behind, else -1, and write the normal."""
    height = along = 0.0
    for k in range(3):
        axis = shapes.geom_xmat[geom, 3 * k + 2]
        height += axis * (work[k] - shapes.geom_xpos[geom, k])
        along += axis * work[3 + k]
        work[6 + k] = -axis
    return -height / along if height < 0.0 and along > ALONG else -1.0


def first_on_ray(shapes, work, place, length):  # pragma: no cover
    """Return the first shape that a ray meets, -1 without one, and write the hit to `work`.

    place: address of `work`. length: of the ray; shapes beyond may be skipped (m).
    """
    x, y, z, u, v, w = work[0], work[1], work[2], work[3], work[4], work[5]
    start, direction, normal = place, place + _VECTOR, place + 2 * _VECTOR
    nearest, found = math.inf, -1
    for row in range(len(shapes.rows)):
        geom = shapes.rows[row]
        radius, places = shapes.geom_rbound[geom], shapes.geom_xpos
        if radius > 0.0:
            a, b, c = places[geom, 0] - x, places[geom, 1] - y, places[geom, 2] - z
            apart, along = a * a + b * b + c * c, a * u + b * v + c * w
            reach = radius + _SLACK * (1.0 + radius)
            if apart - along * along > reach * reach + _SLACK * _SLACK * apart:
                continue
            if along < -reach or along - reach > min(nearest, length):
                continue
        if is_hidden(shapes, geom):
            continue
        distance = distance_on_ray(shapes, geom, start, direction, normal, work)
        if 0.0 <= distance < nearest or (distance == nearest and geom < found):
            nearest, found = distance, geom
            for k in range(3):
                work[9 + k] = work[6 + k]
    work[12] = nearest
    return found


@compiled(SHAPES, "f8 f8 f8 f8 f8 f8 f8 f8[::1] -> i8", library=mujoco_library)
def cast_ray(shapes, x, y, z, u, v, w, length, work):  # pragma: no cover
    """Return the first shape that a ray meets, -1 without one; its normal and distance (m) are in `work`.

    x, y, z: start (m). u, v, w: unit vector. length: shapes beyond may be skipped (m). work: (WORK,).
    """
    work[0], work[1], work[2], work[3], work[4], work[5] = x, y, z, u, v, w
    return first_on_ray(shapes, work, work.ctypes.data, length)


@compiled(SHAPES, "f8[:,:] f8[:,::1] f8[::1] f8[::1] i4[::1] f8[::1] f8[:,::1]", library=mujoco_library)
def cast_rays(shapes, starts, directions, lengths, work, geoms, distances, normals):  # pragma: no cover
    """Fill in the first shape (-1 without one), distance (m) and normal of each ray.

    starts: (k, 3), or (1, 3) of all rays (m). directions: (k, 3) unit vectors. lengths: (k,) shapes beyond
    may be skipped (m). work: (WORK,).
    """
    for i in range(len(lengths)):
        start = min(i, len(starts) - 1)
        for k in range(3):
            work[k], work[3 + k] = starts[start, k], directions[i, k]
        geoms[i] = first_on_ray(shapes, work, work.ctypes.data, lengths[i])
        distances[i] = work[12] if geoms[i] >= 0 else -1.0
        for k in range(3):
            normals[i, k] = work[9 + k] if geoms[i] >= 0 else 0.0
