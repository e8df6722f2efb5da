"""All rays of a lidar at once: own loops for simple solids, MuJoCo's for meshes and height fields.

MuJoCo looks at every shape in a ray's broad phase and at every ray for a shape. Here each shape is projected
onto the grid of rays first, and shapes are taken nearest first, so that most of what stands behind others
is never computed.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sensors.scan_pattern import ScanPattern

_HIDDEN_GROUP = 5
"""MuJoCo geom group of what is not looked at meanwhile."""


def cast_scan(
    model: Any, data: Any, pattern: ScanPattern, position: Array, rotation: Array, looked_at: np.ndarray
) -> tuple[np.ndarray, Array]:
    """What each ray meets first: geom (rows, columns) int32, -1 for nothing, and distance (rows, columns) m.

    Args:
        model: MuJoCo's model.
        data: its data, with present positions of geoms.
        pattern: of the rays.
        position: (3,) m of the lidar in the world.
        rotation: (3, 3) of the lidar in the world.
        looked_at: (ngeom,) bool. Shapes that are wholly transparent are looked through anyway.
    """
    simple, other = _kinds(model, looked_at)
    shape = (pattern.rows, pattern.columns)
    geoms = np.full(shape, -1, dtype=np.int32)
    distances = np.full(shape, np.inf)
    if len(other):
        _mesh_hits(model, data, pattern, position, rotation, other, geoms, distances)
    if len(simple):
        _compiled()(
            model.geom_type, model.geom_size, model.geom_aabb, data.geom_xpos,
            data.geom_xmat.reshape(-1, 3, 3), simple, position, np.ascontiguousarray(rotation),
            pattern.directions, pattern.grid, float(pattern.max_range), geoms, distances,
        )  # fmt: skip
    return geoms, distances


def _kinds(model: Any, looked_at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of simple solids and of all other shapes, among those looked at that are not transparent."""
    import mujoco

    kind, clear = model.geom_type, model.geom_rgba[:, 3] == 0.0
    if clear.any() and model.nmat:
        material = model.geom_matid
        clear &= (material < 0) | (model.mat_rgba[material, 3] == 0.0)
    seen = looked_at & ~clear
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
    """Meshes and height fields by MuJoCo."""
    import mujoco

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


@cache
def _compiled() -> Any:
    """The compiled loop; numba is loaded on the first call."""
    from roboyard.sensors.kernels.scan import scan

    return scan
