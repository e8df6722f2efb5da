"""Inertia and bounds that Bullet computes from the shapes of an MJCF body.

One shape at the inertial frame has its exact formula, anything else is the solid box around all shapes.
Compounds have no margin of their own here, and capsules between two points are the hull of two spheres, whose
box in a compound is 0.04 m larger on each side.
"""

from __future__ import annotations

import numpy as np

from roboyard.description.model import Capsule, Collision, Cylinder, Pose, Sphere
from roboyard.pybullet.bullet_rules.models import BoundsOf, MomentsOf
from roboyard.pybullet.bullet_rules.shape_bounds import (
    TWO_SPHERES_MARGIN,
    LinkBounds,
    is_between_ends,
    link_bounds,
    local_bounds,
)
from roboyard.pybullet.bullet_rules.shape_inertia import Moments, solid_box
from roboyard.pybullet.face import constants as c
from roboyard.transforms import Array, matrix_from_quaternion


def bullet_moments(flags: int) -> MomentsOf:
    """Return the function that computes moments of inertia for loadMJCF with these flags."""
    two_spheres = not flags & c.URDF_USE_IMPLICIT_CYLINDER

    def moments(mass: float, frame: Pose, collisions: tuple[Collision, ...]) -> Moments:
        if mass == 0.0:
            return 0.0, 0.0, 0.0
        found = [s for s in collisions if local_bounds(s.geometry, implicit_cylinder=True) is not None]
        if not found:
            return 0.0, 0.0, 0.0
        if len(found) == 1 and _is_alone(found[0], frame):
            return _own_moments(mass, found[0], frame, two_spheres)
        boxes = [_box(shape, frame, two_spheres, TWO_SPHERES_MARGIN) for shape in found]
        lower = np.min([box[0] for box in boxes], axis=0)
        upper = np.max([box[1] for box in boxes], axis=0)
        return solid_box(mass, (upper - lower) / 2)

    return moments


def bullet_bounds(flags: int) -> BoundsOf:
    """Return the function that computes bounds of shapes for loadMJCF with these flags."""
    two_spheres = not flags & c.URDF_USE_IMPLICIT_CYLINDER

    def bounds(frame: Pose, collisions: tuple[Collision, ...]) -> LinkBounds:
        if not two_spheres or not any(
            isinstance(s.geometry, Capsule) and is_between_ends(s) for s in collisions
        ):
            return link_bounds(frame, collisions, implicit_cylinder=True, from_file=False)
        found = [s for s in collisions if local_bounds(s.geometry, implicit_cylinder=True) is not None]
        boxes = [_box(shape, frame, two_spheres, TWO_SPHERES_MARGIN) for shape in found]
        lower = np.min([box[0] for box in boxes], axis=0)
        upper = np.max([box[1] for box in boxes], axis=0)
        corners = np.stack([lower, upper])
        if len(found) == 1 and _is_alone(found[0], frame):
            return LinkBounds(corners=corners, margin=TWO_SPHERES_MARGIN, kind="solid")
        return LinkBounds(corners=corners, margin=0.0, kind="compound")

    return bounds


def _is_alone(shape: Collision, frame: Pose) -> bool:
    """Whether a shape is given in the inertial frame."""
    if is_between_ends(shape):
        return not np.any(np.asarray(frame.position)) and tuple(frame.quaternion[:3]) == (0.0, 0.0, 0.0)
    return shape.origin.position == frame.position and shape.origin.quaternion == frame.quaternion


def _own_moments(mass: float, shape: Collision, frame: Pose, two_spheres: bool) -> Moments:
    match shape.geometry:
        case Sphere(radius=radius):
            moment = 0.4 * mass * radius**2
            return moment, moment, moment
        case Cylinder(radius=radius, length=length) if not is_between_ends(shape):
            across = mass * (3 * radius**2 + length**2) / 12
            return across, across, mass * radius**2 / 2
        case _:
            box = _box(shape, frame, two_spheres, 0.0)
            return solid_box(mass, (box[1] - box[0]) / 2)


def _box(shape: Collision, frame: Pose, two_spheres: bool, margin: float) -> Array:
    """Return the (2, 3) box around a shape in the inertial frame (m)."""
    back = matrix_from_quaternion(frame.quaternion).T
    turn = back @ matrix_from_quaternion(shape.origin.quaternion)
    place = back @ (np.asarray(shape.origin.position) - np.asarray(frame.position))
    geometry = shape.geometry
    if isinstance(geometry, Capsule) and two_spheres and is_between_ends(shape):
        half = np.abs(turn[:, 2]) * geometry.length / 2 + geometry.radius + margin
        return np.stack([place - half, place + half])
    corners = local_bounds(geometry, implicit_cylinder=True)
    assert corners is not None
    middle, half = place + turn @ corners.mean(axis=0), np.abs(turn) @ (corners[1] - corners[0]) / 2
    return np.stack([middle - half, middle + half])
