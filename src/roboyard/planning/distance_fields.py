"""Signed distances to meshes, terrain and point clouds on grids, cached on disk by their content."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard._arrays import NDArray
from roboyard.description.model import Heightfield
from roboyard.errors import ConfigError
from roboyard.shapes.cache import content_key, load_arrays, store_arrays
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import Array

CELL = 0.006
"""Edge of a cell where the size of the shape allows it (m)."""
FEWEST, MOST = 60_000, 2_000_000
"""Cells of a field."""
VERSION = 1
"""Cache version: increase it when the same mesh gives another field than before."""
GROUND = 0.5
"""Thickness of the ground below the lowest point of terrain (m)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DistanceField:
    """Signed distances at the centres of cells, negative inside, in the shape's frame."""

    origin: Array
    """(3,) lower corner of cell (0, 0, 0) (m)."""
    cell: float
    """Edge of a cell (m)."""
    values: NDArray[np.float32]
    """(nx, ny, nz) signed distances (m)."""
    center: Array
    """(3,) centre of the sphere around the surface (m)."""
    radius: float
    """Radius of the sphere around the surface (m)."""


def mesh_field(mesh: TriangleMesh) -> DistanceField:
    """Return the field of a mesh (m), concave parts included; cached on disk.

    Raises:
        MeshError: there is no finite vertex.
    """
    vertices = np.asarray(mesh.vertices, dtype=float)
    key = content_key("field", VERSION, CELL, vertices, np.asarray(mesh.faces))
    stored = load_arrays("distance_fields", key)
    if stored is None:
        from roboyard.shapes.voxels.grid import voxelize

        extent = np.ptp(vertices[np.isfinite(vertices).all(axis=1)], axis=0)
        cells = int(np.clip(np.prod(extent / CELL + 6), FEWEST, MOST))
        grid = voxelize(mesh, cells=cells)
        values = grid.sdf * np.float32(grid.size)
        values = np.where(grid.thin, np.minimum(values, 0), values)
        stored = {
            "origin": grid.origin,
            "cell": np.array(grid.size),
            "values": values.astype(np.float32),
            "low": grid.surface_points.min(axis=0),
            "high": grid.surface_points.max(axis=0),
        }
        store_arrays("distance_fields", key, stored)
    return _field(stored["origin"], float(stored["cell"]), stored["values"], stored["low"], stored["high"])


def _field(origin: Array, cell: float, values: Array, low: Array, high: Array) -> DistanceField:
    return DistanceField(
        origin=np.asarray(origin, dtype=float),
        cell=cell,
        values=np.ascontiguousarray(values, dtype=np.float32),
        center=(low + high) / 2,
        radius=float(np.linalg.norm(high - low) / 2) + cell,
    )


def heightfield_field(terrain: Heightfield) -> DistanceField:
    """Return the field of terrain: its surface as triangles, with the ground below as solid.

    Raises:
        ConfigError: fewer than 2 x 2 heights.
    """
    heights = np.asarray(terrain.heights, dtype=float)
    if heights.ndim != 2 or min(heights.shape) < 2:
        raise ConfigError(f"heightfield: heights have shape {heights.shape}; give at least 2 x 2")
    nx, ny = heights.shape
    x = (np.arange(nx) - (nx - 1) / 2) * terrain.cell[0]
    y = (np.arange(ny) - (ny - 1) / 2) * terrain.cell[1]
    grid = np.stack([*np.meshgrid(x, y, indexing="ij"), heights], axis=-1)
    bottom = grid.copy()
    bottom[..., 2] = heights.min() - GROUND
    vertices = np.concatenate([grid.reshape(-1, 3), bottom.reshape(-1, 3)])
    index = np.arange(nx * ny).reshape(nx, ny)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    top = np.concatenate([_rows(a, b, c), _rows(a, c, d)])
    loop = np.concatenate([index[:, 0], index[-1, 1:], index[-2::-1, -1], index[0, -2:0:-1]])
    after, below = np.roll(loop, -1), nx * ny
    sides = np.concatenate([_rows(loop, loop + below, after), _rows(after, loop + below, after + below)])
    faces = np.concatenate([top, top[:, ::-1] + below, sides])
    return mesh_field(TriangleMesh(vertices=vertices, faces=faces.astype(np.int32)))


def _rows(*columns: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.stack([column.ravel() for column in columns], axis=1)


def cloud_field(points: Array, cell: float = 0.02, reach: float = 0.3) -> DistanceField:
    """Return the field of a point cloud: distances to the occupied cells.

    Args:
        points: (n, 3) points of surfaces (m), at least one.
        cell: edge of a cell (m); each occupied cell counts as solid.
        reach: distance around the points that the grid covers (m); beyond it distances are lower bounds.

    Raises:
        ConfigError: there is no finite point.
    """
    from scipy import ndimage

    cloud = np.asarray(points, dtype=float).reshape(-1, 3)
    cloud = cloud[np.isfinite(cloud).all(axis=1)]
    if not len(cloud):
        raise ConfigError(f"point cloud: none of {np.size(points) // 3} points is finite; give metres")
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    cell = max(cell, float(np.cbrt(np.prod(high - low + 2 * reach) / 8e6)))
    padding = int(np.ceil(reach / cell))
    origin = low - (padding + 0.5) * cell
    shape = np.floor((high - origin) / cell).astype(int) + padding + 1
    solid = np.zeros(shape, dtype=bool)
    solid[tuple(np.floor((cloud - origin) / cell).astype(int).T)] = True
    outside = np.asarray(ndimage.distance_transform_edt(~solid))
    inside = np.asarray(ndimage.distance_transform_edt(solid))
    values = np.where(solid, 0.5 - inside, outside - 0.5) * cell
    return _field(origin, cell, values, low - cell / 2, high + cell / 2)
