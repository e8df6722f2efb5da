"""Lookups in the shadow map."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled

TILE_BITS = 3
TILE = 1 << TILE_BITS


def sunlight(shadow, tiles, size, column, row, q):
    """Return the fraction of the sun that reaches a point: a 3 by 3 texel tent filter; 1 outside the map.

    Column and row are 0 at the middle of the map's first texel; q is the point's nearness to the sun.
    """
    if not (column >= 1.0 and column < size - 2.0 and row >= 1.0 and row < size - 2.0):
        return 1.0
    left, top = np.int64(column), np.int64(row)
    if tiles[(top >> TILE_BITS) * (size >> TILE_BITS) + (left >> TILE_BITS)] <= q:
        return 1.0
    fx, fy = column - left, row - top
    total = 0.0
    for j in range(4):
        p = (top + j - 1) * size + left - 1
        line = 0.0
        if shadow[p] <= q:
            line += 1.0 - fx
        if shadow[p + 1] <= q:
            line += 1.0
        if shadow[p + 2] <= q:
            line += 1.0
        if shadow[p + 3] <= q:
            line += fx
        total += line * ((1.0 - fy) if j == 0 else (fy if j == 3 else 1.0))
    return total / 9.0


@compiled("f4[::1] i8 f4[::1]", releases_gil=True)
def nearest_of_tiles(shadow, size, tiles):
    """Write the largest nearness of each tile of TILE by TILE texels, plus the filter margin, to `tiles`."""
    count = size // TILE
    for j in range(count):
        for i in range(count):
            best = np.float32(-np.inf)
            for row in range(max(j * TILE - 1, 0), min(j * TILE + TILE + 2, size)):
                for column in range(max(i * TILE - 1, 0), min(i * TILE + TILE + 2, size)):
                    best = max(best, shadow[row * size + column])
            tiles[j * count + i] = best


@compiled(
    "i8[::1] f4[::1] i8 i8 i8 i8 f8[:,:] f8[:,:] f8[:,:] f8[::1] f8[::1] f8[:,::1] i8[::1] f8[::1] -> i8",
    fast_math=True,
    releases_gil=True,
)
def lit_bounds(
    seen, nearness, width, height, stride, perspective, origins, directions, m, low, high, bounds, shaded,
    depths,
):  # fmt: skip
    """Write the extent of the visible surfaces that shadows may reach; return how many points show them.

    These are the points between `low` and `high` (2,) in the axes `m` (3, 4); every `stride`-th pixel is
    sampled. Written are lower and upper `bounds` (2, 2), the first and last column and row that show them,
    `shaded` (4,), and the sum of their `depths` (1,) (m).
    """
    bounds[0, 0] = bounds[0, 1] = np.inf
    bounds[1, 0] = bounds[1, 1] = -np.inf
    count, total = 0, 0.0
    shaded[0], shaded[1], shaded[2], shaded[3] = width, -1, height, -1
    for row in range(0, height, stride):
        for column in range(0, width, stride):
            p = row * width + column
            if seen[p] < 0:
                continue
            px, py = column + 0.5, row + 0.5
            depth = 1.0 / np.float64(nearness[p]) if perspective else -np.float64(nearness[p])
            x = origins[0, 0] + origins[1, 0] * px + origins[2, 0] * py
            y = origins[0, 1] + origins[1, 1] * px + origins[2, 1] * py
            z = origins[0, 2] + origins[1, 2] * px + origins[2, 2] * py
            x += depth * (directions[0, 0] + directions[1, 0] * px + directions[2, 0] * py)
            y += depth * (directions[0, 1] + directions[1, 1] * px + directions[2, 1] * py)
            z += depth * (directions[0, 2] + directions[1, 2] * px + directions[2, 2] * py)
            u = m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]
            v = m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]
            if u >= low[0] and u <= high[0] and v >= low[1] and v <= high[1]:
                bounds[0, 0], bounds[1, 0] = min(bounds[0, 0], u), max(bounds[1, 0], u)
                bounds[0, 1], bounds[1, 1] = min(bounds[0, 1], v), max(bounds[1, 1], v)
                shaded[0], shaded[1] = min(shaded[0], column), max(shaded[1], column)
                shaded[2], shaded[3] = min(shaded[2], row), max(shaded[3], row)
                count += 1
                total += depth
    shaded[0] -= stride
    shaded[1] += stride
    shaded[2] -= stride
    shaded[3] += stride
    depths[0] = total
    return count
