"""Small triangles, set up many at a time on vectors of triangles.

Corners and edge functions are whole numbers of steps, so that coverage is exact in 32 bits.
"""

from __future__ import annotations

import numpy as np

from roboyard.rendering.kernels.indices import I
from roboyard.rendering.kernels.snapping import (
    BITS,
    DEPTH_ONLY,
    HIGH,
    LOW,
    MIDDLE,
    OUTSIDE,
    PEEL,
    SHIFT,
    SPECIAL,
)  # fmt: skip

ONE = np.float32(1.0)
BATCH = 256
"""Triangles that are set up at a time: their arrays stay in the processor's first cache."""
LARGEST = np.int32(11 * 1024)
"""Most steps from the first pixel of a small triangle to a corner: areas then fit into 32 bits."""
DROPPED, SMALL, LARGE = np.int32(0), np.int32(1), np.int32(2)
"""State of a triangle: without pixels to draw, small, or to be drawn by `triangles`."""

COUNTS = 24
WHOLE = BATCH * COUNTS
FACE, X0, Y0, C0, X1, Y1, C1, X2, Y2, C2 = (I(BATCH * k) for k in range(10))
A0, A1, A2, B0, B1, B2, E0, E1, E2 = (I(BATCH * k) for k in range(10, 19))
FIRST, WIDE, TALL, STATE, LIST = (I(BATCH * k) for k in range(19, COUNTS))
"""Places of a batch's arrays in one array of whole numbers: face; column and row (steps) and cell of each
corner; change of each edge function per column and per row, and value at the first pixel of the triangle's
box; that pixel, columns and rows of the box; state, and numbers of the triangles to draw."""
SINGLE = BATCH * 6
Q0, Q1, Q2, START, K1, K2 = (I(BATCH * k) for k in range(6))
"""Places of a batch's arrays in one array of single precision: nearness of each corner; nearness is START
plus K1 and K2 times edge functions 2 and 0."""


def gather(faces, start, end, cell, columns, rows, q, whole, single):
    """Write the corners of faces with a column and a row of pixel centres between them, at most BATCH.

    Most triangles of a detailed mesh have none. Returns the first face that was not looked at, and the number
    of faces found.
    """
    last = min(end, start + BATCH)
    count = I(0)
    # without a branch: whether a triangle has pixels is as good as random
    for face in range(I(start), I(last)):
        c0 = cell[I(faces[face, 0])]
        apart = (c0 ^ cell[I(faces[face, 1])]) | (c0 ^ cell[I(faces[face, 2])])
        whole[FACE + count] = face
        count += I((((apart & HIGH) != 0) & ((apart & LOW) != 0)) | (c0 == OUTSIDE))
    for k in range(count):
        face = I(whole[FACE + k])
        i, j, n = I(faces[face, 0]), I(faces[face, 1]), I(faces[face, 2])
        whole[X0 + k], whole[Y0 + k], whole[C0 + k], single[Q0 + k] = columns[i], rows[i], cell[i], q[i]
        whole[X1 + k], whole[Y1 + k], whole[C1 + k], single[Q1 + k] = columns[j], rows[j], cell[j], q[j]
        whole[X2 + k], whole[Y2 + k], whole[C2 + k], single[Q2 + k] = columns[n], rows[n], cell[n], q[n]
    return last, np.int64(count)


