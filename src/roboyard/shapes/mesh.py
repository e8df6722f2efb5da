"""Triangles as read-only arrays: what every room that touches a mesh shares."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class TriangleMesh:
    """A triangle mesh in metres. Arrays are C-contiguous and read-only; share, never edit."""

    vertices: NDArray[np.float64]
    """(n, 3) m"""
    faces: NDArray[np.int32]
    """(m, 3) vertex indices, counter-clockwise seen from outside."""
    normals: NDArray[np.float64] | None = None
    """(n, 3) unit vertex normals where the file gives them; None: flat or derived."""
    uv: NDArray[np.float64] | None = None
    """(n, 2) texture coordinates, v up; None where there is no texture."""
    colors: NDArray[np.uint8] | None = None
    """(m, 4) RGBA of each face where the file gives any (materials or vertex colours)."""
    texture: NDArray[np.uint8] | None = None
    """(h, w, 4) RGBA image, row 0 at the top."""

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) lower and upper corner; m."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])


def read_only(array: NDArray, dtype: type) -> NDArray:
    """A C-contiguous copy of `array` that cannot be written."""
    out = np.array(array, dtype=dtype, order="C")
    out.setflags(write=False)
    return out


def shared(array: NDArray, dtype: type) -> NDArray:
    """The array itself where nobody can write it and it is C-contiguous, else such a copy."""
    if array.dtype == dtype and array.flags.c_contiguous and not array.flags.writeable:
        return array
    return read_only(array, dtype)
