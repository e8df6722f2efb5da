"""Visibility: the nearest triangle of each pixel and its distance.

A pixel's nearness `q` is 1 / depth for a perspective camera and -depth for an orthographic one. Both are
affine across the picture for any plane, increase towards the camera and suit single precision.

Screen positions are snapped to 1/1024 pixel, so that the edge functions are exact in double precision:
triangles that share an edge neither overlap nor leave a gap (top-left rule).
"""

from __future__ import annotations

import numpy as np

from roboyard._numba import njit

BEHIND = np.int64(-(2**62) - 12345)
"""Cell of a vertex in front of the near plane."""
SNAP = 1024.0
PLANE = 0x7FFFFFFF
"""Triangle number of an infinite plane."""
NARROW = 12
DEPTH_ONLY, RECORD, PEEL = 0, 1, 2


@njit(cache=True, error_model="numpy", nogil=True)
def narrowed(slope, start, low, high):
    """Return the part of the columns `low` to `high` where the edge function `start + slope * k` is >= 0."""
    if slope > 0.0:
        return max(low, np.ceil(-start / slope)), high
    if slope < 0.0:
        return low, min(high, np.floor(-start / slope))
    return low, (high if start >= 0.0 else -1.0)


@njit(cache=True, error_model="numpy", nogil=True)
def fill_triangle(x0, y0, q0, x1, y1, q1, x2, y2, q2, code, mode, limit, nearness, seen, width, height):
    """Draw one snapped screen triangle; returns the number of pixels written."""
    first_x = max(np.ceil(min(x0, x1, x2) - 0.5), 0.0)
    last_x = min(np.floor(max(x0, x1, x2) - 0.5), width - 1.0)
    first_y = max(np.ceil(min(y0, y1, y2) - 0.5), 0.0)
    last_y = min(np.floor(max(y0, y1, y2) - 0.5), height - 1.0)
    if first_x > last_x or first_y > last_y:
        return 0
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    if area == 0.0:
        return 0
    if area < 0.0:
        x1, x2, y1, y2, q1, q2 = x2, x1, y2, y1, q2, q1
        area = -area
    q_dx = ((q1 - q0) * (y2 - y0) - (q2 - q0) * (y1 - y0)) / area
    q_dy = ((q2 - q0) * (x1 - x0) - (q1 - q0) * (x2 - x0)) / area
    # edge functions, positive inside; pixels on an edge that is neither top nor left are excluded
    tie = 0.5 / (SNAP * SNAP)
    a0, b0 = y0 - y1, x1 - x0
    a1, b1 = y1 - y2, x2 - x1
    a2, b2 = y2 - y0, x0 - x2
    px, py = first_x + 0.5, first_y + 0.5
    e0 = a0 * (px - x0) + b0 * (py - y0)
    e1 = a1 * (px - x1) + b1 * (py - y1)
    e2 = a2 * (px - x2) + b2 * (py - y2)
    if not (a0 > 0.0 or (a0 == 0.0 and b0 > 0.0)):
        e0 -= tie
    if not (a1 > 0.0 or (a1 == 0.0 and b1 > 0.0)):
        e1 -= tie
    if not (a2 > 0.0 or (a2 == 0.0 and b2 > 0.0)):
        e2 -= tie
    q_row = q0 + q_dx * (px - x0) + q_dy * (py - y0)
    won = 0
    left, top, bottom = np.int64(first_x), np.int64(first_y), np.int64(last_y)
    wide = np.int64(last_x) - left
    for row in range(top, bottom + 1):
        start = row * width + left
        if wide <= NARROW:
            f0, f1, f2, q_here = e0, e1, e2, q_row
            for k in range(wide + 1):
                if f0 >= 0.0 and f1 >= 0.0 and f2 >= 0.0:
                    q = np.float32(q_here)
                    p = np.uint64(start + k)
                    if q > nearness[p] and (mode != PEEL or q < limit[p]):
                        nearness[p] = q
                        if mode != DEPTH_ONLY:
                            seen[p] = code
                        won += 1
                f0 += a0
                f1 += a1
                f2 += a2
                q_here += q_dx
        else:
            # columns between the edges of the triangle; the quotients are exact enough because edge
            # functions that are not zero are at least half a step away from it
            lo, hi = narrowed(a0, e0, 0.0, float(wide))
            lo, hi = narrowed(a1, e1, lo, hi)
            lo, hi = narrowed(a2, e2, lo, hi)
            for k in range(np.int64(lo), np.int64(hi) + 1):
                q = np.float32(q_row + q_dx * k)
                p = np.uint64(start + k)
                if q > nearness[p] and (mode != PEEL or q < limit[p]):
                    nearness[p] = q
                    if mode != DEPTH_ONLY:
                        seen[p] = code
                    won += 1
        e0 += b0
        e1 += b1
        e2 += b2
        q_row += q_dy
    return won


@njit(cache=True, error_model="numpy", nogil=True)
def box_in_view(matrix, lower, upper, perspective, near, far, width, height):
    """Return whether any part of a box may be visible in the picture."""
    left, right, above, below, close, beyond = 0, 0, 0, 0, 0, 0
    for corner in range(8):
        x = upper[0] if corner & 1 else lower[0]
        y = upper[1] if corner & 2 else lower[1]
        z = upper[2] if corner & 4 else lower[2]
        column = matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z + matrix[0, 3]
        row = matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z + matrix[1, 3]
        depth = matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z + matrix[2, 3]
        one = depth if perspective else 1.0
        left += column < 0.0
        right += column > width * one
        above += row < 0.0
        below += row > height * one
        close += depth < near
        beyond += depth > far
    return max(left, right, above, below, close, beyond) < 8


