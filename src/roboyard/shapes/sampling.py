"""Evenly distributed points on surfaces, on the unit sphere and in boxes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard._arrays import NDArray
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.voxels.grid import triangles

Array = NDArray[np.float64]


def surface_points(
    meshes: TriangleMesh | Sequence[TriangleMesh], count: int, rng: np.random.Generator
) -> Array:
    """Return (count, 3) points, uniformly distributed on the meshes' surface (m)."""
    corners = np.concatenate([vertices[faces] for vertices, faces in triangles(meshes)])
    edges = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    share = area / area.sum() if area.sum() > 0 else np.full(len(area), 1 / len(area))
    face = rng.choice(len(corners), count, p=share)
    s, t = rng.random((2, count, 1))
    fold = s + t > 1
    s, t = np.where(fold, 1 - s, s), np.where(fold, 1 - t, t)
    return corners[face, 0] + s * edges[face, 0] + t * edges[face, 1]


def fibonacci_sphere(count: int) -> Array:
    """Return (count, 3) evenly distributed unit vectors."""
    i = np.arange(count) + 0.5
    z = 1 - 2 * i / count
    turn = np.pi * (1 + 5**0.5) * i
    ring = np.sqrt(1 - z * z)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)


def box_points(lower: Array, upper: Array, count: int) -> Array:
    """Return (count, 3) points that fill a box evenly, the same at every call (m).

    Source: the additive sequence R3 of Roberts, "The unreasonable effectiveness of quasirandom sequences".
    """
    step = 1.2207440846057596 ** -np.arange(1.0, 4.0)
    return lower + (upper - lower) * ((0.5 + np.arange(1, count + 1)[:, None] * step) % 1.0)
