"""Boxes around a link's collision shapes as Bullet computes them: what getAABB says and inertias come from.

A hull's box grows by its margin when it is made and again when it is asked for. Several shapes, or one that
is not at the inertial frame, are a compound: a box around their boxes, which grows by a margin of its own and
turns as a whole. Boxes, balls, cylinders and capsules carry their margin inside their dimensions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Heightfield,
    Mesh,
    Plane,
    Pose,
    Sphere,
)
from roboyard.pybullet.bullet_rules.mesh_objects import objects_of
from roboyard.transforms import Array, matrix_from_quaternion

MARGIN = 0.001
"""m: of every shape but balls and capsules, whose margin is their radius."""
BEYOND = 1e30
"""m: half size of the box around a plane."""
_UNTURNED = np.eye(3)
Shape = tuple[Collision, Array]
"""A collision and the (2, 3) corners of its box in its own frame; m."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class LinkBounds:
    """The box around all of a link's shapes."""

    corners: Array
    """(2, 3) in the link's inertial frame; m. Without the margin by which hulls and compounds grow."""
    margin: float
    """Of the shape that holds the others; m."""
    kind: Literal["ball", "cylinder", "solid", "hull", "compound", "plane"]
    is_round: bool = False
    """Whether the margin is a radius, which nothing changes."""

    def grown(self, margin: float) -> Array:
        """(2, 3) corners with the margin (m) of a hull or compound."""
        if self.kind in ("hull", "compound"):
            return self.corners + margin * np.array([[-1.0], [1.0]])
        return self.corners

    def in_world(self, margin: float, position: Array, quaternion: Array) -> Array:
        """(2, 3) corners in the world, for a pose of the inertial frame; m."""
        lower, upper = self.grown(margin)
        if self.kind == "plane":
            return self.corners
        if self.kind == "ball":
            return np.stack([position + lower, position + upper])
        rotation = matrix_from_quaternion(quaternion)
        middle = position + rotation @ ((lower + upper) / 2)
        half = np.abs(rotation) @ ((upper - lower) / 2)
        return np.stack([middle - half, middle + half])


def link_bounds(
    frame: Pose, collisions: tuple[Collision, ...], *, implicit_cylinder: bool, from_file: bool
) -> LinkBounds:
    """Bounds of the shapes of a link whose inertial frame is `frame`.

    Args:
        frame: in the link frame.
        collisions: the link's shapes.
        implicit_cylinder: cylinders are cylinders instead of hulls.
        from_file: compounds of files have a margin, and each OBJ file of theirs is a compound within.
    """
    compound_margin = MARGIN if from_file else 0.0
    shapes: list[Shape] = []
    alone: Collision | None = None
    position = np.asarray(frame.position, dtype=float)
    rotation = matrix_from_quaternion(frame.quaternion)
    for shape in collisions:
        parts = _boxes(shape, implicit_cylinder=implicit_cylinder)
        if not parts:
            continue
        is_compound = from_file and _is_obj(shape)
        alone = None if shapes or len(parts) > 1 or is_compound else shape
        if is_compound:  # within the link's, unless it is all there is, right at the inertial frame
            margin = 0.0 if len(collisions) == 1 and _is_at(shape, position, rotation) else MARGIN
            lower, upper = np.min(parts, axis=0)[0], np.max(parts, axis=0)[1]
            parts = [np.stack([lower - margin, upper + margin])]
        shapes += [(shape, box) for box in parts]
    if not shapes:
        return LinkBounds(corners=np.zeros((2, 3)), margin=compound_margin, kind="compound")
    if alone is not None and _is_at(alone, position, rotation):
        return _bounds_of_one(*shapes[0], implicit_cylinder=implicit_cylinder)
    box = bounds_in(position, rotation, shapes)
    return LinkBounds(corners=box, margin=compound_margin, kind="compound")


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
    return np.array([-half, half])


def bounds_in(frame_position: Array, frame_rotation: Array, shapes: list[Shape]) -> Array:
    """(2, 3) box in a frame of the link around shapes with their local bounds; m."""
    boxes = np.array(
        [
            turned_box(
                shape.geometry,
                corners,
                frame_rotation.T @ (np.asarray(shape.origin.position) - frame_position),
                frame_rotation.T @ matrix_from_quaternion(shape.origin.quaternion),
            )
            for shape, corners in shapes
        ]
    )
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def turned_box(geometry: Geometry, corners: Array, place: Array, turn: Array) -> Array:
    """(2, 3) box around a shape's local box at a place (m) and (3, 3) rotation; a ball's does not turn."""
    half = (corners[1] - corners[0]) / 2
    middle = place + turn @ (corners[0] + corners[1]) / 2
    if not isinstance(geometry, Sphere):
        half = np.abs(turn) @ half
    return np.stack([middle - half, middle + half])


def _boxes(shape: Collision, *, implicit_cylinder: bool) -> list[Array]:
    """Local boxes of a shape, one for each hull that Bullet makes of it."""
    geometry = shape.geometry
    if isinstance(geometry, Plane):
        return [BEYOND * np.array([[-1.0] * 3, [1.0] * 3])]
    if isinstance(geometry, Heightfield):
        (nx, ny), heights = geometry.heights.shape, geometry.heights
        x, y = (nx - 1) * geometry.cell[0] / 2, (ny - 1) * geometry.cell[1] / 2
        return [np.array([[-x, -y, heights.min()], [x, y, heights.max()]], dtype=float)]
    if shape.concave and isinstance(geometry, Mesh):
        corners = _mesh_bounds(geometry)
        return [] if corners is None else [corners]
    found = (local_bounds(part, implicit_cylinder=implicit_cylinder) for part in objects_of(geometry))
    return [box for box in found if box is not None]


def _bounds_of_one(shape: Collision, corners: Array, *, implicit_cylinder: bool) -> LinkBounds:
    match shape.geometry:
        case Sphere(radius=radius):
            return LinkBounds(corners=corners, margin=radius, kind="ball", is_round=True)
        case Capsule(radius=radius):
            return LinkBounds(corners=corners, margin=radius, kind="solid", is_round=True)
        case Plane():
            return LinkBounds(corners=corners, margin=MARGIN, kind="plane")
        case Cylinder() if implicit_cylinder:
            return LinkBounds(corners=corners, margin=MARGIN, kind="cylinder")
        case Cylinder():
            pass
        case Mesh() if not shape.concave:
            pass
        case _:
            return LinkBounds(corners=corners, margin=MARGIN, kind="solid")
    return LinkBounds(corners=corners + MARGIN * np.array([[1.0], [-1.0]]), margin=MARGIN, kind="hull")


def _is_obj(shape: Collision) -> bool:
    mesh = shape.geometry
    if not isinstance(mesh, Mesh) or mesh.path is None or shape.concave:
        return False
    return mesh.path.suffix.lower() == ".obj"


def _is_at(shape: Collision, position: Array, rotation: Array) -> bool:
    """Whether the shape's frame, worked out in floating point, is the inertial frame to the last bit."""
    if shape.origin.position != tuple(position.tolist()):
        return False
    turn = rotation.T @ matrix_from_quaternion(shape.origin.quaternion)
    return bool((turn == _UNTURNED).all())


def _mesh_bounds(mesh: Mesh) -> Array | None:
    from roboyard.sim.build.geoms import load_scaled

    triangles = load_scaled(mesh, 1.0)
    if triangles is None or not len(triangles.vertices):
        return None
    return np.stack([triangles.vertices.min(axis=0), triangles.vertices.max(axis=0)]).astype(float)
