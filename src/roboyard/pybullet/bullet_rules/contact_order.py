"""Which of two contacting links Bullet calls A, and along which directions it reports friction.

Bullet orders a pair by the kinds of its shapes: a compound before a single convex shape, both before
triangles, heightfields and planes; of two of a kind, the body created first comes first. A link is a compound
if it has several shapes, or one that is not at its inertial frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

from roboyard.description.model import Collision, Heightfield, Mesh, Plane, Pose
from roboyard.pybullet.bullet_rules.mesh_objects import split_objects
from roboyard.pybullet.bullet_rules.models import LinkModel

SURFACE, CONVEX, COMPOUND = 0, 1, 2
_NEARLY_FLAT = sqrt(0.5)

Vector3 = tuple[float, float, float]


def kind_of(link: LinkModel) -> int:
    """Return SURFACE, CONVEX or COMPOUND for the shapes of a link."""
    shapes = split_objects(link.collisions)
    if len(shapes) != 1:
        return COMPOUND
    shape = shapes[0]
    if isinstance(shape.geometry, Heightfield):  # stored rotated, at its own origin
        return SURFACE
    if not _same_place(shape.origin, link.frame):
        return COMPOUND
    is_surface = isinstance(shape.geometry, Plane) or (shape.concave and isinstance(shape.geometry, Mesh))
    return SURFACE if is_surface else CONVEX


def is_field(shapes: Sequence[Collision]) -> bool:
    """Return whether a link is a single height field, which is no compound although it is stored rotated."""
    return len(shapes) == 1 and isinstance(shapes[0].geometry, Heightfield)


def tangents(normal: Vector3) -> tuple[Vector3, Vector3]:
    """Return two unit directions along a surface with this unit normal, as Bullet chooses them.

    If the normal is close to z, the first is perpendicular to it in the y-z plane; otherwise it is
    horizontal. The second completes a right-handed frame (normal, first, second).
    """
    x, y, z = normal
    if abs(z) > _NEARLY_FLAT:
        squared = y * y + z * z
        scale = 1.0 / sqrt(squared)
        first = (0.0, -z * scale, y * scale)
        return first, (squared * scale, -x * first[2], x * first[1])
    squared = x * x + y * y
    scale = 1.0 / sqrt(squared)
    first = (-y * scale, x * scale, 0.0)
    return first, (-z * first[1], z * first[0], squared * scale)


def _same_place(origin: Pose, frame: Pose) -> bool:
    return tuple(origin.position) == tuple(frame.position) and tuple(origin.quaternion) == tuple(
        frame.quaternion
    )
