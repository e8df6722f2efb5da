"""Faces of upright prisms, whose convex hull is known: impulse engines make them of cylinders."""

from __future__ import annotations

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
    thin = abs(z - w) < _THIN * np.ptp(one[:, :2]) or np.ptp(one[:, :2], axis=0).min() < _THIN * abs(z - w)
    if thin or (one[:, 2] != z).any() or (other[:, 2] != w).any() or (one[:, :2] != other[:, :2]).any():
        return None
    sides = np.roll(one[:, :2], -1, axis=0) - one[:, :2]
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    following = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    least = _CLEAR * lengths * np.roll(lengths, -1)
    is_left = bool(turns[0] > 0.0)
    if not ((turns if is_left else -turns) > least).all() or lengths.min() == 0.0:
        return None
    if abs(np.arctan2(turns, (sides * following).sum(axis=1)).sum()) > 3.0 * np.pi:  # around more than once
        return None
    first = 2 * np.arange(count)
    second = np.roll(first, -1)
    walls = np.concatenate(
        [np.stack([first, first + 1, second + 1], 1), np.stack([first, second + 1, second], 1)]
    )
    cap = np.stack([np.zeros(count - 2, int), first[1:-1], first[2:]], 1)
    faces = np.concatenate([walls, cap, cap[:, ::-1] + 1])
    outward = is_left == bool(z > w)
    return (faces if outward else faces[:, ::-1]).astype(np.int32)
