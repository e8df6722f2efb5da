"""The order in which an impulse engine looks at the triangles of a concave mesh.

Which points a pair keeps depends on it where a shape is near several triangles. Bullet sorts them into a tree
of boxes once: a set of triangles is split in two along the axis along which its boxes vary most, at their
mean, or in the middle where one part were too small. The boxes have coordinates of 16 bits.

Source:
    `btQuantizedBvh` and `btOptimizedBvh` of Bullet 3.
"""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.transforms import Array

STEPS = 65533.0
"""Steps of a coordinate along the box of all triangles."""
AROUND = 1.0
"""Width (m) by which that box is larger on each side."""
THINNEST = 0.002
"""Size (m) below which the box of a triangle is made larger by it."""
MOST_PENDING = 256
"""Most parts of the mesh that wait to be split: of two parts the larger has two thirds of the triangles."""


def triangle_order(corners: Array) -> np.ndarray:
    """Return the (t,) int32 order of triangles (t, 3, 3), whose corners are in the frame of the mesh (m)."""
    order = np.arange(len(corners), dtype=np.int32)
    if len(corners) > 1:
        sort_by_splits(_middles(corners), order, np.zeros((MOST_PENDING, 2), np.int64))
    return order


def _middles(corners: Array) -> Array:
    """Return the (t, 3) middles of the triangles' boxes (m), which have coordinates of 16 bits."""
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    least, most = lower.min(axis=0) - AROUND, upper.max(axis=0) + AROUND
    scale = STEPS / (most - least)
    least = np.minimum(least, _place(_low(least, least, scale), least, scale) - AROUND)
    scale = STEPS / (most - least)
    most = np.maximum(most, _place(_high(most, least, scale), least, scale) + AROUND)
    scale = STEPS / (most - least)
    is_thin = upper - lower < THINNEST
    upper, lower = (
        np.where(is_thin, upper + THINNEST / 2, upper),
        np.where(is_thin, lower - THINNEST / 2, lower),
    )
    low, high = _low(lower, least, scale), _high(upper, least, scale)
    middles: Array = 0.5 * (_place(high, least, scale) + _place(low, least, scale))
    return middles


def _low(points: Array, least: Array, scale: Array) -> np.ndarray:
    """Return the even numbers of steps below points."""
    return ((points - least) * scale).astype(np.uint16) & 0xFFFE


def _high(points: Array, least: Array, scale: Array) -> np.ndarray:
    """Return the odd numbers of steps above points."""
    return ((points - least) * scale + 1.0).astype(np.uint16) | 1


def _place(steps: np.ndarray, least: Array, scale: Array) -> Array:
    """Return the coordinates (m) of numbers of steps."""
    return steps / scale + least


@compiled("f8[:,::1] i4[::1] i8[:,::1]")
def sort_by_splits(middles, order, pending):  # pragma: no cover
    """Sort boxes as they are split; see this file.

    middles: (t, 3) of the boxes (m). order: (t,) numbers of the boxes, sorted. pending: array to work in.
    """
    pending[0, 0], pending[0, 1] = 0, order.shape[0]
    waiting = 1
    while waiting > 0:
        waiting -= 1
        start, end = pending[waiting, 0], pending[waiting, 1]
        count = end - start
        if count < 2:
            continue
        x = y = z = 0.0
        for i in range(start, end):
            x, y, z = x + middles[order[i], 0], y + middles[order[i], 1], z + middles[order[i], 2]
        share = 1.0 / count
        x, y, z = x * share, y * share, z * share
        u = v = w = 0.0
        for i in range(start, end):
            dx, dy, dz = middles[order[i], 0] - x, middles[order[i], 1] - y, middles[order[i], 2] - z
            u, v, w = u + dx * dx, v + dy * dy, w + dz * dz
        share = 1.0 / (count - 1.0)
        u, v, w = u * share, v * share, w * share
        axis, mean = (0, x) if u >= v else (1, y)
        if max(u, v) < w:
            axis, mean = 2, z
        split = start
        for i in range(start, end):
            if middles[order[i], axis] > mean:
                order[i], order[split] = order[split], order[i]
                split += 1
        third = count // 3
        if split <= start + third or split >= end - 1 - third:
            split = start + (count >> 1)
        pending[waiting, 0], pending[waiting, 1] = start, split
        pending[waiting + 1, 0], pending[waiting + 1, 1] = split, end
        waiting += 2
