"""Concave meshes whose triangles are searched as those of a height field are.

MuJoCo collides convex shapes only. One geom represents all triangles of a mesh: a height field without
heights, as large as the box around the mesh. MuJoCo says which shapes are in that box, and
`roboyard.sim.stepping.manifold_kernels` finds their points. Rays do not hit the geom.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

import numpy as np

from roboyard._records import dataclass
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.triangle_tree import boxes_of
from roboyard.transforms import Array

BASE = 2.0**-20
"""Thickness (m) by which MuJoCo's height fields that represent meshes are known; no terrain has it."""
THINNEST = 1e-6
"""Smallest size of a box (m)."""
_CACHE_SIZE = 16
_fields: OrderedDict[tuple[int, bool], tuple[TriangleMesh, MeshField]] = OrderedDict()


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class MeshField:
    """The triangles of a mesh in the order in which they are searched, under a complete binary tree of boxes.

    Places are relative to `middle`.
    """

    middle: Array
    """(3,) the middle of the mesh's box along x and y, and its least z, in the frame of the mesh (m)."""
    size: Array
    """(3,) size of the box (m)."""
    corners: Array
    """(t, 9) the three corners of each triangle (m)."""
    boxes: Array
    """(2 n - 1, 6) least and largest coordinates (m) of nodes, leaves last; node k has 2k+1 and 2k+2."""
    leaves: np.ndarray
    """(n + 1,) int32 first triangle of each leaf."""


def mesh_field(mesh: TriangleMesh, *, single: bool) -> MeshField:
    """Return the triangles of a mesh that has some; they are cached.

    Args:
        mesh: in its own frame (m).
        single: take its corners in single precision.
    """
    key = id(mesh), single
    found = _fields.get(key)
    if found is None or found[0] is not mesh:
        found = _fields[key] = mesh, _new_field(mesh, single)
        while len(_fields) > _CACHE_SIZE:
            _fields.popitem(last=False)
    return found[1]


def _new_field(mesh: TriangleMesh, single: bool) -> MeshField:
    from roboyard.sim.build.triangle_order import triangle_order

    vertices = mesh.vertices.astype(np.float32) if single else mesh.vertices
    corners = np.asarray(vertices, dtype=float)[mesh.faces]
    corners = corners[triangle_order(corners)]
    least, most = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    middle = np.array([(least[0] + most[0]) / 2, (least[1] + most[1]) / 2, least[2]])
    corners -= middle
    lower, upper, leaves = boxes_of(corners)
    return MeshField(
        middle=middle,
        size=np.maximum(most - least, THINNEST),
        corners=corners.reshape(-1, 9),
        boxes=np.concatenate([lower, upper], axis=1),
        leaves=leaves,
    )


def add_field_asset(spec: Any, name: str, field: MeshField) -> None:
    """Add the height field that represents a mesh to a spec."""
    asset = spec.add_hfield(name=name, nrow=2, ncol=2)
    asset.size = [field.size[0] / 2, field.size[1] / 2, field.size[2], BASE]
    asset.userdata = np.zeros(4, np.float32)
