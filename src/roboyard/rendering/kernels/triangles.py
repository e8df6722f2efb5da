"""Triangles of any size: filled row by row, and clipped at the near plane."""

from __future__ import annotations

import numpy as np

from roboyard.rendering.kernels.indices import I
from roboyard.rendering.kernels.snapping import DEPTH_ONLY, PEEL, SNAP, STEP

TIE = 0.5 * STEP * STEP
NARROW = 12
"""Most columns of a triangle's box whose pixels are all tested; wider ones compute where each row begins."""


def narrowed(slope, step, start, low, high):
    """Return the part of the columns `low` to `high` where the edge function `start + slope * k` is >= 0.

    `step` is -1 / slope.
    """
    if slope > 0.0:
        return max(low, np.ceil(start * step)), high
    if slope < 0.0:
        return low, min(high, np.floor(start * step))
    return low, (high if start >= 0.0 else -1.0)


def tie_of(a, b):
    """Return what an edge function with these slopes loses so that pixels on other edges are excluded."""
    return 0.0 if a > 0.0 or (a == 0.0 and b > 0.0) else TIE


def fill_triangle(
    x0, y0, q0, x1, y1, q1, x2, y2, q2, code, mode, limit, nearness, seen, width, first_row, end_row
):
    """Draw one snapped screen triangle in some rows; returns the number of pixels written."""
    upper, lower = float(first_row), float(end_row)
    left = np.int64(min(max(np.ceil(min(x0, x1, x2) - 0.5), 0.0), float(width)))
    right = np.int64(max(min(np.ceil(max(x0, x1, x2) - 0.5), float(width)), 0.0))
    top = np.int64(min(max(np.ceil(min(y0, y1, y2) - 0.5), upper), lower))
    bottom = np.int64(max(min(np.ceil(max(y0, y1, y2) - 0.5), lower), upper))
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    if area == 0.0 or left >= right or top >= bottom:
        return 0
    inverse = 1.0 / area
    q_dx = ((q1 - q0) * (y2 - y0) - (q2 - q0) * (y1 - y0)) * inverse
    q_dy = ((q2 - q0) * (x1 - x0) - (q1 - q0) * (x2 - x0)) * inverse
    # edge functions, positive inside; pixels on an edge that is neither top nor left are excluded
    turn = 1.0 if area > 0.0 else -1.0
    a0, b0 = turn * (y0 - y1), turn * (x1 - x0)
    a1, b1 = turn * (y1 - y2), turn * (x2 - x1)
    a2, b2 = turn * (y2 - y0), turn * (x0 - x2)
    px, py = left + 0.5, top + 0.5
    e0 = a0 * (px - x0) + b0 * (py - y0) - tie_of(a0, b0)
    e1 = a1 * (px - x1) + b1 * (py - y1) - tie_of(a1, b1)
    e2 = a2 * (px - x2) + b2 * (py - y2) - tie_of(a2, b2)
    q_row = q0 + q_dx * (px - x0) + q_dy * (py - y0)
    won = 0
    wide = right - left
    line = top * width + left
    if wide <= NARROW:
        for _ in range(bottom - top):
            f0, f1, f2, q_here = e0, e1, e2, q_row
            for k in range(wide):
                q = np.float32(q_here)
                p = I(line + k)
                if min(min(f0, f1), f2) >= 0.0 and q > nearness[p] and (mode != PEEL or q < limit[p]):
                    nearness[p] = q
                    if mode != DEPTH_ONLY:
                        seen[p] = code
                    won += 1
                f0 += a0
                f1 += a1
                f2 += a2
                q_here += q_dx
            e0 += b0
            e1 += b1
            e2 += b2
            q_row += q_dy
            line += width
        return won
    # columns between the edges of the triangle; the products are exact enough because edge functions that
    # are not zero are at least half a step away from it
    r0, r1, r2 = -1.0 / a0, -1.0 / a1, -1.0 / a2
    for _ in range(bottom - top):
        lo, hi = narrowed(a0, r0, e0, 0.0, wide - 1.0)
        lo, hi = narrowed(a1, r1, e1, lo, hi)
        lo, hi = narrowed(a2, r2, e2, lo, hi)
        first = np.int64(lo)
        start, q_here = line + first, q_row + q_dx * lo
        count = np.int64(hi) - first + 1
        if mode == DEPTH_ONLY:
            for k in range(count):
                p = I(start + k)
                nearness[p] = max(nearness[p], np.float32(q_here + q_dx * k))
        else:
            for k in range(count):
                q = np.float32(q_here + q_dx * k)
                p = I(start + k)
                if q > nearness[p] and (mode != PEEL or q < limit[p]):
                    nearness[p] = q
                    seen[p] = code
                    won += 1
        e0 += b0
        e1 += b1
        e2 += b2
        q_row += q_dy
        line += width
    return won


def fill_clipped(
    m, vertices, i0, i1, i2, perspective, near, cull, code, mode, limit, nearness, seen, width,
    first_row, end_row, corners,
):  # fmt: skip
    """Draw the part of a triangle beyond the near plane; `corners`: (7, 3) scratch."""
    corner, point = corners[:3], corners[3:]
    for k in range(3):
        i = i0 if k == 0 else (i1 if k == 1 else i2)
        for axis in range(3):
            corner[k, axis] = (
                m[axis, 0] * vertices[0, i]
                + m[axis, 1] * vertices[1, i]
                + m[axis, 2] * vertices[2, i]
                + m[axis, 3]
            )
    count = 0
    for k in range(3):
        a, b = corner[k], corner[k + 1 if k < 2 else 0]
        if a[2] >= near:
            point[count, 0], point[count, 1], point[count, 2] = a[0], a[1], a[2]
            count += 1
        if (a[2] >= near) != (b[2] >= near):
            # from the visible to the clipped corner, so that two triangles clip a shared edge at one point
            s, e = (a, b) if a[2] >= near else (b, a)
            t = (near - s[2]) / (e[2] - s[2])
            point[count, 0] = s[0] + t * (e[0] - s[0])
            point[count, 1] = s[1] + t * (e[1] - s[1])
            point[count, 2] = near
            count += 1
    for k in range(count):
        depth = point[k, 2]
        q = 1.0 / depth if perspective else -depth
        one = q if perspective else 1.0
        point[k, 0] = np.floor(point[k, 0] * one * SNAP + 0.5) / SNAP
        point[k, 1] = np.floor(point[k, 1] * one * SNAP + 0.5) / SNAP
        point[k, 2] = q
    won = 0
    for k in range(1, count - 1):
        ax, ay = point[k, 0] - point[0, 0], point[k, 1] - point[0, 1]
        bx, by = point[k + 1, 0] - point[0, 0], point[k + 1, 1] - point[0, 1]
        if cull * (ax * by - bx * ay) > 0.0:
            continue
        won += fill_triangle(
            point[0, 0], point[0, 1], point[0, 2],
            point[k, 0], point[k, 1], point[k, 2],
            point[k + 1, 0], point[k + 1, 1], point[k + 1, 2],
            code, mode, limit, nearness, seen, width, first_row, end_row,
        )  # fmt: skip
    return won
