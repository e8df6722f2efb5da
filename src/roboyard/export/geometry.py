"""Colours, normals and parts of triangle meshes, and names of shapes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roboyard.description.model import RGBA, Geometry, Mesh, RobotDescription
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.transforms import Array

DEFAULT_RGBA: RGBA = (0.7, 0.7, 0.7, 1.0)


def faces_by_color(mesh: TriangleMesh) -> list[tuple[RGBA, np.ndarray]]:
    """Return each colour of a mesh with the (k,) indices of its faces, most faces first; empty without
    colours.
    """
    if mesh.colors is None:
        return []
    packed = np.ascontiguousarray(mesh.colors).view(np.uint32).ravel()
    if (packed == packed[0]).all():
        return [(_rgba(mesh.colors[0]), np.arange(len(packed)))]
    colors, first, which = np.unique(packed, return_index=True, return_inverse=True)
    order = np.argsort(-np.bincount(which, minlength=len(colors)), kind="stable")
    return [(_rgba(mesh.colors[first[k]]), np.flatnonzero(which == k)) for k in order]


def _rgba(color: np.ndarray) -> RGBA:
    r, g, b, a = (round(float(v) / 255.0, 6) for v in color)
    return (r, g, b, a)


def face_areas(mesh: TriangleMesh) -> Array:
    """Return the (m,) area of each face (m²)."""
    return np.linalg.norm(_crosses(mesh), axis=1) / 2


def face_normals(mesh: TriangleMesh) -> Array:
    """Return the (m, 3) outward unit normal of each face; +z for faces without area."""
    cross = _crosses(mesh)
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    return np.where(length > 0, cross / np.where(length > 0, length, 1.0), (0.0, 0.0, 1.0))


def _crosses(mesh: TriangleMesh) -> Array:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def submesh(mesh: TriangleMesh, faces: np.ndarray) -> TriangleMesh:
    """Return the part of a mesh with the given (k,) face indices, and only the vertices these use."""
    used, index = np.unique(mesh.faces[faces], return_inverse=True)
    return replace(
        mesh,
        vertices=read_only(mesh.vertices[used], np.float64),
        faces=read_only(index.reshape(-1, 3), np.int32),
        normals=None if mesh.normals is None else read_only(mesh.normals[used], np.float64),
        uv=None if mesh.uv is None else read_only(mesh.uv[used], np.float64),
        colors=None if mesh.colors is None else read_only(mesh.colors[faces], np.uint8),
    )


def stem(visual_name: str | None, geometry: Geometry) -> str:
    """Return a name for a shape: its own, that of its file, or its type."""
    if visual_name:
        return visual_name
    if isinstance(geometry, Mesh):
        path = geometry.path.stem if geometry.path is not None else geometry.uri.rpartition("/")[2]
        return path.rpartition(".")[0] or path or "mesh"
    return type(geometry).__name__.lower()


def zero_poses(description: RobotDescription) -> dict[str, Array]:
    """Return the (4, 4) pose of every link in the root link's frame with all joints at zero, mimic joints
    too.
    """
    from roboyard.kinematics.description_poses import forward_kinematics
    from roboyard.kinematics.joint_models import position_size

    held = {j.name: 0.0 for j in description.joints if j.mimic is not None and position_size(j) == 1}
    return forward_kinematics(description, held)
