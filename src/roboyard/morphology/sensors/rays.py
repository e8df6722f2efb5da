"""Rays against triangles."""

from __future__ import annotations

import numpy as np

from roboyard.transforms import Array

CHUNK = 1 << 21
"""Pairs of ray and triangle at a time; bounds the memory."""


def hit_fraction(triangles: Array, start: Array, directions: Array, reach: float) -> float:
    """Return the share of rays that hit a triangle, from either side, within a distance.

    Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.

    Args:
        triangles: (n, 3, 3) corners (m).
        start: (3,) of all rays (m).
        directions: (k, 3) unit vectors.
        reach: m.
    """
    if not len(triangles) or not len(directions):
        return 0.0
    hit = np.zeros(len(directions), dtype=bool)
    size = max(1, CHUNK // len(directions))
    for first in range(0, len(triangles), size):
        a, b, c = np.moveaxis(triangles[first : first + size], 1, 0)
        hit |= _hits(b - a, c - a, start - a, directions, reach)
    return float(hit.mean())


def _hits(ab: Array, ac: Array, from_a: Array, directions: Array, reach: float) -> Array:
    """Return (k,) whether each ray hits one of the triangles."""
    across = np.cross(directions[:, None], ac[None])  # (k, n, 3)
    det = np.einsum("knj,nj->kn", across, ab)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.einsum("knj,nj->kn", across, from_a) / det
        q = np.cross(from_a, ab)  # (n, 3)
        v = directions @ q.T / det
        distance = np.einsum("nj,nj->n", ac, q) / det
        inside = (np.abs(det) > 1e-15) & (u >= 0) & (v >= 0) & (u + v <= 1)
    return (inside & (distance > 0) & (distance < reach)).any(axis=1)
