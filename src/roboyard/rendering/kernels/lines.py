"""Line segments over a finished picture, hidden behind nearer surfaces."""

from __future__ import annotations

import math

import numpy as np

from roboyard.native import compiled


@compiled(
    "f8[:,:] f8[:,:] f8[:,:] f8[:] f8[:,:] i8 f8 i8 i8 f4[::1] u1[:,::1] f8[:,::1]",
    releases_gil=True,
)
def draw_lines(start, end, rgb, thickness, matrix, perspective, near, width, height, nearness, out, ends):
    """Blend segments into uint8 (pixels, 4) `out`; `thickness` in pixels, ends round, edges smooth.

    `ends`: (2, 3) scratch.

    A segment wins over a surface at up to 0.2 % more depth, so that one drawn on a surface shows.
    """
    for i in range(len(start)):
        for k in range(2):
            point = start[i] if k == 0 else end[i]
            for axis in range(3):
                ends[k, axis] = (
                    matrix[axis, 0] * point[0]
                    + matrix[axis, 1] * point[1]
                    + matrix[axis, 2] * point[2]
                    + matrix[axis, 3]
                )
        if ends[0, 2] < near and ends[1, 2] < near:
            continue
        for k in range(2):
            if ends[k, 2] < near:
                share = (near - ends[1 - k, 2]) / (ends[k, 2] - ends[1 - k, 2])
                for axis in range(2):
                    ends[k, axis] = ends[1 - k, axis] + share * (ends[k, axis] - ends[1 - k, axis])
                ends[k, 2] = near
        if perspective:
            for k in range(2):
                ends[k, 2] = 1.0 / ends[k, 2]
                ends[k, 0] *= ends[k, 2]
                ends[k, 1] *= ends[k, 2]
        else:
            ends[0, 2], ends[1, 2] = -ends[0, 2], -ends[1, 2]
        x0, y0, q0 = ends[0, 0], ends[0, 1], ends[0, 2]
        dx, dy, dq = ends[1, 0] - x0, ends[1, 1] - y0, ends[1, 2] - q0
        length = dx * dx + dy * dy
        half = 0.5 * max(thickness[i], 1.0)
        reach = half + 0.5
        # walk along the longer axis; across it, a slanted line covers more pixels
        steep = abs(dy) > abs(dx)
        along_0, along_d = (y0, dy) if steep else (x0, dx)
        across_0, across_d = (x0, dx) if steep else (y0, dy)
        along_size, across_size = (height, width) if steep else (width, height)
        slope = across_d / along_d if along_d != 0.0 else 0.0
        spread = reach * math.sqrt(1.0 + slope * slope)
        first = max(np.floor(min(along_0, along_0 + along_d) - reach), 0.0)
        last = min(np.ceil(max(along_0, along_0 + along_d) + reach), along_size - 1.0)
        if not first <= last:
            continue
        for a in range(np.int64(first), np.int64(last) + 1):
            middle = across_0 + slope * (a + 0.5 - along_0)
            low = max(np.floor(middle - spread), 0.0)
            high = min(np.ceil(middle + spread), across_size - 1.0)
            if not low <= high:
                continue
            for b in range(np.int64(low), np.int64(high) + 1):
                column, row = (b, a) if steep else (a, b)
                rx, ry = column + 0.5 - x0, row + 0.5 - y0
                t = 0.0
                if length > 0.0:
                    t = min(max((rx * dx + ry * dy) / length, 0.0), 1.0)
                cover = reach - math.sqrt((rx - t * dx) ** 2 + (ry - t * dy) ** 2)
                if cover <= 0.0:
                    continue
                p = row * width + column
                q = q0 + t * dq
                if q + 0.002 * abs(q) < nearness[p]:
                    continue
                cover = min(cover, 1.0)
                for k in range(3):
                    out[p, k] = np.uint8(out[p, k] + cover * (255.0 * rgb[i, k] - out[p, k]) + 0.5)
                out[p, 3] = np.uint8(out[p, 3] + cover * (255.0 - out[p, 3]) + 0.5)
