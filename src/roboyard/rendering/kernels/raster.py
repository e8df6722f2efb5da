"""Visibility: the nearest triangle of each pixel and its distance.

A pixel's nearness `q` is 1 / depth for a perspective camera and -depth for an orthographic one. Both are
affine across the picture for any plane, increase towards the camera and suit single precision.

Screen positions are snapped to 1/1024 pixel, so that the edge functions are exact: triangles that share an
edge neither overlap nor leave a gap (top-left rule).
"""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.rendering.kernels.indices import I
from roboyard.rendering.kernels.small_triangles import (
    FACE,
    LIST,
    SINGLE,
    SMALL,
    STATE,
    WHOLE,
    fill_small,
    gather,
    set_up,
    those_to_draw,
)  # fmt: skip
from roboyard.rendering.kernels.snapping import DEPTH_ONLY, PEEL, RECORD, SPECIAL, STEP, project
from roboyard.rendering.kernels.triangles import fill_clipped, fill_triangle

__all__ = ["DEPTH_ONLY", "PEEL", "PLANE", "RECORD", "SINGLE", "WHOLE", "draw_meshes", "draw_plane"]

PLANE = 0x7FFFFFFF
"""Triangle number of an infinite plane."""


def box_in_view(matrix, lower, upper, perspective, near, far, width, first_row, end_row):
    """Return whether any part of a box may be visible in some rows of the picture."""
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
        above += row < first_row * one
        below += row > end_row * one
        close += depth < near
        beyond += depth > far
    return max(left, right, above, below, close, beyond) < 8


@compiled(
    "i4[:,::1] f8[:,:,:] f8[:,:,:] f4[:,::1] i4[:,::1] i8 f8 f8 i8 f4[::1] f4[::1] i8[::1]",
    "i8 i8 i8 i4[::1] i4[:,::1] f4[::1] i4[::1] f4[::1] f8[:,::1] -> i8",
    releases_gil=True,
)
def draw_meshes(
    draws, matrices, boxes, vertices, faces, perspective, near, far, mode, limit, nearness, seen,
    width, first_row, end_row, cell, place, q, whole, single, corners,
):  # fmt: skip
    """Draw ranges of triangles into `nearness` and `seen`; returns the number of pixels written.

    Args:
        draws: (n, 6) int32: instance, first and last + 1 vertex, first and last + 1 face, side to cull (0, 1,
            -1).
        matrices: (instances, 3, 4) local point to (column · d, row · d, d), or (column, row, d) if
            orthographic.
        boxes: (instances, 2, 3) bounds in the mesh frame.
        vertices: (3, k) float32, axis by axis.
        faces: (m, 3) int32 vertex indices inside the face's own mesh.
        perspective: whether nearness is 1 / depth; otherwise it is -depth.
        near: least depth (m).
        far: largest depth (m).
        mode: RECORD; PEEL, only surfaces farther than `limit`; DEPTH_ONLY, without writing `seen`.
        limit: (pixels,) nearness of the layers in front, for PEEL.
        nearness: (pixels,) float32, updated.
        seen: (pixels,) int64, updated: instance << 32 | face.
        width: columns, at most 32768.
        first_row: first row to draw.
        end_row: last row to draw + 1, at most 32768.
        cell: (most vertices of a mesh,) int32 scratch.
        place: (2, most vertices of a mesh) int32 scratch.
        q: (most vertices of a mesh,) float32 scratch.
        whole: (WHOLE,) int32 scratch.
        single: (SINGLE,) float32 scratch.
        corners: (7, 3) scratch.
    """
    won = 0
    done = -1
    for draw in range(len(draws)):
        instance = draws[draw, 0]
        cull = draws[draw, 5]
        m = matrices[instance]
        if not box_in_view(
            m, boxes[instance, 0], boxes[instance, 1], perspective, near, far, width, first_row, end_row
        ):
            continue
        first = np.int64(draws[draw, 1])
        if instance != done:
            done = instance
            project(
                m, vertices[0], vertices[1], vertices[2], first, draws[draw, 2], perspective, near, width,
                first_row, end_row, cell, place[0], place[1], q,
            )  # fmt: skip
        columns, rows = place[0], place[1]
        code_base = np.int64(instance) << 32
        end = np.int64(draws[draw, 4])
        start = np.int64(draws[draw, 3])
        while start < end:
            start, count = gather(faces, start, end, cell, columns, rows, q, whole, single)
            set_up(count, np.int32(cull), np.int32(width), whole, single)
            count = those_to_draw(count, whole)
            for n in range(I(count)):
                k = I(whole[LIST + n])
                face = np.int64(whole[FACE + k])
                if whole[STATE + k] == SMALL:
                    won += fill_small(whole, single, k, code_base | face, mode, limit, nearness, seen, width)
                    continue
                i0, i1, i2 = I(faces[face, 0]), I(faces[face, 1]), I(faces[face, 2])
                if max(cell[i0], cell[i1], cell[i2]) >= SPECIAL:
                    won += fill_clipped(
                        m, vertices, first + np.int64(i0), first + np.int64(i1), first + np.int64(i2),
                        perspective, near, cull, code_base | face, mode, limit, nearness, seen, width,
                        first_row, end_row, corners,
                    )  # fmt: skip
                    continue
                x0, y0 = columns[i0] * STEP, rows[i0] * STEP
                x1, y1 = columns[i1] * STEP, rows[i1] * STEP
                x2, y2 = columns[i2] * STEP, rows[i2] * STEP
                if cull * ((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)) > 0.0:
                    continue  # rows run downward: fronts have negative area
                won += fill_triangle(
                    x0, y0, np.float64(q[i0]), x1, y1, np.float64(q[i1]), x2, y2, np.float64(q[i2]),
                    code_base | face, mode, limit, nearness, seen, width, first_row, end_row,
                )  # fmt: skip
    return won


@compiled("f8 f8 f8 f8 i8 i8 f4[::1] f4[::1] i8[::1] i8 i8 i8 -> i8", releases_gil=True)
def draw_plane(q_column, q_row, q_zero, q_most, code, mode, limit, nearness, seen, width, first_row, end_row):
    """Draw an infinite plane whose nearness is affine in the pixel, in some rows.

    Returns the number of pixels written.
    """
    won = 0
    for row in range(first_row, end_row):
        q_start = q_zero + q_row * (row + 0.5)
        for column in range(width):
            q = np.float32(q_start + q_column * (column + 0.5))
            p = row * width + column
            if q > nearness[p] and q <= q_most and (mode != PEEL or q < limit[p]):
                nearness[p] = q
                seen[p] = code
                won += 1
    return won
