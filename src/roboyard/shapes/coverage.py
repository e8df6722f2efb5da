"""Compare the hulls and spheres of a link with its mesh on one voxel grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roboyard._arrays import ArrayLike, NDArray
from roboyard.shapes.convex.hulls import convex_hull, face_planes, mark_convex
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.voxels.grid import voxelize

Array = NDArray[np.float64]
MOST_CELLS = 4_000_000
"""Most voxels of the grid after it is enlarged to contain all shapes."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Coverage:
    """Agreement of shapes with a solid; volumes are shares of the solid's, counted by voxel centres."""

    excess: float
    """Volume of the hulls' union outside the solid."""
    missing: float
    """Volume of the solid outside every hull."""
    coverage: float
    """Volume of the solid inside a sphere."""
    sphere_excess: float
    """Volume of the spheres' union outside the solid."""


def measure_coverage(
    solid: Sequence[TriangleMesh],
    hulls: Sequence[TriangleMesh],
    centers: ArrayLike = (),
    radii: ArrayLike = (),
    *,
    cells: int = 40_000,
) -> Coverage:
    """Return how well hulls and spheres approximate a link, all in one frame.

    Args:
        solid: the link's meshes (m), open or closed; enclosed cavities count as solid.
        hulls: its collision meshes (m); each counts as its convex hull, as in physics engines.
        centers: (n, 3) centres of its spheres (m).
        radii: (n,) radii (m).
        cells: approximate number of voxels of the link's bounding box.

    Raises:
        MeshError: `solid` has no finite vertex.
    """
    grid = voxelize(solid, cells=cells, fill_cavities=True)
    middle = np.asarray(centers, dtype=float).reshape(-1, 3)
    radius = np.asarray(radii, dtype=float).reshape(-1)
    points = [hull.vertices for hull in hulls] + [middle - radius[:, None], middle + radius[:, None]]
    reach = np.concatenate([p for p in points if len(p)] or [grid.surface_points])
    shape = np.array(grid.solid.shape)
    below = np.ceil((grid.origin - reach.min(axis=0)) / grid.size)
    above = np.ceil((reach.max(axis=0) - grid.origin) / grid.size - shape)
    margin = np.maximum(0, np.stack([below, above], axis=1))
    while np.prod(shape + margin.sum(axis=1)) > MOST_CELLS:
        margin = np.floor(0.8 * margin)
    wide = np.pad(grid.solid, margin.astype(int))
    origin = grid.origin - margin[:, 0] * grid.size
    by_hulls, by_spheres = np.zeros_like(wide), np.zeros_like(wide)
    for hull in hulls:
        _mark_hull(hull, origin, grid.size, by_hulls)
    for center, r in zip((middle - origin) / grid.size - 0.5, radius / grid.size, strict=True):
        _mark_sphere(center, r, by_spheres)
    skin = np.pad(grid.surface, margin.astype(int))
    counted = wide & (np.pad(grid.inside, margin.astype(int)) if grid.inside.any() else True)
    total, own = max(int(wide.sum()), 1), max(int(counted.sum()), 1)
    # a voxel that the surface passes through is half outside: no excess
    outside = ~(wide | skin)
    return Coverage(
        excess=float((by_hulls & outside).sum() / total),
        missing=float((counted & ~by_hulls).sum() / own),
        coverage=float((counted & by_spheres).sum() / own),
        sphere_excess=float((by_spheres & outside).sum() / total),
    )


def _mark_hull(hull: TriangleMesh, origin: Array, size: float, mask: NDArray[np.bool_]) -> None:
    """Set the voxels with centres in the convex hull of a mesh."""
    convex = convex_hull(hull, None).mesh
    planes = face_planes(convex)
    planes[:, 3] = (planes[:, 3] + planes[:, :3] @ origin) / size
    lower, upper = (convex.bounds - origin) / size
    begin = np.clip(np.floor(lower), 0, mask.shape).astype(np.int64)
    end = np.clip(np.ceil(upper) + 1, 0, mask.shape).astype(np.int64)
    mark_convex(planes, begin, end, mask)


def _mark_sphere(center: Array, radius: float, mask: NDArray[np.bool_]) -> None:
    """Set the voxels with centres in a sphere (voxel units)."""
    begin = np.clip(np.floor(center - radius), 0, mask.shape).astype(int)
    end = np.clip(np.ceil(center + radius) + 1, 0, mask.shape).astype(int)
    if (end <= begin).any():
        return
    x, y, z = (np.arange(b, e) - c for b, e, c in zip(begin, end, center, strict=True))
    near = x[:, None, None] ** 2 + y[None, :, None] ** 2 + z[None, None, :] ** 2 <= radius**2
    mask[begin[0] : end[0], begin[1] : end[1], begin[2] : end[2]] |= near
