"""Inertia as Bullet takes it from collision shapes, whatever the file says.

One shape at the inertial frame has its own formula; anything else counts as the solid box around it.
"""

from __future__ import annotations

import numpy as np

from roboyard.poses import Array, matrix_from_quaternion
from roboyard.pybullet.shape_bounds import MARGIN, bounds_in, local_bounds
from roboyard.urdf.model import Box, Capsule, Collision, Cylinder, Pose, Sphere

Moments = tuple[float, float, float]


def shape_moments(
    mass: float,
    frame: Pose,
    collisions: tuple[Collision, ...],
    *,
    margin: float = MARGIN,
    implicit_cylinder: bool,
) -> Moments:
    """Moments (kg m²) about the axes of an inertial frame, for a mass (kg).

    Args:
        mass: kg.
        frame: inertial frame in the link frame.
        collisions: the link's shapes.
        margin: of the compound that holds them; m.
        implicit_cylinder: cylinders are cylinders instead of hulls.
    """
    if mass == 0.0:
        return 0.0, 0.0, 0.0
    found = [
        (shape, local_bounds(shape.geometry, implicit_cylinder=implicit_cylinder)) for shape in collisions
    ]
    shapes = [(shape, corners) for shape, corners in found if corners is not None]
    if not shapes:
        return _solid_box(mass, np.full(3, margin))
    rotation = matrix_from_quaternion(frame.quaternion)
    position = np.asarray(frame.position, dtype=float)
    if len(shapes) == 1 and _is_at(shapes[0][0], position, rotation):
        return _own_moments(mass, shapes[0][0], shapes[0][1], margin, implicit_cylinder)
    box = bounds_in(position, rotation, shapes)
    return _solid_box(mass, (box[1] - box[0]) / 2 + margin)


def _is_at(shape: Collision, position: Array, rotation: Array) -> bool:
    """Whether the shape's frame, worked out in floating point, is the inertial frame to the last bit."""
    turn = rotation.T @ matrix_from_quaternion(shape.origin.quaternion)
    return bool(
        np.array_equal(np.asarray(shape.origin.position), position) and np.array_equal(turn, np.eye(3))
    )


def _own_moments(
    mass: float, shape: Collision, corners: Array, margin: float, implicit_cylinder: bool
) -> Moments:
    half = (corners[1] - corners[0]) / 2
    match shape.geometry:
        case Sphere(radius=radius):
            moment = 0.4 * mass * radius * radius
            return moment, moment, moment
        case Box() | Capsule():
            return _solid_box(mass, half)
        case Cylinder() if implicit_cylinder:
            return _solid_box(mass, half)
        case _:
            return _solid_box(mass, half + margin)


def _solid_box(mass: float, half: Array) -> Moments:
    x, y, z = (4.0 * float(h) ** 2 for h in half)
    k = mass / 12.0
    return k * (y + z), k * (x + z), k * (x + y)
