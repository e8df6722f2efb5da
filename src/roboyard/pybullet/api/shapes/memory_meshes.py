"""Meshes given as lists of vertices and triangles."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.number_lists import finite_rows, integers_up_to
from roboyard.shapes.mesh import TriangleMesh, read_only

Vector = Sequence[float]
_HULLS = 64
"""Number of hulls that are kept; programs create the same shapes many times."""


def mesh_of(
    vertices: Sequence[Vector],
    indices: Sequence[int] | None,
    normals: Sequence[Vector] | None = None,
    uvs: Sequence[Vector] | None = None,
) -> TriangleMesh:
    """Return a mesh from vertices and triangles.

    Args:
        vertices: (k, 3) points (m).
        indices: (3 n,) triangle corners; without them, the convex hull of the points is returned.
        normals: (k, 3) normals of the vertices; ignored for another length.
        uvs: (k, 2) texture coordinates of the vertices; ignored for another length.

    Raises:
        error: there are too few points, an index is out of range, or the points are coplanar.
    """
    read = finite_rows(vertices, 3)
    points = np.array(vertices, dtype=float).reshape(-1, 3) if read is None else read
    if len(points) < 3 or (read is None and not np.isfinite(points).all()):
        raise failure(
            "createCollisionShape failed.", f"a mesh needs at least three finite vertices, got {len(points)}"
        )
    if indices is None or not len(indices):
        return _hull(points.tobytes())
    faces = integers_up_to(indices, len(points) - 1)
    if faces is None:
        faces = np.array(indices, dtype=np.int64)
        if faces.min() < 0 or faces.max() >= len(points):
            raise failure(
                "createCollisionShape failed.",
                f"indices must be 0 to {len(points) - 1}, got {faces.min()} to {faces.max()}",
            )
    points.setflags(write=False)
    return TriangleMesh(
        vertices=points,
        faces=read_only(faces.reshape(-1, 3), np.int32),
        normals=None if normals is None else _per_vertex(normals, len(points), 3),
        uv=None if uvs is None else _per_vertex(uvs, len(points), 2),
    )


@lru_cache(_HULLS)
def _hull(numbers: bytes) -> TriangleMesh:
    """Return the convex hull of points, given as the bytes of (k, 3) numbers (m)."""
    from roboyard._qhull import qhull

    ConvexHull, QhullError = qhull()

    points = np.frombuffer(numbers).reshape(-1, 3)
    try:
        hull = ConvexHull(points)
    except QhullError:
        raise failure(
            "createCollisionShape failed.", f"the {len(points)} points are coplanar; give indices too"
        ) from None
    used, faces = np.unique(hull.simplices, return_inverse=True)
    corners = points[used]
    faces = faces.reshape(-1, 3)
    a, b, d = (corners[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, d - a), a - corners.mean(axis=0)) < 0
    faces[inward] = faces[inward][:, ::-1]
    return TriangleMesh(
        vertices=read_only(corners, np.float64), faces=read_only(faces, np.int32), hull_points=points
    )


def _per_vertex(values: Sequence[Vector], count: int, width: int) -> np.ndarray | None:
    if len(values) != count:
        return None
    made = finite_rows(values, width)
    if made is None:
        made = np.array(values, dtype=float).reshape(count, width)
    made.setflags(write=False)
    return made
