"""Triangles, points and boxes of a description's shapes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Mesh,
    Pose,
    RobotDescription,
    Sphere,
    Visual,
)
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.shapes import primitives
from roboyard.shapes.load import load_mesh, scaled
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.transforms import Array, matrix_from_quaternion, quaternion_from_matrix

Shape = Visual | Collision
ShapeType = TypeVar("ShapeType", Visual, Collision)


def geometry_mesh(geometry: Geometry) -> TriangleMesh | None:
    """Triangles of one shape in its own frame, scale applied; None for planes and terrain (no end) and
    for shapes of no size.

    Raises:
        MeshError: a mesh file cannot be read.
    """
    match geometry:
        case Box(size=size) if min(size) > 0:
            return primitives.box(size[0] / 2, size[1] / 2, size[2] / 2)
        case Sphere(radius=radius) if radius > 0:
            return primitives.sphere(radius)
        case Cylinder(radius=radius, length=length) if min(radius, length) > 0:
            return primitives.cylinder(radius, length)
        case Capsule(radius=radius, length=length) if radius > 0:
            return primitives.capsule(radius, length) if length > 0 else primitives.sphere(radius)
        case Mesh(path=path, scale=scale, data=data):
            if data is None and path is None:
                return None
            mesh = data if data is not None else load_mesh(path or "")
            return scaled(mesh, scale)
        case _:
            return None


def moved_mesh(mesh: TriangleMesh, pose: Pose) -> TriangleMesh:
    """Positions and faces of a mesh in the frame in which its own has `pose`."""
    turn = matrix_from_quaternion(pose.quaternion)
    return TriangleMesh(
        vertices=read_only(mesh.vertices @ turn.T + np.asarray(pose.position), np.float64),
        faces=mesh.faces,
    )


def shape_meshes(shapes: Iterable[Shape]) -> list[TriangleMesh]:
    """Triangles of a link's shapes in the link's frame; endless ones left out."""
    meshes = []
    for shape in shapes:
        mesh = geometry_mesh(shape.geometry)
        if mesh is not None and len(mesh.faces):
            meshes.append(moved_mesh(mesh, shape.origin))
    return meshes


def robot_bounds(
    description: RobotDescription, *, visual: bool = True, collision: bool = True
) -> Array | None:
    """(2, 3) box around the shapes with all joints at zero, in the root link's frame; None without shapes."""
    frames = forward_kinematics(description)
    corners = []
    for link in description.links:
        shapes: list[Shape] = [*link.visuals] if visual else []
        shapes += link.collisions if collision else ()
        frame = frames[link.name]
        for shape in shapes:
            mesh = geometry_mesh(shape.geometry)
            if mesh is None or not len(mesh.faces):
                continue
            to_root = frame @ shape.origin.matrix()
            points = mesh.vertices @ to_root[:3, :3].T + to_root[:3, 3]
            corners += [points.min(axis=0), points.max(axis=0)]
    if not corners:
        return None
    return np.stack([np.min(corners, axis=0), np.max(corners, axis=0)])


def pose_of(matrix: Array) -> Pose:
    """A `Pose` from a (4, 4) rigid transform."""
    x, y, z = (float(value) for value in matrix[:3, 3])
    qx, qy, qz, qw = (float(value) for value in quaternion_from_matrix(matrix[:3, :3]))
    return Pose(position=(x, y, z), quaternion=(qx, qy, qz, qw))


def placed(shapes: Sequence[ShapeType], matrix: Array) -> tuple[ShapeType, ...]:
    """Shapes seen from the frame in which their present frame has the pose `matrix` (4, 4)."""
    return tuple(replace(shape, origin=pose_of(matrix @ shape.origin.matrix())) for shape in shapes)


def shifted(pose: Pose, z: float) -> Pose:
    """The pose moved along z by `z` (m), rotation untouched."""
    px, py, pz = pose.position
    return replace(pose, position=(px, py, pz + z))
