"""Screen positions in whole steps of a pixel, cells of pixel centres, and modes of drawing."""

from __future__ import annotations

import numpy as np

from roboyard.rendering.kernels.indices import I

DEPTH_ONLY, RECORD, PEEL = 0, 1, 2
SNAP, SHIFT = 1024.0, np.int32(10)
"""Steps of a pixel, and their power of two."""
STEP = 1.0 / SNAP
MIDDLE, CEILING = np.int32(512), np.int32(511)
"""Steps from a pixel's side to its centre, and what is added so that quotients are rounded up there."""
FARTHEST = 2.0**30
"""Most steps of a column or row; vertices beyond are OUTSIDE."""
BITS, LOW, HIGH = np.int32(16), np.int32(0xFFFF), np.int32(-0x10000)
BEHIND, OUTSIDE = np.int32(0x7FFFFFFF), np.int32(0x7FFEFFFE)
"""Cells of vertices in front of the near plane, and of others far outside the picture; those of the rest are
column << BITS | row."""
SPECIAL = OUTSIDE
"""Least of these two."""


def project(m, xs, ys, zs, first, end, perspective, near, width, first_row, end_row, cell, columns, rows, qs):
    """Write the snapped columns and rows of vertices, in steps, their nearness and their cells.

    A cell is the first column and row of pixel centres at or after a vertex, in the columns of the
    picture and the rows to draw, or just behind their last ones.
    """
    m00, m01, m02, m03 = m[0, 0] * SNAP, m[0, 1] * SNAP, m[0, 2] * SNAP, m[0, 3] * SNAP
    m10, m11, m12, m13 = m[1, 0] * SNAP, m[1, 1] * SNAP, m[1, 2] * SNAP, m[1, 3] * SNAP
    m20, m21, m22, m23 = m[2, 0], m[2, 1], m[2, 2], m[2, 3]
    start, count = I(first), I(end - first)
    if perspective:
        for k in range(count):
            x, y, z = np.float64(xs[start + k]), np.float64(ys[start + k]), np.float64(zs[start + k])
            q = 1.0 / (m20 * x + m21 * y + m22 * z + m23)
            column, row = m00 * x + m01 * y + m02 * z + m03, m10 * x + m11 * y + m12 * z + m13
            columns[k] = np.int32(min(max(np.floor(column * q + 0.5), -FARTHEST), FARTHEST))
            rows[k] = np.int32(min(max(np.floor(row * q + 0.5), -FARTHEST), FARTHEST))
            qs[k] = q
    else:
        for k in range(count):
            x, y, z = np.float64(xs[start + k]), np.float64(ys[start + k]), np.float64(zs[start + k])
            column, row = m00 * x + m01 * y + m02 * z + m03, m10 * x + m11 * y + m12 * z + m13
            columns[k] = np.int32(min(max(np.floor(column + 0.5), -FARTHEST), FARTHEST))
            rows[k] = np.int32(min(max(np.floor(row + 0.5), -FARTHEST), FARTHEST))
            qs[k] = -(m20 * x + m21 * y + m22 * z + m23)
    least = np.float32(0.0) if perspective else np.float32(-np.inf)
    most = np.float32(1.0 / near) if perspective else np.float32(-near)
    far = np.int32(FARTHEST)
    for k in range(count):
        column, row = columns[k], rows[k]
        right = min(max((column + CEILING) >> SHIFT, np.int32(0)), np.int32(width))
        below = min(max((row + CEILING) >> SHIFT, np.int32(first_row)), np.int32(end_row))
        mark = np.int32((right << BITS) | below)
        mark = mark if max(abs(column), abs(row)) < far else OUTSIDE
        cell[k] = mark if (qs[k] > least) & (qs[k] <= most) else BEHIND
