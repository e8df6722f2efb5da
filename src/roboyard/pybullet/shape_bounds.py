"""Boxes around collision shapes as Bullet computes them, from which it takes inertias.

A hull's box grows by its margin when it is made and again when it is asked for; a compound adds its own.
Boxes, balls, cylinders and capsules carry their margin inside their dimensions.
"""

from __future__ import annotations

import numpy as np

from roboyard.poses import Array, matrix_from_quaternion
from roboyard.urdf.model import Box, Capsule, Collision, Cylinder, Geometry, Mesh, Sphere

MARGIN = 0.001
"""m: of every shape that comes from a file."""


def local_bounds(geometry: Geometry, *, implicit_cylinder: bool) -> Array | None:
    """(2, 3) corners of the box around a shape in its own frame; m. None where the shape has none."""
    match geometry:
        case Box(size=size):
            half = np.asarray(size) / 2
        case Sphere(radius=radius):
            half = np.full(3, radius)
        case Cylinder(radius=radius, length=length):
            half = np.array([radius, radius, length / 2]) + (0.0 if implicit_cylinder else 2 * MARGIN)
        case Capsule(radius=radius, length=length):
            half = np.array([radius, radius, length / 2 + radius])
        case Mesh():
            corners = _mesh_bounds(geometry)
            return None if corners is None else corners + 2 * MARGIN * np.array([[-1.0], [1.0]])
        case _:
            return None
    return np.stack([-half, half])


def _mesh_bounds(mesh: Mesh) -> Array | None:
    from roboyard.sim.geoms import load_scaled

    triangles = load_scaled(mesh, 1.0)
    if triangles is None or not len(triangles.vertices):
        return None
    return np.stack([triangles.vertices.min(axis=0), triangles.vertices.max(axis=0)]).astype(float)


def bounds_in(frame_position: Array, frame_rotation: Array, shapes: list[tuple[Collision, Array]]) -> Array:
    """(2, 3) box in a frame of the link around shapes with their local bounds; m."""
    lower, upper = np.full(3, np.inf), np.full(3, -np.inf)
    for shape, corners in shapes:
        turn = frame_rotation.T @ matrix_from_quaternion(shape.origin.quaternion)
        place = frame_rotation.T @ (np.asarray(shape.origin.position) - frame_position)
        middle = place + turn @ (corners[0] + corners[1]) / 2
        half = np.abs(turn) @ (corners[1] - corners[0]) / 2
        lower, upper = np.minimum(lower, middle - half), np.maximum(upper, middle + half)
    return np.stack([lower, upper])