@njit(cache=True, error_model="numpy", nogil=True)
def draw_meshes(
    draws,
    matrices,
    boxes,
    vertices,
    faces,
    perspective,
    near,
    far,
    mode,
    limit,
    nearness,
    seen,
    width,
    height,
    screen,
    cell,
):
    """Draw ranges of triangles into `nearness` and `seen`; returns the number of pixels written.

    draws (n, 6) int32: instance, first and last + 1 vertex, first and last + 1 face, side to cull (0, 1, -1).
    matrices (instances, 3, 4): local point to (column · d, row · d, d), or (column, row, d) if orthographic.
    seen (pixels,) int64: instance << 32 | face. screen (most vertices of a mesh, 3) float32 and cell
    (most vertices of a mesh,) int64 are scratch.
    mode: RECORD; PEEL, only surfaces farther than `limit`; DEPTH_ONLY, without writing `seen`.
    """
    won = 0
    done = -1
    for draw in range(len(draws)):
        instance = draws[draw, 0]
        first, end = draws[draw, 1], draws[draw, 2]
        cull = draws[draw, 5]
        m = matrices[instance]
        if not box_in_view(m, boxes[instance, 0], boxes[instance, 1], perspective, near, far, width, height):
            continue
        if instance != done:
            done = instance
            m00, m01, m02, m03 = m[0, 0], m[0, 1], m[0, 2], m[0, 3]
            m10, m11, m12, m13 = m[1, 0], m[1, 1], m[1, 2], m[1, 3]
            m20, m21, m22, m23 = m[2, 0], m[2, 1], m[2, 2], m[2, 3]
            for i in range(end - first):
                x, y, z = vertices[first + i, 0], vertices[first + i, 1], vertices[first + i, 2]
                column = m00 * x + m01 * y + m02 * z + m03
                row = m10 * x + m11 * y + m12 * z + m13
                depth = m20 * x + m21 * y + m22 * z + m23
                q = -depth
                if perspective:
                    q = 1.0 / depth
                    column *= q
                    row *= q
                column = np.floor(column * SNAP + 0.5) / SNAP
                row = np.floor(row * SNAP + 0.5) / SNAP
                screen[i, 0], screen[i, 1], screen[i, 2] = column, row, q
                right = np.int64(min(max(np.ceil(column - 0.5), -1e9), 1e9))
                below = np.int64(min(max(np.ceil(row - 0.5), -1e9), 1e9))
                cell[i] = ((right << 32) ^ (below & 0xFFFFFFFF)) if depth >= near else BEHIND
        code_base = np.int64(instance) << 32
        for face in range(draws[draw, 3], draws[draw, 4]):
            i0, i1, i2 = faces[face, 0], faces[face, 1], faces[face, 2]
            c0, c1, c2 = cell[i0], cell[i1], cell[i2]
            # most triangles of a detailed mesh have no column or row of pixel centres between their corners
            apart = (c0 ^ c1) | (c0 ^ c2)
            if (apart >> 32) == 0 or (apart & 0xFFFFFFFF) == 0:
                continue
            if c0 != BEHIND and c1 != BEHIND and c2 != BEHIND:
                x0, y0 = float(screen[i0, 0]), float(screen[i0, 1])
                x1, y1 = float(screen[i1, 0]), float(screen[i1, 1])
                x2, y2 = float(screen[i2, 0]), float(screen[i2, 1])
                if cull * ((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)) > 0.0:
                    continue  # rows run downward: fronts have negative area
                won += fill_triangle(
                    x0, y0, float(screen[i0, 2]), x1, y1, float(screen[i1, 2]), x2, y2, float(screen[i2, 2]),
                    code_base | face, mode, limit, nearness, seen, width, height,
                )  # fmt: skip
            else:
                won += fill_clipped(
                    m, vertices, first + i0, first + i1, first + i2, perspective, near,
                    cull, code_base | face, mode, limit, nearness, seen, width, height,
                )  # fmt: skip
    return won


@njit(cache=True, error_model="numpy", nogil=True)
def fill_clipped(
    m, vertices, i0, i1, i2, perspective, near, cull, code, mode, limit, nearness, seen, width, height
):
    """Draw the part of a triangle beyond the near plane."""
    corner = np.empty((3, 3))
    for k in range(3):
        i = i0 if k == 0 else (i1 if k == 1 else i2)
        for axis in range(3):
            corner[k, axis] = (
                m[axis, 0] * vertices[i, 0]
                + m[axis, 1] * vertices[i, 1]
                + m[axis, 2] * vertices[i, 2]
                + m[axis, 3]
            )
    point = np.empty((4, 3))
    count = 0
    for k in range(3):
        a, b = corner[k], corner[(k + 1) % 3]
        if a[2] >= near:
            point[count] = a
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
            code, mode, limit, nearness, seen, width, height,
        )  # fmt: skip
    return won


@njit(cache=True, error_model="numpy", nogil=True)
def draw_plane(q_column, q_row, q_zero, q_most, code, mode, limit, nearness, seen, width, height):
    """Draw an infinite plane whose nearness is affine in the pixel; returns the number of pixels written."""
    won = 0
    for row in range(height):
        q_start = q_zero + q_row * (row + 0.5)
        for column in range(width):
            q = np.float32(q_start + q_column * (column + 0.5))
            p = row * width + column
            if q > nearness[p] and q <= q_most and (mode != PEEL or q < limit[p]):
                nearness[p] = q
                seen[p] = code
                won += 1
    return won