def set_up(count, cull, width, whole, single):
    """Write the edge functions and the nearness of gathered triangles, at the first pixel of their boxes.

    Small triangles fit into 32 bits in steps, so this runs on vectors of triangles.
    """
    for k in range(I(count)):
        c0, c1, c2 = whole[C0 + k], whole[C1 + k], whole[C2 + k]
        ordinary = max(max(c0, c1), c2) < SPECIAL
        u0, u1, u2 = (c0 >> BITS) & LOW, (c1 >> BITS) & LOW, (c2 >> BITS) & LOW
        v0, v1, v2 = c0 & LOW, c1 & LOW, c2 & LOW
        left, top = min(min(u0, u1), u2), min(min(v0, v1), v2)
        wide, high = max(max(u0, u1), u2) - left, max(max(v0, v1), v2) - top
        px, py = (left << SHIFT) + MIDDLE, (top << SHIFT) + MIDDLE
        x0, y0 = px - np.int64(whole[X0 + k]), py - np.int64(whole[Y0 + k])
        x1, y1 = px - np.int64(whole[X1 + k]), py - np.int64(whole[Y1 + k])
        x2, y2 = px - np.int64(whole[X2 + k]), py - np.int64(whole[Y2 + k])
        extent = max(max(abs(x0), abs(x1)), abs(x2))
        extent = max(extent, max(max(abs(y0), abs(y1)), abs(y2)))
        area = (x0 - x1) * (y0 - y2) - (x0 - x2) * (y0 - y1)
        turn = np.int32(1) if area > 0 else np.int32(-1)
        a0, b0 = turn * (y1 - y0), turn * (x0 - x1)
        a1, b1 = turn * (y2 - y1), turn * (x1 - x2)
        a2, b2 = turn * (y0 - y2), turn * (x2 - x0)
        # pixels on an edge that is neither top nor left are excluded
        t0 = np.int32(0) if (a0 > 0) | ((a0 == 0) & (b0 > 0)) else np.int32(1)
        t1 = np.int32(0) if (a1 > 0) | ((a1 == 0) & (b1 > 0)) else np.int32(1)
        t2 = np.int32(0) if (a2 > 0) | ((a2 == 0) & (b2 > 0)) else np.int32(1)
        e0, e1, e2 = a0 * x0 + b0 * y0 - t0, a1 * x1 + b1 * y1 - t1, a2 * x2 + b2 * y2 - t2
        q0 = single[Q0 + k]
        inverse = ONE / np.float32(turn * area)
        # corner 1 is opposite edge 2, corner 2 opposite edge 0
        k1, k2 = (single[Q1 + k] - q0) * inverse, (single[Q2 + k] - q0) * inverse
        misses = (wide == 1) & (high == 1) & ((e0 | e1 | e2) < 0)
        dropped = (area == 0) | (cull * np.int32(turn) > 0) | misses
        small = (extent <= LARGEST) & ordinary
        state = DROPPED if dropped else SMALL
        whole[STATE + k] = state if small else LARGE
        whole[A0 + k], whole[A1 + k], whole[A2 + k] = a0 << SHIFT, a1 << SHIFT, a2 << SHIFT
        whole[B0 + k], whole[B1 + k], whole[B2 + k] = b0 << SHIFT, b1 << SHIFT, b2 << SHIFT
        whole[E0 + k], whole[E1 + k], whole[E2 + k] = e0, e1, e2
        whole[FIRST + k], whole[WIDE + k], whole[TALL + k] = top * width + left, wide, high
        single[START + k] = q0 + np.float32(t2) * k1 + np.float32(t0) * k2
        single[K1 + k], single[K2 + k] = k1, k2


def those_to_draw(count, whole):
    """Write the numbers of the gathered triangles that are drawn to LIST; returns how many these are."""
    left = I(0)
    for k in range(I(count)):
        whole[LIST + left] = k
        left += I(whole[STATE + k] != DROPPED)
    return np.int64(left)


def fill_small(whole, single, k, code, mode, limit, nearness, seen, width):
    """Draw the gathered triangle k, a small one; returns the number of pixels written."""
    a0, a1, a2 = whole[A0 + k], whole[A1 + k], whole[A2 + k]
    b0, b1, b2 = whole[B0 + k], whole[B1 + k], whole[B2 + k]
    e0, e1, e2 = whole[E0 + k], whole[E1 + k], whole[E2 + k]
    start, k1, k2 = single[START + k], single[K1 + k], single[K2 + k]
    line, wide = I(whole[FIRST + k]), I(whole[WIDE + k])
    won = 0
    for _ in range(whole[TALL + k]):
        f0, f1, f2 = e0, e1, e2
        for p in range(line, line + wide):
            if (f0 | f1 | f2) >= 0:
                q = start + np.float32(f2) * k1 + np.float32(f0) * k2
                if q > nearness[p] and (mode != PEEL or q < limit[p]):
                    nearness[p] = q
                    if mode != DEPTH_ONLY:
                        seen[p] = code
                    won += 1
            f0, f1, f2 = f0 + a0, f1 + a1, f2 + a2
        e0, e1, e2 = e0 + b0, e1 + b1, e2 + b2
        line += I(width)
    return won
