"""Triangle meshes as read-only arrays, shared by all folders."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import dataclass


@dataclass(frozen=True, kw_only=True, eq=False)
class TriangleMesh:
    """A triangle mesh in metres. Arrays are C-contiguous and read-only."""

    vertices: NDArray[np.float64]
    """(n, 3) positions (m)."""
    faces: NDArray[np.int32]
    """(m, 3) vertex indices, counter-clockwise seen from outside."""
    normals: NDArray[np.float64] | None = None
    """(n, 3) unit vertex normals if the file has them; None: flat or derived from the faces."""
    uv: NDArray[np.float64] | None = None
    """(n, 2) texture coordinates, v up; None without a texture."""
    colors: NDArray[np.uint8] | None = None
    """(m, 4) RGBA of each face if the file has materials or vertex colours."""
    texture: NDArray[np.uint8] | None = None
    """(h, w, 4) RGBA image, row 0 at the top."""
    hull_points: NDArray[np.float64] | None = None
    """(k, 3) points (m) that the mesh is the convex hull of, as they were given; None of other meshes."""

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) lower and upper corner of the bounding box (m)."""
        return bounding_box(self.vertices)


NO_TRIANGLES = TriangleMesh(vertices=np.zeros((0, 3)), faces=np.zeros((0, 3), dtype=np.int32))
"""A mesh that shows nothing."""


def bounding_box(points: NDArray) -> NDArray[np.float64]:
    """Return the (2, 3) lower and upper corner of the box around (n, 3) points."""
    x, y, z = points.T  # column by column: NumPy takes ten times as long along the rows
    return np.array([[x.min(), y.min(), z.min()], [x.max(), y.max(), z.max()]])


def read_only(array: NDArray, dtype: type) -> NDArray:
    """Return a C-contiguous read-only copy of an array (...,) of any shape."""
    out = np.array(array, dtype=dtype, order="C")
    out.setflags(write=False)
    return out


def shared(array: NDArray, dtype: type) -> NDArray:
    """Return the (...,) array itself if it is read-only and C-contiguous, else such a copy."""
    if array.dtype == dtype and array.flags.c_contiguous and not array.flags.writeable:
        return array
    return read_only(array, dtype)
