"""Rays against triangles."""

from __future__ import annotations

import numpy as np

from roboyard._arrays import NDArray
from roboyard.transforms import Array

CHUNK = 1 << 21
"""Pairs of ray and triangle at a time; bounds the memory."""
NARROW = 0.05
"""Least component along the mean of rays that form a pyramid."""
ROUNDING = 1e-6
"""Slope by which the pyramid is wider than its rays."""
PARALLEL = 1e-15
"""Twice the area of a triangle, seen along a ray, from which the ray can hit it (m²)."""


def hit_fraction(triangles: Array, start: Array, directions: Array, reach: float) -> float:
    """Return the share of rays that hit a triangle, from either side, within a distance.

    A ray from the origin passes inside a triangle's edges where it is on one side of the three planes through
    the origin and an edge each.

    Args:
        triangles: (n, 3, 3) corners (m).
        start: (3,) of all rays (m).
        directions: (k, 3) unit vectors.
        reach: m.
    """
    if not len(triangles) or not len(directions):
        return 0.0
    corners = triangles.reshape(-1, 3) - start
    triangles = corners.reshape(-1, 3, 3)[_may_be_hit(corners, directions, reach)]
    hit = np.zeros(len(directions), dtype=bool)
    size = max(1, CHUNK // len(directions))
    for first in range(0, len(triangles), size):
        hit |= _hits(triangles[first : first + size], directions, reach)
    return float(hit.mean())


def triangles_near(vertices: Array, faces: NDArray[np.integer], centre: Array, reach: float) -> Array:
    """Return the (k, 3, 3) corners of the triangles whose boxes reach into the box around a point.

    Args:
        vertices: (n, 3) points (m).
        faces: (m, 3) indices of vertices.
        centre: (3,) of the box (m).
        reach: from the centre to the box's sides (m).
    """
    beyond = np.concatenate([vertices >= centre + reach, vertices <= centre - reach], axis=1)
    a, b, c = _sides(beyond)[faces].T
    return vertices[faces[a & b & c == 0]]


def _may_be_hit(corners: Array, directions: Array, reach: float) -> NDArray[np.bool_]:
    """Return (n,) whether each triangle of (3n, 3) corners reaches into the pyramid round rays from the
    origin; all do where the rays span half the space.
    """
    middle = directions.mean(axis=0)
    along = directions @ middle
    if along.min() <= NARROW:
        return np.ones(len(corners) // 3, dtype=bool)
    aside = np.linalg.svd(middle[None])[2][1:]  # two directions across the middle one
    slopes = directions @ aside.T / along[:, None]
    depth = corners @ middle
    across = corners @ aside.T
    beyond = np.column_stack(
        [
            depth <= 0,
            depth >= reach * np.linalg.norm(middle),
            across > depth[:, None] * (slopes.max(axis=0) + ROUNDING),
            across < depth[:, None] * (slopes.min(axis=0) - ROUNDING),
        ]
    )
    a, b, c = _sides(beyond).reshape(-1, 3).T
    return a & b & c == 0


def _sides(beyond: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return (n,) numbers with one bit for each of the up to eight sides that a point is beyond."""
    return np.packbits(beyond, axis=1)[:, 0]


def _hits(corners: Array, directions: Array, reach: float) -> Array:
    """Return (k,) whether each ray from the origin hits one of (n, 3, 3) triangles."""
    a, b, c = np.moveaxis(corners, 1, 0)
    sides = [directions @ np.cross(p, q).T for p, q in ((a, b), (b, c), (c, a))]  # (k, n) each
    inside = np.minimum(np.minimum(*sides[:2]), sides[2]) >= 0
    inside |= np.maximum(np.maximum(*sides[:2]), sides[2]) <= 0
    ray, triangle = np.nonzero(inside)
    normal = np.cross(b - a, c - a)[triangle]
    along = (normal * directions[ray]).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (normal * a[triangle]).sum(axis=1) / along
    struck = (np.abs(along) > PARALLEL) & (distance > 0) & (distance < reach)
    hit = np.zeros(len(directions), dtype=bool)
    hit[ray[struck]] = True
    return hit
