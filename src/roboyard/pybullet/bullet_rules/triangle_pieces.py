"""Triangle meshes of bodies that cannot move: one thin convex piece for each triangle.

Bullet collides with the triangles themselves where a file or script asks for them (`concave="yes"`,
GEOM_FORCE_CONCAVE_TRIMESH); MuJoCo knows convex meshes only. Terrain, whose triangles all face up, becomes
upright prisms down to a common floor, which nothing falls through; of other meshes each triangle gets a
thickness below its surface.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import replace

import numpy as np

from roboyard.description.model import Collision, Mesh
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.transforms import Array

MOST_TRIANGLES = 2000
"""Meshes of more stay one convex hull: every piece takes part in each compile of the world."""
THICKNESS, MOST_THICKNESS = 0.02, 0.003
"""Of pieces: as a part of the mesh's diagonal, and at most; m."""
OVERLAP = 1e-4
"""By which pieces are larger than their triangles, so that rays along seams meet one."""
_TOO_THIN = 1e-12
"""m²: twice the area of a triangle that is a line."""
_FACES = np.array(
    [[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]], dtype=np.int32
)
_KEPT = 16
_made: OrderedDict[int, tuple[TriangleMesh, tuple[TriangleMesh, ...]]] = OrderedDict()


def triangle_by_triangle(collisions: tuple[Collision, ...]) -> tuple[Collision, ...]:
    """Shapes of a link that cannot move, those whose triangles are asked for taken apart."""
    if not any(shape.concave for shape in collisions):
        return collisions
    found: list[Collision] = []
    for shape in collisions:
        pieces = _pieces_of(shape.geometry) if shape.concave and isinstance(shape.geometry, Mesh) else ()
        found += [replace(shape, geometry=Mesh(uri="", path=None, data=piece)) for piece in pieces] or [shape]
    return tuple(found)


def _pieces_of(geometry: Mesh) -> tuple[TriangleMesh, ...]:
    """A prism for each triangle of a mesh, in the mesh's own frame; none where there are too many."""
    from roboyard.errors import MeshError
    from roboyard.sim.build.geoms import load_scaled

    try:
        mesh = load_scaled(geometry, 1.0)
    except (MeshError, ValueError):
        return ()
    if mesh is None or not 1 < len(mesh.faces) <= MOST_TRIANGLES:
        return ()
    found = _made.get(id(mesh))
    if found is None or found[0] is not mesh:
        found = _made[id(mesh)] = mesh, _prisms(mesh)
        while len(_made) > _KEPT:
            _made.popitem(last=False)
    return found[1]


def _prisms(mesh: TriangleMesh) -> tuple[TriangleMesh, ...]:
    corners: Array = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    keep = lengths > _TOO_THIN
    corners, normals = corners[keep], normals[keep] / lengths[keep, None]
    middles = corners.mean(axis=1, keepdims=True)
    corners = middles + (1.0 + OVERLAP) * (corners - middles)
    lower, upper = mesh.bounds
    thickness = min(THICKNESS * float(np.linalg.norm(upper - lower)), MOST_THICKNESS)
    if len(corners) and (normals[:, 2] > 0.0).all():
        floor = corners.copy()
        floor[:, :, 2] = lower[2] - max(thickness, THICKNESS * float(np.linalg.norm(upper - lower)))
    else:
        floor = corners - thickness * normals[:, None, :]
    points = np.concatenate([corners, floor], axis=1)
    faces = read_only(_FACES, np.int32)
    return tuple(TriangleMesh(vertices=read_only(prism, np.float64), faces=faces) for prism in points)
