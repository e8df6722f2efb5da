"""A tree of boxes over the triangles of a mesh, and which of their edges are seams of one smooth surface."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from roboyard._records import dataclass
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import Array

LEAF_SIZE = 4
"""Largest number of triangles in a leaf."""
SMOOTH_ANGLE = np.deg2rad(30.0)
"""Angle between two triangles up to which their common edge is a seam of one surface (rad)."""
_SMALLEST = 1e-12
"""Twice the area of the smallest triangle that is kept (m²)."""
_WELD = 1e-6
"""Distance, as a fraction of the mesh's size, up to which vertices count as one."""
_WELD_BITS = 21
"""Bits of each coordinate in such steps: 1 / `_WELD` of them."""
_BITS = 10
"""Bits of each coordinate by which triangles are sorted along a curve that fills space."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TriangleTree:
    """The t triangles of a mesh in a complete binary tree of boxes; node k has the children 2k+1 and 2k+2."""

    corners: Array
    """(t, 3, 3) corners (m)."""
    normals: Array
    """(t, 3) unit normals."""
    sides: Array
    """(t, 3, 3) unit directions out of the triangle across its edges 01, 12 and 20, in its plane."""
    lower: Array
    """(2 n - 1, 3) lower corners of the boxes of all nodes, leaves last (m)."""
    upper: Array
    """(2 n - 1, 3) upper corners (m)."""
    first: np.ndarray
    """(n + 1,) int32: first triangle of each leaf."""

    @cached_property
    def smooth(self) -> np.ndarray:
        """(t, 3) bool: whether an edge continues in another triangle without a kink (lazy)."""
        return _smooth(self.corners, self.sides)

    def __len__(self) -> int:
        return len(self.corners)


def triangle_tree(mesh: TriangleMesh) -> TriangleTree:
    """Return the tree of a mesh's triangles; triangles without area are omitted.

    Args:
        mesh: the triangles; their winding does not matter.
    """
    corners = np.asarray(mesh.vertices, dtype=float)[mesh.faces]
    normals = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = _length(normals)
    kept = np.flatnonzero(areas > _SMALLEST)
    middles = ((corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3)[kept]
    kept = kept[np.argsort(_places_on_curve(middles), kind="stable")]
    corners, normals = corners[kept], normals[kept] / areas[kept, None]
    sides = np.empty_like(corners)
    for k in range(3):
        side = _cross(corners[:, (k + 1) % 3] - corners[:, k], normals)
        sides[:, k] = side / np.maximum(_length(side), 1e-300)[:, None]
    lower, upper, first = boxes_of(corners)
    return TriangleTree(corners=corners, normals=normals, sides=sides, lower=lower, upper=upper, first=first)


def _cross(a: Array, b: Array) -> Array:
    """Return the cross products of (t, 3) vectors, in a third of `numpy.cross`'s time."""
    (x, y, z), (u, v, w) = a.T, b.T
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=1)


def _length(a: Array) -> Array:
    """Return the lengths (t,) of (t, 3) vectors."""
    x, y, z = a.T
    return np.sqrt(x * x + y * y + z * z)


def _places_on_curve(points: Array) -> np.ndarray:
    """Return (t,) places of (t, 3) points along a Morton curve."""
    if not len(points):
        return np.zeros(0, dtype=np.int64)
    low = points.min(axis=0)
    cells = ((points - low) * ((2**_BITS - 1) / max(float(np.ptp(points, axis=0).max()), 1e-300))).astype(int)
    place = np.zeros(len(points), dtype=np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            place |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return place


def boxes_of(corners: Array) -> tuple[Array, Array, np.ndarray]:
    """Return least and largest corner of all nodes over triangles (t, 3, 3), and the leaves' first triangles.

    They are the arrays `lower`, `upper` and `first` of a `TriangleTree` of triangles in this order.
    """
    count = len(corners)
    leaves = 1
    while leaves * LEAF_SIZE < count:
        leaves *= 2
    first = (np.arange(leaves + 1) * count // leaves).astype(np.int32)
    lower, upper = np.zeros((2 * leaves - 1, 3)), np.zeros((2 * leaves - 1, 3))
    if count:
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        lower[leaves - 1 :] = np.minimum.reduceat(np.minimum(np.minimum(a, b), c), first[:-1])
        upper[leaves - 1 :] = np.maximum.reduceat(np.maximum(np.maximum(a, b), c), first[:-1])
    level = leaves // 2
    while level:
        parents, children = slice(level - 1, 2 * level - 1), slice(2 * level - 1, 4 * level - 1)
        lower[parents] = np.minimum(lower[children][::2], lower[children][1::2])
        upper[parents] = np.maximum(upper[children][::2], upper[children][1::2])
        level //= 2
    return lower, upper, first


def _smooth(corners: Array, sides: Array) -> np.ndarray:
    """Return (t, 3) whether each edge is shared with a triangle that continues it within `SMOOTH_ANGLE`."""
    smooth = np.zeros((len(corners), 3), dtype=bool)
    if not len(corners):
        return smooth
    points = corners.reshape(-1, 3)
    unit = max(float(np.ptp(points, axis=0).max()), 1e-300) * _WELD
    cells = np.round(points / unit).astype(np.int64)
    cells -= cells.min(axis=0)
    cells = (cells[:, 0] << _WELD_BITS | cells[:, 1]) << _WELD_BITS | cells[:, 2]
    _, number = np.unique(cells, return_inverse=True)
    one = number.reshape(-1, 3)
    other = np.roll(one, -1, axis=1)
    keys = (np.minimum(one, other) * (int(one.max()) + 1) + np.maximum(one, other)).ravel()
    order = np.argsort(keys, kind="stable")
    paired = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    a, b = order[paired], order[paired + 1]
    out = sides.reshape(-1, 3)
    flat = -np.einsum("ij,ij->i", out[a], out[b]) > np.cos(SMOOTH_ANGLE)
    smooth.ravel()[a[flat]] = smooth.ravel()[b[flat]] = True
    return smooth
