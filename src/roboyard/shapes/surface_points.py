"""Points on the surface of meshes, and how many of them spheres cover."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import Array


def surface_points(meshes: Sequence[TriangleMesh], count: int = 2000, seed: int = 0) -> Array:
    """Return (count, 3) points on the surface of meshes in one frame (m), uniform by area.

    Args:
        meshes: in one frame; (0, 3) is returned for meshes without area.
        count: number of points.
        seed: of the random points.
    """
    corners = [mesh.vertices[mesh.faces] for mesh in meshes if len(mesh.faces)]
    if not corners:
        return np.zeros((0, 3))
    triangles = np.concatenate(corners)
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    areas = np.linalg.norm(np.cross(first, second), axis=1)
    total = float(areas.sum())
    if not total > 0:
        return np.zeros((0, 3))
    rng = np.random.default_rng(seed)
    chosen = np.searchsorted(np.cumsum(areas) / total, rng.uniform(size=count)).clip(max=len(areas) - 1)
    u, v = rng.uniform(size=(2, count))
    outside = u + v > 1
    u, v = np.where(outside, 1 - u, u), np.where(outside, 1 - v, v)
    return triangles[chosen, 0] + u[:, None] * first[chosen] + v[:, None] * second[chosen]


def share_near_spheres(points: Array, centers: ArrayLike, radii: ArrayLike, near: float) -> float:
    """Return the share of (k, 3) points inside spheres, or outside by at most `near` (m); 0 without spheres.

    Args:
        points: (k, 3) in the frame of the spheres (m); 1 is returned for none.
        centers: (n, 3) of the spheres (m).
        radii: (n,) (m).
        near: distance outside a sphere that still counts (m).
    """
    if not len(points):
        return 1.0
    covered = np.zeros(len(points), dtype=bool)
    for center, radius in zip(np.reshape(centers, (-1, 3)), np.reshape(radii, -1), strict=True):
        covered |= np.linalg.norm(points - center, axis=1) <= radius + near
    return float(covered.mean())
