"""What lies on a surface or behind it: checkerboards, the backdrop."""

from __future__ import annotations

import numpy as np
from numba import njit

from roboyard.rendering.kernels.options import FAST


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
