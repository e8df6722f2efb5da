"""Grow spheres until no point of a surface is too far outside them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from roboyard._arrays import NDArray
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
    # coordinate by coordinate: numba takes several times as long to compile operations on rows
    n = radii.shape[0]
    stack, now = np.empty((256, 3, 3)), np.empty((3, 3))
    for f in range(corners.shape[0]):
        for i in range(3):
            for k in range(3):
                stack[0, i, k] = corners[f, i, k]
        top = 1
        while top > 0:
            top -= 1
            for i in range(3):
                for k in range(3):
                    now[i, k] = stack[top, i, k]
            x = (now[0, 0] + now[1, 0] + now[2, 0]) / 3.0
            y = (now[0, 1] + now[1, 1] + now[2, 1]) / 3.0
            z = (now[0, 2] + now[1, 2] + now[2, 2]) / 3.0
            reach = 0.0
            for i in range(3):
                dx, dy, dz = now[i, 0] - x, now[i, 1] - y, now[i, 2] - z
                reach = max(reach, dx * dx + dy * dy + dz * dz)
            reach = math.sqrt(reach)
            gap, who = 1e30, 0
            for s in range(n):
                dx, dy, dz = x - centers[s, 0], y - centers[s, 1], z - centers[s, 2]
                d = math.sqrt(dx * dx + dy * dy + dz * dz) - radii[s]
                if d < gap:
                    gap, who = d, s
            if gap + reach <= slack:
                continue
            if reach <= finest or top + 2 > stack.shape[0]:
                radii[who] += gap + reach - slack
                continue
            ab, bc, ca = _square(now, 0, 1), _square(now, 1, 2), _square(now, 2, 0)
            a = 1 if bc >= ab and bc >= ca else (2 if ca >= ab else 0)
            b, c = (a + 1) % 3, (a + 2) % 3
            for k in range(3):
                middle = 0.5 * (now[a, k] + now[b, k])
                stack[top, 0, k], stack[top, 1, k], stack[top, 2, k] = now[a, k], middle, now[c, k]
                stack[top + 1, 0, k], stack[top + 1, 1, k], stack[top + 1, 2, k] = (
                    middle,
                    now[b, k],
                    now[c, k],
                )
            top += 2


@njit(cache=True, nogil=True)
def _square(points, i, j):
    """Return the squared distance of two of (n, 3) points."""
    x, y, z = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
    return x * x + y * y + z * z
