"""Grow spheres until no point of a surface is too far outside them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from roboyard._numba import njit
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.voxels.grid import triangles

Array = NDArray[np.float64]


def enclose_surface(
    meshes: TriangleMesh | Sequence[TriangleMesh], skin: Array, centers: Array, radii: Array, slack: float
) -> None:
    """Grow (n,) `radii` in place until no surface point is more than `slack` (m) outside the spheres."""
    grow_to_cover(skin, centers, radii, 0.6 * slack)
    corners = np.concatenate([vertices[faces] for vertices, faces in triangles(meshes)])
    finest = max(0.3 * slack, float(np.ptp(corners.reshape(-1, 3), axis=0).max()) / 1000.0)
    grow_to_enclose(np.ascontiguousarray(corners), centers, radii, slack, finest)


@njit(cache=True, nogil=True)
def grow_to_cover(points, centers, radii, slack):
    """Grow (n,) `radii`, worst point first, until (p, 3) points are at most `slack` outside the union."""
    n = radii.shape[0]
    gap = np.empty(points.shape[0])
    who = np.empty(points.shape[0], np.int32)
    for p in range(points.shape[0]):
        gap[p] = 1e30
        for s in range(n):
            dx, dy, dz = (
                points[p, 0] - centers[s, 0],
                points[p, 1] - centers[s, 1],
                points[p, 2] - centers[s, 2],
            )
            d = math.sqrt(dx * dx + dy * dy + dz * dz) - radii[s]
            if d < gap[p]:
                gap[p], who[p] = d, s
    for _ in range(100 * n + 100):
        worst = 0
        for p in range(points.shape[0]):
            if gap[p] > gap[worst]:
                worst = p
        if points.shape[0] == 0 or gap[worst] <= slack:
            return
        s = who[worst]
        radii[s] += gap[worst] - slack + 1e-9
        for p in range(points.shape[0]):
            dx, dy, dz = (
                points[p, 0] - centers[s, 0],
                points[p, 1] - centers[s, 1],
                points[p, 2] - centers[s, 2],
            )
            d = math.sqrt(dx * dx + dy * dy + dz * dz) - radii[s]
            if d < gap[p]:
                gap[p], who[p] = d, s


@njit(cache=True, nogil=True)
def grow_to_enclose(corners, centers, radii, slack, finest):
    """Grow (n,) `radii` until no point of any triangle can be more than `slack` outside the union.

    A triangle is done when its middle's gap plus its own radius is below `slack`, since distance changes no
    faster than position; else its longest edge is halved, down to a radius of `finest`.

    Args:
        corners: (m, 3, 3) triangles (m).
    """
    n = radii.shape[0]
    stack = np.empty((256, 3, 3))
    for f in range(corners.shape[0]):
        stack[0] = corners[f]
        top = 1
        while top > 0:
            top -= 1
            a, b, c = stack[top, 0].copy(), stack[top, 1].copy(), stack[top, 2].copy()
            m = (a + b + c) / 3.0
            reach = 0.0
            for q in (a, b, c):
                reach = max(reach, (q[0] - m[0]) ** 2 + (q[1] - m[1]) ** 2 + (q[2] - m[2]) ** 2)
            reach = math.sqrt(reach)
            gap, who = 1e30, 0
            for s in range(n):
                dx, dy, dz = m[0] - centers[s, 0], m[1] - centers[s, 1], m[2] - centers[s, 2]
                d = math.sqrt(dx * dx + dy * dy + dz * dz) - radii[s]
                if d < gap:
                    gap, who = d, s
            if gap + reach <= slack:
                continue
            if reach <= finest or top + 2 > stack.shape[0]:
                radii[who] += gap + reach - slack
                continue
            ab, bc, ca = ((b - a) ** 2).sum(), ((c - b) ** 2).sum(), ((a - c) ** 2).sum()
            if bc >= ab and bc >= ca:
                a, b, c = b, c, a
            elif ca >= ab:
                a, b, c = c, a, b
            middle = 0.5 * (a + b)
            stack[top, 0], stack[top, 1], stack[top, 2] = a, middle, c
            stack[top + 1, 0], stack[top + 1, 1], stack[top + 1, 2] = middle, b, c
            top += 2
