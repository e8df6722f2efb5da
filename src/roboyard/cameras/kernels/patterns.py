"""What lies on a surface or behind it: textures, checkerboards, the backdrop."""

from __future__ import annotations

import numpy as np
from numba import njit

from roboyard.cameras.kernels.options import FAST

MASK = np.uint32(255)


@njit(cache=True, error_model="numpy", fastmath=FAST)
def texel(texels, offset, width, height, u, v, out):
    """Bilinear sample of one level, repeating, v up: (4,) 0 to 1 into `out`. A texel's low byte is red."""
    x = (u - np.floor(u)) * width - 0.5
    y = (np.ceil(v) - v) * height - 0.5
    x_floor, y_floor = np.floor(x), np.floor(y)
    fx, fy = x - x_floor, y - y_floor
    x0, y0 = np.int64(x_floor), np.int64(y_floor)
    x1, y1 = x0 + 1, y0 + 1
    # all four lie within half a texel of the picture: one step around its rim brings them in
    x0 = x0 + width if x0 < 0 else x0
    y0 = y0 + height if y0 < 0 else y0
    x1 = x1 - width if x1 >= width else x1
    y1 = y1 - height if y1 >= height else y1
    a, b = offset + y0 * width, offset + y1 * width
    c00, c10, c01, c11 = texels[a + x0], texels[a + x1], texels[b + x0], texels[b + x1]
    if c00 == c10 and c00 == c01 and c00 == c11:  # plain parts of a picture are common
        for k in range(4):
            out[k] = ((c00 >> np.uint32(8 * k)) & MASK) * (1.0 / 255.0)
        return
    w11 = fx * fy * (1.0 / 255.0)
    w10, w01 = fx * (1.0 / 255.0) - w11, fy * (1.0 / 255.0) - w11
    w00 = (1.0 - fx) * (1.0 / 255.0) - w01
    for k in range(4):
        shift = np.uint32(8 * k)
        out[k] = (
            w00 * ((c00 >> shift) & MASK)
            + w10 * ((c10 >> shift) & MASK)
            + w01 * ((c01 >> shift) & MASK)
            + w11 * ((c11 >> shift) & MASK)
        )


@njit(cache=True, error_model="numpy", fastmath=FAST)
def checker_share(x, y, wide_x, wide_y):
    """Share of the second colour in a footprint of the given width around (x, y), in squares.

    The footprint's exact mean over the board, one axis at a time, so that the board turns to an even mix
    towards the horizon.
    """
    wide_x, wide_y = max(wide_x, 1e-4), max(wide_y, 1e-4)
    # integral of the square wave that is +1 on even squares and -1 on odd ones is a triangle wave
    a, b = 0.5 * (x - 0.5 * wide_x), 0.5 * (x + 0.5 * wide_x)
    wave_x = abs(a - np.floor(a) - 0.5) - abs(b - np.floor(b) - 0.5)
    a, b = 0.5 * (y - 0.5 * wide_y), 0.5 * (y + 0.5 * wide_y)
    wave_y = abs(a - np.floor(a) - 0.5) - abs(b - np.floor(b) - 0.5)
    return 0.5 - 2.0 * wave_x * wave_y / (wide_x * wide_y)


@njit(cache=True, error_model="numpy", fastmath=FAST)
def backdrop_color(backdrop, row, height, out):
    share = (row + 0.5) / height
    for k in range(4):
        out[k] = backdrop[0, k] * (1.0 - share) + backdrop[1, k] * share
