"""Rays of a lidar against solids, nearest solid first, each tested against only the rays that may hit it."""

from __future__ import annotations

import numpy as np

from roboyard._numba import njit
from roboyard.sensors.kernels.solids import PLANE, meet

TURN = 2.0 * np.pi
SLACK = 1e-9


@njit(cache=True)
def _into(turn, rotation, out):  # pragma: no cover
    """turnᵀ rotation, all (3, 3)."""
    for i in range(3):
        for j in range(3):
            out[i, j] = (
                turn[0, i] * rotation[0, j] + turn[1, i] * rotation[1, j] + turn[2, i] * rotation[2, j]
            )


@njit(cache=True)
def _towards(turn, begin, end, out):  # pragma: no cover
    """turnᵀ (end - begin), (3,)."""
    x, y, z = end[0] - begin[0], end[1] - begin[1], end[2] - begin[2]
    for i in range(3):
        out[i] = turn[0, i] * x + turn[1, i] * y + turn[2, i] * z


@njit(cache=True)
def window(box, position, rotation, at, turn, longest, to_local, middle, out):  # pragma: no cover
    """Range of directions in which a lidar may hit a box.

    box: (6,) centre and half extents in the solid's frame; position (3,), rotation (3, 3) of the solid and
    at (3,), turn (3, 3) of the lidar in the world. longest: range (m); for a box beyond it only the distance
    is written. to_local (3, 3), middle (3,): scratch. out (5,): middle azimuth, half width (π: all around),
    lowest and highest elevation (rad) and smallest distance (m).
    """
    _towards(rotation, position, at, middle)
    gap = 0.0
    for k in range(3):
        gap += max(abs(middle[k] - box[k]) - box[3 + k], 0.0) ** 2
    out[4] = np.sqrt(gap)
    if out[4] > longest:
        return
    _into(turn, rotation, to_local)
    _towards(turn, at, position, middle)
    for k in range(3):
        for j in range(3):
            middle[k] += to_local[k, j] * box[j]
    far = np.hypot(middle[0], middle[1])
    cosine, sine = (middle[0] / far, middle[1] / far) if far > 1e-9 else (1.0, 0.0)
    width, low, high, near = 0.0, np.inf, -np.inf, np.inf
    tangent = 0.0
    reach, side0, side1 = 0.0, np.inf, -np.inf
    for corner in range(8):
        x, y, z = middle[0], middle[1], middle[2]
        for k in range(3):
            half = box[3 + k] if corner >> k & 1 else -box[3 + k]
            x += to_local[0, k] * half
            y += to_local[1, k] * half
            z += to_local[2, k] * half
        ahead, side = cosine * x + sine * y, cosine * y - sine * x
        if ahead <= 1e-9:
            width = np.pi
        elif width < np.pi:
            tangent = max(tangent, abs(side) / ahead)
        near, low, high = min(near, ahead), min(low, z), max(high, z)
        side0, side1 = min(side0, side), max(side1, side)
        reach = max(reach, x * x + y * y)
    if far <= 1e-9:
        width = np.pi
    reach = np.sqrt(reach)
    across = 0.0 if side0 <= 0.0 <= side1 else min(abs(side0), abs(side1))
    closest = np.hypot(near, across) if near > 0.0 else 0.0
    out[0] = np.arctan2(sine, cosine)
    out[1] = np.pi if width > 0.0 else np.arctan(tangent)
    out[2] = np.arctan2(low, closest if low < 0.0 else reach)
    out[3] = np.arctan2(high, closest if high > 0.0 else reach)


@njit(cache=True, nogil=True)
def scan_solids(  # pragma: no cover
    kinds, sizes, boxes, positions, rotations, rows, at, turn, directions, grid, longest, geoms, distances
):
    """First hits of a lidar's rays.

    kinds (g,), sizes (g, 3), boxes (g, 6), positions (g, 3), rotations (g, 3, 3): MuJoCo's, of all geoms.
    rows: the geoms to test. at (3,), turn (3, 3): pose of the lidar. directions: (r, c, 3) in its frame.
    grid: first azimuth, step, highest elevation, step (rad). longest: range (m). Hits nearer than those
    already in geoms (r, c) and distances (r, c) overwrite them.
    """
    n_rows, n_columns = directions.shape[0], directions.shape[1]
    first, step, highest, drop = grid
    count = rows.shape[0]
    windows, back, middle = np.empty((count, 5)), np.empty((3, 3)), np.empty(3)
    for i in range(count):
        g = rows[i]
        if kinds[g] == PLANE:
            _towards(rotations[g], positions[g], at, middle)
            windows[i, 0], windows[i, 1] = 0.0, np.pi
            windows[i, 2], windows[i, 3], windows[i, 4] = -np.pi, np.pi, max(middle[2], 0.0)
        else:
            window(boxes[g], positions[g], rotations[g], at, turn, longest, back, middle, windows[i])
    for i in np.argsort(windows[:, 4]):
        azimuth, width, gap = windows[i, 0], windows[i, 1], windows[i, 4]
        bottom, top = windows[i, 2], windows[i, 3]
        if gap > longest:
            break
        r0 = max(int(np.ceil((highest - top) / drop - SLACK)), 0)
        r1 = min(int(np.floor((highest - bottom) / drop + SLACK)), n_rows - 1)
        if r0 > r1:
            continue
        g = rows[i]
        _into(rotations[g], turn, back)
        _towards(rotations[g], positions[g], at, middle)
        ox, oy, oz = middle[0], middle[1], middle[2]
        sx, sy, sz = sizes[g, 0], sizes[g, 1], sizes[g, 2]
        kind = kinds[g]
        around = width >= np.pi
        for wrap in range(1 if around else 3):
            c0, c1 = 0, n_columns - 1
            if not around:
                start = (azimuth - first) % TURN + (wrap - 1) * TURN
                c0 = max(int(np.ceil((start - width) / step - SLACK)), 0)
                c1 = min(int(np.floor((start + width) / step + SLACK)), n_columns - 1)
            for r in range(r0, r1 + 1):
                for c in range(c0, c1 + 1):
                    if distances[r, c] <= gap:
                        continue
                    x, y, z = directions[r, c, 0], directions[r, c, 1], directions[r, c, 2]
                    t = meet(
                        kind, ox, oy, oz,
                        back[0, 0] * x + back[0, 1] * y + back[0, 2] * z,
                        back[1, 0] * x + back[1, 1] * y + back[1, 2] * z,
                        back[2, 0] * x + back[2, 1] * y + back[2, 2] * z,
                        sx, sy, sz,
                    )  # fmt: skip
                    if 0.0 <= t < distances[r, c]:
                        distances[r, c] = t
                        geoms[r, c] = g
