"""Faces of upright prisms, whose convex hull is known: impulse engines make them of cylinders."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from roboyard.transforms import Array

LEAST_SIDES = 3
_CLEAR = 1e-6
"""Least sine of the angle between two sides for which a polygon is taken as convex without a search."""
_THIN = 1e-4
"""Least ratio of height and width; thinner prisms may get a thickness first."""


def prism_faces(points: Array) -> np.ndarray | None:
    """Return the (m, 3) int32 outward faces of the convex hull of an upright prism; None of other points.

    Args:
        points: (n, 3) (m), corners above and below in turn, or below and above, around the polygon.
    """
    count = len(points) // 2
    if len(points) % 2 or count < LEAST_SIDES:
        return None
    one, other = points[0::2], points[1::2]
    (z, *_), (w, *_) = one[:, 2], other[:, 2]
    around = one[:, :2]
    if (around != other[:, :2]).any() or (one[:, 2] != z).any() or (other[:, 2] != w).any():
        return None
    if abs(z - w) < _THIN * (around.max() - around.min()):
        return None
    if (around.max(axis=0) - around.min(axis=0)).min() < _THIN * abs(z - w):
        return None
    following, upright = _parts_of(count)
    sides = around[following] - around
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    others = sides[following]
    turns = sides[:, 0] * others[:, 1] - sides[:, 1] * others[:, 0]
    least = _CLEAR * lengths * lengths[following]
    is_left = bool(turns[0] > 0.0)
    if not ((turns if is_left else -turns) > least).all() or lengths.min() == 0.0:
        return None
    if abs(np.arctan2(turns, (sides * others).sum(axis=1)).sum()) > 3.0 * np.pi:  # around more than once
        return None
    outward = is_left == bool(z > w)
    return upright.copy() if outward else upright[:, ::-1].copy()


@lru_cache(64)
def _parts_of(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the (n,) corners that follow those of a polygon of n corners, and (m, 3) faces of its prism.

    Those are int32, and outward where the polygon turns left, seen from the side of its first corner.
    """
    first = 2 * np.arange(count)
    second = np.roll(first, -1)
    walls = np.concatenate(
        [np.stack([first, first + 1, second + 1], 1), np.stack([first, second + 1, second], 1)]
    )
    cap = np.stack([np.zeros(count - 2, int), first[1:-1], first[2:]], 1)
    faces = np.concatenate([walls, cap, cap[:, ::-1] + 1]).astype(np.int32)
    return second // 2, faces
