"""Lines that a gripper follows."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from roboyard.transforms import Array

SPACING = 0.05
"""Largest distance between points of a line (m)."""


def dense_line(points: Array) -> Array:
    """Return (m, 3) points at most `SPACING` apart on the line through (k, 3) points (m)."""
    rows = [points[:1]]
    for a, b in pairwise(points):
        count = max(1, int(np.ceil(np.linalg.norm(b - a) / SPACING)))
        rows.append(a + np.linspace(0, 1, count + 1)[1:, None] * (b - a))
    return np.concatenate(rows)


def distance_from_line(point: Array, line: Array) -> float:
    """Return the distance of a point (3,) from the line through (k, 3) points (m)."""
    a, way = line[:-1], np.diff(line, axis=0)
    share = np.einsum("ki,ki->k", point - a, way) / np.maximum((way**2).sum(axis=1), 1e-12)
    nearest = a + np.clip(share, 0.0, 1.0)[:, None] * way
    return float(np.linalg.norm(nearest - point, axis=1).min())
