"""Boxes around shapes, across whose gaps Bullet does not look, and the hulls of meshes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache

import numpy as np

from roboyard._records import dataclass
from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Heightfield,
    Mesh,
    Pose,
    Sphere,
)
from roboyard.pybullet.bullet_rules.shape_bounds import (
    TWO_SPHERES_MARGIN,
    LinkBounds,
    field_bounds,
    is_between_ends,
    local_bounds,
)
from roboyard.sim.physics_profile import BULLET
from roboyard.transforms import Array, matrix_from_quaternion

ENDLESS = 1e9
"""Half size (m) of the boxes of other shapes."""
NO_HULL = np.zeros((0, 3))
ENDLESS_BOX = np.concatenate([np.zeros((1, 3)), ENDLESS * np.eye(3)])
"""(4, 3) box of a shape that is not known."""
EVERYWHERE = 1e18
"""Half size (m) of Bullet's box around a plane."""
ENDLESS_COVER = np.concatenate([np.zeros((4, 3)), np.full((1, 3), EVERYWHERE)])
"""(5, 3) box around a plane, and around a link or shape that is not known."""


@dataclass(frozen=True, slots=True, eq=False)
class ShapeBoxes:
    """Boxes around all shapes of one body."""

    boxes: np.ndarray
    """(n, 4, 3) middle and three half axes of each box in the frame of its link (m)."""
    parts: np.ndarray
    """(n, 5, 3) boxes around them as parts of compounds; see `ShapeForms`."""
    edges: np.ndarray
    """(n,) largest radius of the edges (m), 0 where a shape has none or its box is endless."""
    hulls: tuple[np.ndarray, ...]
    """Corners (m, 3) of each shape's hull in the frame of its link (m), none where it is no hull."""
    counts: tuple[int, ...]
    """Number of shapes of each link."""


def cover_of(bounds: LinkBounds, margin: float, frame: Pose) -> Array:
    """Return the (5, 3) box around all shapes of a link, as `ShapeForms` has it.

    Args:
        bounds: of the link.
        margin: of its shape, or its compound (m).
        frame: inertial frame in the link frame.
    """
    lower, upper = bounds.corners
    if bounds.kind == "plane" or not np.all(np.abs([lower, upper]) < ENDLESS):
        return ENDLESS_COVER
    turn, cover = matrix_from_quaternion(frame.quaternion), np.zeros((5, 3))
    cover[0] = np.asarray(frame.position) + turn @ (lower + upper) / 2
    half = (upper - lower) / 2  # in Bullet's order, so that boxes that touch do so to the last bit
    if bounds.grows:
        half = half + margin
    if bounds.kind == "sphere":
        cover[4] = half
    else:
        cover[1:4] = half[:, None] * turn.T
    return cover


def body_boxes(
    links: Iterable[Sequence[Collision]], *, implicit_cylinder: bool, two_spheres: bool
) -> ShapeBoxes:
    """Return the boxes of a body.

    Args:
        links: the shapes of each link.
        implicit_cylinder: whether cylinders are exact.
        two_spheres: whether capsules between two points are the hull of two spheres.
    """
    boxes, parts, edges, counts, hulls = [], [], [], [], []
    for shapes in links:
        counts.append(len(shapes))
        for shape in shapes:
            box, edge = _box_of(shape, implicit_cylinder)
            boxes.append(box)
            parts.append(_part_of(shape, box, two_spheres))
            edges.append(edge)
            hulls.append(_hull_of(shape))
    return ShapeBoxes(
        np.array(boxes).reshape(-1, 4, 3),
        np.array(parts).reshape(-1, 5, 3),
        np.array(edges),
        tuple(hulls),
        tuple(counts),
    )


def _part_of(shape: Collision, box: np.ndarray, two_spheres: bool) -> np.ndarray:
    """Return the (5, 3) box around a shape as the part of a compound; box: (4, 3) the usual one."""
    part = np.zeros((5, 3))
    match shape.geometry:
        case Sphere(radius=radius) if not shape.concave:
            part[0], part[4] = box[0], radius
        case Capsule(radius=radius, length=length) if two_spheres and is_between_ends(shape):
            along = matrix_from_quaternion(shape.origin.quaternion)[:, 2]
            part[0] = box[0]
            part[1:4] = np.diag(np.abs(along) * length / 2 + radius + TWO_SPHERES_MARGIN)
        case _:
            part[:4] = box
    return part


def _hull_of(shape: Collision) -> np.ndarray:
    """Return the (n, 3) corners of a shape's hull in the frame of its link (m), none where it is no hull."""
    from roboyard.sim.build.geoms import is_single, load_scaled
    from roboyard.sim.build.mesh_assets import convex_hull

    if shape.concave or not isinstance(shape.geometry, Mesh):
        return NO_HULL
    mesh = load_scaled(shape.geometry, 1.0)
    if mesh is None or not len(mesh.faces):
        return NO_HULL
    corners = convex_hull(mesh, BULLET.hull_steps, single=is_single(shape.geometry, 1.0))[0]
    turn = matrix_from_quaternion(shape.origin.quaternion)
    return corners @ turn.T + np.asarray(shape.origin.position)


def _box_of(shape: Collision, implicit_cylinder: bool) -> tuple[np.ndarray, float]:
    """Return the (4, 3) box around a shape and the largest radius of its edges (m), 0 where it has none."""
    if isinstance(shape.geometry, Box | Cylinder | Sphere) and not shape.concave:
        return _plain_box(shape.geometry, shape.origin, implicit_cylinder)
    return _new_box(shape, implicit_cylinder)


@lru_cache(maxsize=512)
def _plain_box(geometry: Geometry, origin: Pose, implicit_cylinder: bool) -> tuple[np.ndarray, float]:
    box, edge = _new_box(Collision(geometry=geometry, origin=origin), implicit_cylinder)
    box.flags.writeable = False
    return box, edge


def _new_box(shape: Collision, implicit_cylinder: bool) -> tuple[np.ndarray, float]:
    """Return the (4, 3) box around a shape and the largest radius of its edges (m), 0 where it has none."""
    if shape.concave or isinstance(shape.geometry, Heightfield):
        corners = field_bounds(shape)
    else:
        corners = local_bounds(shape.geometry, implicit_cylinder=implicit_cylinder)
    if corners is None:
        return ENDLESS_BOX, 0.0
    turn, box = matrix_from_quaternion(shape.origin.quaternion), np.empty((4, 3))
    box[0] = np.asarray(shape.origin.position) + turn @ (corners[0] + corners[1]) / 2
    box[1:] = ((corners[1] - corners[0]) / 2)[:, None] * turn.T
    has_edges = isinstance(shape.geometry, Box | Cylinder)
    return box, float((corners[1] - corners[0]).min() / 2) if has_edges else 0.0
