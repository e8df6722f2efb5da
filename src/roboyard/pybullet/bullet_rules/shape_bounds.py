"""Boxes around a link's collision shapes as Bullet computes them, for getAABB and inertias.

A hull's box grows by its margin when it is created and again when it is read. Several shapes, or one that is
not at the inertial frame, are a compound: a box around their boxes, which grows by a margin of its own and
rotates as a whole. Boxes, spheres, cylinders and capsules include their margin in their dimensions. Hulls of
robot files have boxes around their corners as these are after rounding, unless they are of OBJ files.
"""

from __future__ import annotations

from functools import lru_cache
from math import cos, sin, sqrt
from typing import Any, Literal

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
    Plane,
    Pose,
    Sphere,
    Visual,
)
from roboyard.pybullet.bullet_rules.mesh_objects import is_obj, split_geometry
from roboyard.sim.physics_profile import BULLET
from roboyard.transforms import Array, matrix_from_quaternion

MARGIN = 0.001
"""Margin (m) of shapes but spheres and capsules, whose margin is their radius, and triangles of files."""
BETWEEN_ENDS = "fromto"
"""Attribute of capsules that MJCF files give by two points; Bullet makes them of two spheres."""
TWO_SPHERES_MARGIN = 0.04
"""Bullet's margin of convex shapes without one of their own (m)."""
PLANE_HALF_SIZE = 1e30
"""Half size of the box around a plane (m)."""
_PRIMITIVES = (Box, Sphere, Cylinder, Capsule)
Triple = tuple[float, float, float]
Shape = tuple[Collision, Array]
"""A collision shape and the (2, 3) corners of its box in its own frame (m)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class LinkBounds:
    """The box around all of a link's shapes."""

    corners: Array
    """(2, 3) corners in the link's inertial frame (m), without the margin of those that grow."""
    margin: float
    """Margin of the shape, or of the compound (m)."""
    kind: Literal["sphere", "cylinder", "solid", "hull", "compound", "plane", "triangles"]
    """Kind of the shape, or of the compound."""
    is_round: bool = False
    """Whether the margin is a radius, which scripts cannot change."""

    def grown(self, margin: float) -> Array:
        """Return (2, 3) corners with the margin of a hull, of triangles or of a compound (m)."""
        return self.corners + margin * np.array([[-1.0], [1.0]]) if self.grows else self.corners

    @property
    def grows(self) -> bool:
        """Whether the corners are those of a hull, of triangles or of a compound, without their margin."""
        return self.kind in ("hull", "compound", "triangles")


_KNOWN = 256
_known: dict[Any, tuple[tuple[Collision, ...], LinkBounds]] = {}
"""Bounds of shapes without files, by the id of the shapes, which are kept, and the other arguments.

A description is kept from one loading of its file to the next, and so are its shapes.
"""


def link_bounds(
    frame: Pose, collisions: tuple[Collision, ...], *, implicit_cylinder: bool, from_file: bool
) -> LinkBounds:
    """Return the bounds of a link's shapes.

    Args:
        frame: inertial frame in the link frame.
        collisions: the link's shapes.
        implicit_cylinder: whether cylinders are exact instead of hulls.
        from_file: whether compounds have a margin and each OBJ file is a compound of its own, as in files.
    """
    key = id(collisions), frame.position, frame.quaternion, implicit_cylinder, from_file
    known = _known.get(key)
    if known is not None:
        return known[1]
    bounds = _link_bounds(frame, collisions, implicit_cylinder=implicit_cylinder, from_file=from_file)
    if not any(isinstance(shape.geometry, Mesh | Heightfield) for shape in collisions):
        bounds.corners.setflags(write=False)
        _known[key] = collisions, bounds
        while len(_known) > _KNOWN:
            del _known[next(iter(_known))]
    return bounds


