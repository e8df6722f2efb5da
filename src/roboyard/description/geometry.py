"""Triangles of a description's shapes, and poses from matrices."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Mesh,
    Pose,
    Sphere,
    Vector3,
    Visual,
)
from roboyard.shapes import primitives
from roboyard.shapes.load import load_mesh, scaled
from roboyard.shapes.mesh import TriangleMesh, read_only, shared
from roboyard.transforms import Array, matrix_from_quaternion, quaternion_from_matrix

UNMOVED = Pose()


def geometry_mesh(geometry: Geometry) -> TriangleMesh | None:
    """Return the triangles of a geometry in its own frame, scale applied (m).

    None for planes and terrain (infinite), for primitives of size zero, and for meshes whose file was not
    found.

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
            if data is None:
                if path is None:
                    return None
                data = load_mesh(path)
            return scaled(data, scale)
        case _:
            return None


def shape_meshes(shapes: Iterable[Visual | Collision]) -> list[TriangleMesh]:
    """Return the triangles of a link's shapes in the link's frame (m); infinite shapes are skipped.

    Raises:
        MeshError: a mesh file cannot be read.
    """
    meshes = []
    for shape in shapes:
        mesh = geometry_mesh(shape.geometry)
        if mesh is not None and len(mesh.faces):
            meshes.append(transformed_mesh(mesh, shape.origin))
    return meshes


def transformed_mesh(mesh: TriangleMesh, pose: Pose) -> TriangleMesh:
    """Return positions and faces of a mesh in the frame in which the mesh's own frame has `pose`."""
    if pose.position == UNMOVED.position and pose.quaternion == UNMOVED.quaternion:
        return TriangleMesh(vertices=shared(mesh.vertices, np.float64), faces=mesh.faces)
    rotation = matrix_from_quaternion(pose.quaternion)
    return TriangleMesh(
        vertices=read_only(mesh.vertices @ rotation.T + np.asarray(pose.position), np.float64),
        faces=mesh.faces,
    )


def pose_from_matrix(matrix: Array) -> Pose:
    """Return the `Pose` of a (4, 4) rigid transform (m)."""
    x, y, z = (float(value) for value in matrix[:3, 3])
    qx, qy, qz, qw = (float(value) for value in quaternion_from_matrix(matrix[:3, :3]))
    return Pose(position=(x, y, z), quaternion=(qx, qy, qz, qw))


def capsule_like(radii: Vector3) -> tuple[Capsule | Sphere, Array]:
    """Return the capsule along an ellipsoid's longest axis, with the mean of the other two radii.

    Args:
        radii: along x, y and z (m).

    Returns:
        The capsule, or the sphere where all radii are alike, and its (4, 4) pose in the ellipsoid's frame.
    """
    longest = int(np.argmax(radii))
    others = [radius for k, radius in enumerate(radii) if k != longest]
    radius = min(sum(others) / 2, radii[longest])
    turn = np.eye(4)
    turn[:3, :3] = np.roll(np.eye(3), 2 - longest, axis=1)  # z of the capsule along the longest axis
    length = 2 * (radii[longest] - radius)
    return (Capsule(radius=radius, length=length) if length > 1e-9 else Sphere(radius=radius)), turn
