"""The convex hull of points in the plane, edge by edge."""

from __future__ import annotations

import numpy as np

from roboyard.poses import Array


def hull_edges(points: Array) -> tuple[Array, Array, Array] | None:
    """Edges of the convex hull of points in the plane (Andrew's monotone chain).

    Args:
        points: (n, 2) m.

    Returns:
        (e, 2) outward normals, (e,) m of each edge along its normal, (2,) mean of the corners; None where the
        hull has no area.
    """
    order = sorted({(float(x), float(y)) for x, y in points})
    if len(order) < 3:
        return None
    corners = np.array(_half(order)[:-1] + _half(order[::-1])[:-1])
    along = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(along, axis=1)
    area = 0.5 * abs(float(np.sum(corners[:, 0] * along[:, 1] - corners[:, 1] * along[:, 0])))
    if len(corners) < 3 or area < 1e-9 + 1e-3 * float(length.max()) ** 2:
        return None
    normals = np.stack([along[:, 1], -along[:, 0]], axis=1) / length[:, None]
    return normals, np.sum(normals * corners, axis=1), corners.mean(axis=0)


def _half(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """One side of the hull of sorted points, counter-clockwise."""
    kept: list[tuple[float, float]] = []
    for x, y in points:
        while len(kept) > 1:
            (ax, ay), (bx, by) = kept[-2], kept[-1]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                break
            kept.pop()
        kept.append((x, y))
    return kept