def _link_bounds(
    frame: Pose, collisions: tuple[Collision, ...], *, implicit_cylinder: bool, from_file: bool
) -> LinkBounds:
    if len(collisions) == 1 and isinstance(collisions[0].geometry, _PRIMITIVES):
        only = collisions[0]
        corners = local_bounds(only.geometry, implicit_cylinder=implicit_cylinder)
        if corners is not None and is_at(only, frame):
            return _bounds_of_one(only, corners, implicit_cylinder=implicit_cylinder)
    compound_margin = MARGIN if from_file else 0.0
    shapes: list[Shape] = []
    alone: Collision | None = None
    position = np.asarray(frame.position, dtype=float)
    rotation = matrix_from_quaternion(frame.quaternion)
    for shape in collisions:
        parts = _boxes(shape, implicit_cylinder=implicit_cylinder, from_file=from_file)
        if not parts:
            continue
        is_compound = from_file and is_obj(shape)
        alone = None if shapes or len(parts) > 1 or is_compound else shape
        if is_compound:  # nested in the link's, unless it is the only shape, at the inertial frame
            margin = 0.0 if len(collisions) == 1 and is_at(shape, frame) else MARGIN
            lower, upper = np.min(parts, axis=0)[0], np.max(parts, axis=0)[1]
            parts = [np.stack([lower - margin, upper + margin])]
        shapes += [(shape, box) for box in parts]
    if not shapes:
        return LinkBounds(corners=np.zeros((2, 3)), margin=compound_margin, kind="compound")
    if alone is not None and is_at(alone, frame):
        return _bounds_of_one(*shapes[0], implicit_cylinder=implicit_cylinder)
    box = bounds_in(position, rotation, shapes)
    return LinkBounds(corners=box, margin=compound_margin, kind="compound")


def local_bounds(geometry: Geometry, *, implicit_cylinder: bool, is_rounded: bool = False) -> Array | None:
    """Return (2, 3) corners of the box around a shape in its own frame (m), or None if there is none.

    Args:
        geometry: the shape.
        implicit_cylinder: whether cylinders are exact instead of hulls.
        is_rounded: whether a mesh has the corners of its hull, which are rounded.
    """
    match geometry:
        case Box(size=(x, y, z)):
            x, y, z = (size / 2 - MARGIN + MARGIN for size in (x, y, z))  # as Bullet adds it again
            return np.array([[-x, -y, -z], [x, y, z]])
        case Sphere(radius=radius):
            half = np.full(3, radius)
        case Cylinder(radius=radius, length=length):
            half = np.array([radius, radius, length / 2]) + (0.0 if implicit_cylinder else 2 * MARGIN)
        case Capsule(radius=radius, length=length):
            half = np.array([radius, radius, length / 2 + radius])
        case Mesh():
            corners = _mesh_bounds(geometry, is_rounded=is_rounded)
            return None if corners is None else corners + 2 * MARGIN * np.array([[-1.0], [1.0]])
        case _:
            return None
    return np.array([-half, half])


def is_between_ends(shape: Collision | Visual) -> bool:
    """Return whether an MJCF file gives a shape by two points."""
    return any(key == BETWEEN_ENDS for key, _ in shape.attributes)


def bounds_in(frame_position: Array, frame_rotation: Array, shapes: list[Shape]) -> Array:
    """Return the (2, 3) box (m) around shapes in a frame of the link, (3,) position and (3, 3) rotation."""
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
    """Return the (2, 3) box (m) around a local box at a (3,) position and (3, 3) rotation."""
    half = (corners[1] - corners[0]) / 2
    middle = place + turn @ (corners[0] + corners[1]) / 2
    if not isinstance(geometry, Sphere):
        half = np.abs(turn) @ half
    return np.stack([middle - half, middle + half])


def _boxes(shape: Collision, *, implicit_cylinder: bool, from_file: bool) -> list[Array]:
    """Return local boxes of a shape, one for each hull that Bullet makes of it."""
    geometry = shape.geometry
    if isinstance(geometry, Plane):
        return [PLANE_HALF_SIZE * np.array([[-1.0] * 3, [1.0] * 3])]
    if isinstance(geometry, Heightfield) or (shape.concave and isinstance(geometry, Mesh)):
        corners = field_bounds(shape)
        return [] if corners is None else [corners]
    if from_file and isinstance(geometry, Mesh) and not is_obj(shape):
        box = local_bounds(geometry, implicit_cylinder=implicit_cylinder, is_rounded=True)
        return [] if box is None else [box]
    found = (local_bounds(part, implicit_cylinder=implicit_cylinder) for part in split_geometry(geometry))
    return [box for box in found if box is not None]


