"""Convex hulls on a grid, with their corners in the order in which an impulse engine finds them.

Where several corners are equally far along a direction, the first of them touches first.
"""

from __future__ import annotations

import numpy as np

from roboyard.shapes.mesh import bounding_box
from roboyard.sim.build.hull_kernels import FULL, STACK, VOLUME, WORK, find_hull
from roboyard.transforms import Array

_EDGES = 4
"""Edges of two hulls for each of their points, as a rule at most, while they are merged."""
_SPARE = 8
_SMALL = 1e-300


def ordered_hull(
    points: Array, steps: int, counts: np.ndarray | None = None
) -> tuple[Array, np.ndarray, float]:
    """Return the (n, 3) corners (m) of the convex hull of points on a grid, and its (m, 3) int32 faces.

    Args:
        points: (k, 3) (m).
        steps: number of steps over each extent of the points; corners are rounded towards the middle.
        counts: (k,) how often the impulse engine is given each point, which the order depends on; None: once.

    Returns:
        The hull with outward faces, and its volume as a share of a cube of its largest extent, 0 where it is
        flat.
    """
    lower, upper = bounding_box(points)
    grid, size, middle = on_grid(points, lower, upper, steps)
    axes = _axes(upper - lower)
    along = grid[:, axes]
    if (axes[0] + 1) % 3 != axes[1]:
        along = -along
    order = np.lexsort((along[:, 2], along[:, 0], along[:, 1]))
    along = along[order]
    is_new = np.ones(len(along), bool)
    is_new[1:] = (along[1:] != along[:-1]).any(axis=1)
    given = np.cumsum(is_new, dtype=np.int32) - 1
    if counts is not None:
        given = np.repeat(given, counts[order])
    corners, faces, volume = _search(along[is_new], given)
    x, y, z = size.tolist()
    fullness = volume / 6.0 * x * y * z / max((steps * max(x, y, z)) ** 3, _SMALL)
    return grid[order[is_new][corners]] * size + middle, faces, fullness


def on_grid(points: Array, lower: Array, upper: Array, steps: int) -> tuple[np.ndarray, Array, Array]:
    """Return the (n, 3) places of points on a grid, the size of its steps and its middle.

    There are so many steps between the bounds; places are rounded towards the middle. Bounds, sizes and the
    middle are (3,) (m).
    """
    size = (upper - lower) * (1.0 / steps)  # Bullet divides so; a corner at a step depends on the last bit
    middle = (lower + upper) * 0.5
    per_step = np.divide(1.0, size, out=np.zeros(3), where=size > 0.0)
    return np.trunc((points - middle) * per_step).astype(np.int64), size, middle


def _axes(extent: Array) -> list[int]:
    """Return the axes of the medium, the largest and the least extent, in Bullet's order of equal ones."""
    x, y, z = extent.tolist()
    largest = (2 if y < z else 1) if x < y else (2 if x < z else 0)
    least = (0 if x < z else 2) if x < y else (1 if y < z else 2)
    if least == largest:
        least = (largest + 1) % 3
    return [3 - largest - least, largest, least]


def _search(points: np.ndarray, given: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Return the corners of the hull of (n, 3) points, its (m, 3) faces by these, and six times its volume.

    given: (k,) point of each that was given.
    """
    count = len(points)
    around, firsts = np.empty((count, 2), np.int32), np.empty(count, np.int32)
    order, faces = np.empty(count, np.int32), np.empty((2 * count + 1, 3), np.int32)
    tasks, parts = np.empty((STACK, 3), np.int64), np.empty((STACK, 4), np.int64)
    work = np.empty(WORK, np.int64)
    found, room = FULL, 2 * _EDGES * count + _SPARE
    while found == FULL:
        edges = np.empty((room, 4), np.int32)
        found = find_hull(points, given, edges, around, firsts, tasks, parts, work, order, faces)
        room *= 2
    return order[:found], faces[: int(np.argmax(faces[:, 0] < 0))], int(work[VOLUME])
