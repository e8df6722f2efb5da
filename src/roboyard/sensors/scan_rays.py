"""Cast all rays of a lidar at once: compiled loops for simple solids, MuJoCo for meshes and height fields.

MuJoCo tests every shape in each ray's broad phase. Here each shape is first projected onto the grid of rays,
and shapes are processed nearest first, so that most occluded shapes are never intersected.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sensors.scan_pattern import ScanPattern

_kernels = lazy_module("roboyard.sensors.kernels.scan")

_HIDDEN_GROUP = 5
"""MuJoCo geom group of shapes excluded from a ray cast."""


def cast_scan(
    model: Any, data: Any, pattern: ScanPattern, position: Array, rotation: Array, is_target: np.ndarray
) -> tuple[np.ndarray, Array]:
    """Return the geom that each ray hits first and its distance (m), both (rows, columns); -1 for no hit.

    Args:
        model: MuJoCo's model.
        data: its data with present geom poses.
        pattern: directions and range of the rays.
        position: (3,) of the lidar in the world (m).
        rotation: (3, 3) of the lidar in the world.
        is_target: (ngeom,) bool: whether rays can hit the geom. Fully transparent geoms are skipped in any
            case.
    """
    simple, other = _kinds(model, is_target)
    shape = (pattern.rows, pattern.columns)
    geoms = np.full(shape, -1, dtype=np.int32)
    distances = np.full(shape, np.inf)
    if len(other):
        _mesh_hits(model, data, pattern, position, rotation, other, geoms, distances)
    if len(simple):
        _kernels().scan_solids(
            model.geom_type, model.geom_size, model.geom_aabb, data.geom_xpos,
            data.geom_xmat.reshape(-1, 3, 3), simple, position, np.ascontiguousarray(rotation),
            pattern.directions, pattern.grid, float(pattern.max_range), geoms, distances,
        )  # fmt: skip
    return geoms, distances


def _kinds(model: Any, is_target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of simple solids and of all other shapes among the targets that are not transparent."""
    from roboyard._mujoco import mujoco

    kind, clear = model.geom_type, model.geom_rgba[:, 3] == 0.0
    if clear.any() and model.nmat:
        material = model.geom_matid
        clear &= (material < 0) | (model.mat_rgba[material, 3] == 0.0)
    seen = is_target & ~clear
    is_other = (kind == int(mujoco.mjtGeom.mjGEOM_HFIELD)) | (kind >= int(mujoco.mjtGeom.mjGEOM_MESH))
    return np.flatnonzero(seen & ~is_other), np.flatnonzero(seen & is_other)


def _mesh_hits(
    model: Any,
    data: Any,
    pattern: ScanPattern,
    position: Array,
    rotation: Array,
    rows: np.ndarray,
    geoms: np.ndarray,
    distances: Array,
) -> None:
    """Write the hits on meshes and height fields, found by MuJoCo, into `geoms` and `distances`."""
    from roboyard._mujoco import mujoco

    vectors = pattern.directions.reshape(-1, 3) @ rotation.T
    hit, far = np.empty(geoms.size, dtype=np.int32), np.empty(geoms.size)
    groups = model.geom_group.copy()
    model.geom_group[:] = _HIDDEN_GROUP
    model.geom_group[rows] = 0
    try:
        mujoco.mj_multiRay(
            model, data, position, vectors.ravel(), np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8), True, -1,
            hit, far, None, geoms.size, pattern.max_range,
        )  # fmt: skip
    finally:
        model.geom_group[:] = groups
    met = hit.reshape(geoms.shape) >= 0
    geoms[met] = hit.reshape(geoms.shape)[met]
    distances[met] = far.reshape(geoms.shape)[met]