def field_bounds(shape: Collision) -> Array | None:
    """Return (2, 3) corners of the box around terrain or a concave mesh in its own frame (m), else None."""
    geometry = shape.geometry
    if isinstance(geometry, Heightfield):
        (nx, ny), heights = geometry.heights.shape, geometry.heights
        x, y = (nx - 1) * geometry.cell[0] / 2, (ny - 1) * geometry.cell[1] / 2
        return np.array([[-x, -y, heights.min()], [x, y, heights.max()]], dtype=float)
    return _mesh_bounds(geometry) if isinstance(geometry, Mesh) else None


def _bounds_of_one(shape: Collision, corners: Array, *, implicit_cylinder: bool) -> LinkBounds:
    match shape.geometry:
        case Sphere(radius=radius):
            return LinkBounds(corners=corners, margin=radius, kind="sphere", is_round=True)
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
        case Mesh(path=path):
            return LinkBounds(corners=corners, margin=MARGIN if path is None else 0.0, kind="triangles")
        case _:
            return LinkBounds(corners=corners, margin=MARGIN, kind="solid")
    return LinkBounds(corners=corners + MARGIN * np.array([[1.0], [-1.0]]), margin=MARGIN, kind="hull")


def is_at(shape: Collision, frame: Pose) -> bool:
    """Return whether Bullet finds a shape at an inertial frame: their relative pose is the identity.

    It compares with every bit, so that of two equal poses that are turned, rounding decides.
    """
    origin = shape.origin
    if tuple(origin.position) != tuple(frame.position):
        return False
    if tuple(origin.quaternion) != tuple(frame.quaternion):
        return False
    return _is_undone_exactly(_quaternion_of_file(origin))


def _quaternion_of_file(pose: Pose) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) that Bullet makes of the angles in a file, to the last bit."""
    if pose.rpy is None:
        x, y, z, w = pose.quaternion
        return x, y, z, w
    (a, b, c), (d, e, f) = zip(*((sin(angle / 2.0), cos(angle / 2.0)) for angle in pose.rpy), strict=True)
    x, y = a * e * f - d * b * c, d * b * f + a * e * c
    z, w = d * e * c - a * b * f, d * e * f + a * b * c
    scale = 1.0 / sqrt(x * x + y * y + z * z + w * w)
    return x * scale, y * scale, z * scale, w * scale


@lru_cache(256)
def _is_undone_exactly(quaternion: tuple[float, float, float, float]) -> bool:
    """Return whether a rotation's matrix, transposed, times itself is the identity to the last bit.

    NumPy's products may be rounded once less than Bullet's.
    """
    x, y, z, w = quaternion
    scale = 2.0 / (x * x + y * y + z * z + w * w)
    p, q, r = x * scale, y * scale, z * scale
    wx, wy, wz, xx, xy, xz = w * p, w * q, w * r, x * p, x * q, x * r
    yy, yz, zz = y * q, y * r, z * r
    first = (1.0 - (yy + zz), xy - wz, xz + wy)
    second = (xy + wz, 1.0 - (xx + zz), yz - wx)
    third = (xz - wy, yz + wx, 1.0 - (xx + yy))
    return all(
        first[i] * first[k] + second[i] * second[k] + third[i] * third[k] == (1.0 if i == k else 0.0)
        for i in range(3)
        for k in range(3)
    )


def _mesh_bounds(mesh: Mesh, *, is_rounded: bool = False) -> Array | None:
    from roboyard.sim.build.geoms import is_single, load_scaled
    from roboyard.sim.build.mesh_assets import rounded

    triangles = load_scaled(mesh, 1.0)
    if triangles is None or not len(triangles.vertices):
        return None
    box = triangles.bounds
    if not is_rounded or not (box[0] < box[1]).all():
        return box
    return rounded(box.astype(np.float32).astype(float) if is_single(mesh, 1.0) else box, BULLET.hull_steps)
