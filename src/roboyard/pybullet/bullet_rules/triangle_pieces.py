"""Triangle meshes of fixed bodies: one thin convex piece for each triangle.

Bullet collides with the triangles themselves if a file or script requests it (`concave="yes"`,
GEOM_FORCE_CONCAVE_TRIMESH); MuJoCo supports convex meshes only. Terrain, whose triangles all face up, becomes
vertical prisms down to a common floor, so that bodies cannot fall through; in other meshes each triangle gets
a thickness below its surface.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import replace

import numpy as np

from roboyard.description.model import Collision, Mesh
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.transforms import Array

MAX_TRIANGLES = 2000
"""Meshes with more triangles stay one convex hull: every piece slows down each compile of the world."""
THICKNESS, MAX_THICKNESS = 0.02, 0.003
"""Thickness of pieces, as a fraction of the mesh's diagonal, and its upper limit (m)."""
OVERLAP = 1e-4
"""Relative enlargement of pieces, so that rays along seams hit one."""
_MIN_DOUBLE_AREA = 1e-12
"""Twice the area of the smallest triangle that is kept (m²)."""
_FACES = np.array(
    [[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]], dtype=np.int32
)
_CACHE_SIZE = 16
_made: OrderedDict[int, tuple[TriangleMesh, tuple[TriangleMesh, ...]]] = OrderedDict()


def split_triangles(collisions: tuple[Collision, ...]) -> tuple[Collision, ...]:
    """Return the shapes of a fixed link, with concave meshes split into one piece per triangle."""
    if not any(shape.concave for shape in collisions):
        return collisions
    found: list[Collision] = []
    for shape in collisions:
        pieces = _pieces_of(shape.geometry) if shape.concave and isinstance(shape.geometry, Mesh) else ()
        found += [replace(shape, geometry=Mesh(uri="", path=None, data=piece)) for piece in pieces] or [shape]
    return tuple(found)


def _pieces_of(geometry: Mesh) -> tuple[TriangleMesh, ...]:
    """Return a prism for each triangle of a mesh, in the mesh's frame; none if there are too many."""
    from roboyard.errors import MeshError
    from roboyard.sim.build.geoms import load_scaled

    try:
        mesh = load_scaled(geometry, 1.0)
    except (MeshError, ValueError):
        return ()
    if mesh is None or not 1 < len(mesh.faces) <= MAX_TRIANGLES:
        return ()
    found = _made.get(id(mesh))
    if found is None or found[0] is not mesh:
        found = _made[id(mesh)] = mesh, _prisms(mesh)
        while len(_made) > _CACHE_SIZE:
            _made.popitem(last=False)
    return found[1]


def _prisms(mesh: TriangleMesh) -> tuple[TriangleMesh, ...]:
    corners: Array = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    keep = lengths > _MIN_DOUBLE_AREA
    corners, normals = corners[keep], normals[keep] / lengths[keep, None]
    middles = corners.mean(axis=1, keepdims=True)
    corners = middles + (1.0 + OVERLAP) * (corners - middles)
    lower, upper = mesh.bounds
    thickness = min(THICKNESS * float(np.linalg.norm(upper - lower)), MAX_THICKNESS)
    if len(corners) and (normals[:, 2] > 0.0).all():
        floor = corners.copy()
        floor[:, :, 2] = lower[2] - max(thickness, THICKNESS * float(np.linalg.norm(upper - lower)))
    else:
        floor = corners - thickness * normals[:, None, :]
    points = np.concatenate([corners, floor], axis=1)
    faces = read_only(_FACES, np.int32)
    return tuple(TriangleMesh(vertices=read_only(prism, np.float64), faces=faces) for prism in points)
