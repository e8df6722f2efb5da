"""The elements of a URDF as they are written, right or wrong, with their lines.

Numbers that are missing or cannot be read are None; `numbers.NumberFault` records why.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np

from roboyard._records import dataclass
from roboyard.description.files.resolver import Resolved
from roboyard.description.model import INERTIA_KEYS, JointType, Pose
from roboyard.description.urdf.xml import line_of
from roboyard.errors import MeshError
from roboyard.transforms import Array, pose_matrix, quaternion_from_axis_angle

if TYPE_CHECKING:
    from roboyard.shapes.mesh_stats import MeshStats

JOINT_TYPES: tuple[str, ...] = get_args(JointType)
MOVING_TYPES = ("revolute", "continuous", "prismatic", "floating", "planar", "spherical")
ONE_AXIS_TYPES = ("revolute", "continuous", "prismatic")
PRIMITIVES = ("box", "sphere", "cylinder", "capsule", "plane")
GEOMETRY_TAGS = (*PRIMITIVES, "mesh")


@dataclass(kw_only=True, eq=False)
class MeshElement:
    """A `<mesh>` of one shape."""

    element: ET.Element
    uri: str
    """As written; empty where no file is named."""
    found: Resolved
    scale: tuple[float, ...]
    """(3,) factors; ones where they cannot be read."""
    stats_by_file: Mapping[Path, MeshStats | MeshError]
    """Statistics of the robot's mesh files; empty until an audit reads them."""

    @property
    def stats(self) -> MeshStats | None:
        """Statistics of the file; None where it was not found, not read yet or cannot be read."""
        known = None if self.found.path is None else self.stats_by_file.get(self.found.path)
        return None if isinstance(known, MeshError) else known

    @property
    def error(self) -> MeshError | None:
        """Why the file that was found cannot be read."""
        known = None if self.found.path is None else self.stats_by_file.get(self.found.path)
        return known if isinstance(known, MeshError) else None

    @cached_property
    def extents(self) -> Array | None:
        """(3,) size in the shape's frame, scale included (m)."""
        stats = self.stats
        if stats is None or not stats.is_finite:
            return None
        return np.abs(np.asarray(self.scale)) * (stats.bounds[1] - stats.bounds[0])


@dataclass(kw_only=True, eq=False)
class ShapeElement:
    """A `<visual>` or `<collision>`."""

    element: ET.Element
    kind: str
    """"visual" or "collision"."""
    link: str
    """Name of the link."""
    geometry: ET.Element | None
    """Element inside `<geometry>`: the first of a known shape, else the first of all."""
    pose: Pose
    """In the link frame; the identity where it cannot be read."""
    sizes: tuple[float | None, ...]
    """Extents of a box, (radius,) of a sphere, (radius, length) of a cylinder or capsule (m); else empty."""
    normal: tuple[float, ...] | None
    """(3,) of a plane."""
    mesh: MeshElement | None

    @property
    def who(self) -> str:
        """The link, as in `link "arm"`."""
        return f'link "{self.link}"'

    @property
    def line(self) -> int | None:
        """1-based line in the file."""
        return line_of(self.element)

    @property
    def link_names(self) -> tuple[str, ...]:
        """The link, in a tuple."""
        return (self.link,)

    @cached_property
    def origin(self) -> Array:
        """(4, 4) pose in the link frame; the identity where it cannot be read."""
        return self.pose.matrix()

    @cached_property
    def size(self) -> tuple[float, ...] | None:
        """`sizes`; None for a mesh, a plane, or where one of them cannot be read."""
        known = tuple(size for size in self.sizes if size is not None)
        return known if known and len(known) == len(self.sizes) else None

    @cached_property
    def bounds(self) -> Array | None:
        """(2, 3) corners in the shape's own frame, scale included (m); None where the size is not known."""
        if self.mesh is not None:
            stats = self.mesh.stats
            if stats is None or not stats.is_finite:
                return None
            corners = stats.bounds * np.asarray(self.mesh.scale)
            return np.stack([corners.min(axis=0), corners.max(axis=0)])
        if self.size is None or self.geometry is None:
            return None
        tag = self.geometry.tag
        if tag == "box":
            half = np.asarray(self.size) / 2.0
        elif tag == "sphere":
            half = np.full(3, self.size[0])
        else:
            radius, length = self.size
            half = np.array([radius, radius, length / 2.0 + (radius if tag == "capsule" else 0.0)])
        return np.stack([-half, half])


@dataclass(kw_only=True, eq=False)
class InertialElement:
    """An `<inertial>`."""

    element: ET.Element
    mass: float | None
    """kg"""
    pose: Pose
    """Of the inertial frame in the link frame."""
    inertia: ET.Element | None
    moments: tuple[float | None, ...]
    """ixx, ixy, ixz, iyy, iyz, izz (kg m²), each None where it is missing or cannot be read."""

    @cached_property
    def origin(self) -> Array:
        """(4, 4) pose of the inertial frame in the link frame."""
        return self.pose.matrix()

    @cached_property
    def tensor(self) -> tuple[float, ...] | None:
        """ixx, ixy, ixz, iyy, iyz, izz (kg m²); None without the diagonal, or where one cannot be read."""
        if self.inertia is None or any(self.moments[k] is None for k in (0, 3, 5)):
            return None
        for key, moment in zip(INERTIA_KEYS, self.moments, strict=True):
            if moment is None and self.inertia.get(key):
                return None
        return tuple(moment or 0.0 for moment in self.moments)

    def matrix(self) -> Array | None:
        """Return the (3, 3) tensor in the inertial frame (kg m²)."""
        if self.tensor is None:
            return None
        xx, xy, xz, yy, yz, zz = self.tensor
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


@dataclass(kw_only=True, eq=False)
class LinkElement:
    """A `<link>`."""

    element: ET.Element
    name: str
    """Empty where there is none."""
    inertial: InertialElement | None
    shapes: tuple[ShapeElement, ...]
    contact: Mapping[str, float | None]
    """Numbers of `<contact>` by tag."""

    @property
    def who(self) -> str:
        """As in `link "arm"`."""
        return f'link "{self.name}"'

    @property
    def line(self) -> int | None:
        """1-based line in the file."""
        return line_of(self.element)

    @property
    def link_names(self) -> tuple[str, ...]:
        """The name, in a tuple."""
        return (self.name,)

    @property
    def has_mass(self) -> bool:
        """True where its inertial gives a mass above zero."""
        return self.inertial is not None and self.inertial.mass is not None and self.inertial.mass > 0

    @property
    def visuals(self) -> list[ShapeElement]:
        """Its `<visual>` elements."""
        return [shape for shape in self.shapes if shape.kind == "visual"]

    @property
    def collisions(self) -> list[ShapeElement]:
        """Its `<collision>` elements."""
        return [shape for shape in self.shapes if shape.kind == "collision"]

    @cached_property
    def bounds(self) -> Array | None:
        """(2, 3) corners of the box round all shapes in the link frame (m); None if no size is known."""
        corners = []
        for shape in self.shapes:
            if shape.bounds is not None:
                lower, upper = shape.bounds
                box = np.array([[x, y, z] for x in (lower[0], upper[0])
                                for y in (lower[1], upper[1]) for z in (lower[2], upper[2])])  # fmt: skip
                corners.append(box @ shape.origin[:3, :3].T + shape.origin[:3, 3])
        if not corners:
            return None
        points = np.concatenate(corners)
        return np.stack([points.min(axis=0), points.max(axis=0)])


@dataclass(kw_only=True, eq=False)
class JointElement:
    """A `<joint>`."""

    element: ET.Element
    name: str
    """Empty where there is none."""
    type: str
    """As URDF spells it where only case or blanks differ; empty where there is none."""
    parent: str
    child: str
    pose: Pose
    """Of the child frame in the parent frame; the identity where it cannot be read."""
    axis: tuple[float, ...] | None
    """(3,) as written, of any length."""
    limit: ET.Element | None
    lower: float | None
    """rad or m"""
    upper: float | None
    """rad or m"""
    effort: float | None
    """N m or N"""
    velocity: float | None
    """rad/s or m/s"""
    damping: float | None
    """N m s/rad or N s/m"""
    friction: float | None
    """N m or N"""
    mimic: ET.Element | None
    mimic_of: str
    """Name of the joint that it follows; empty where there is none."""
    multiplier: float
    offset: float
    """rad or m"""

    @property
    def who(self) -> str:
        """As in `joint "elbow"`."""
        return f'joint "{self.name}"'

    @property
    def line(self) -> int | None:
        """1-based line in the file."""
        return line_of(self.element)

    @property
    def link_names(self) -> tuple[str, ...]:
        """The child link, in a tuple."""
        return (self.child,) if self.child else ()

    @property
    def unit(self) -> str:
        """Unit of its position."""
        return "m" if self.type == "prismatic" else "rad"

    @property
    def is_fixed(self) -> bool:
        """True for a fixed joint."""
        return self.type == "fixed"

    @cached_property
    def origin(self) -> Array:
        """(4, 4) pose of the child frame in the parent frame; the identity where it cannot be read."""
        return self.pose.matrix()

    @property
    def rest(self) -> Array:
        """(4, 4) pose of the child frame in the parent frame, at the position within limits nearest to 0."""
        if self.type not in ("revolute", "prismatic") or self.axis is None or not self.has_range:
            return self.origin
        lower, upper = self.lower or 0.0, self.upper or 0.0
        position, length = min(max(0.0, lower), upper), float(np.linalg.norm(self.axis))
        if position == 0.0 or not 0.0 < length < np.inf:
            return self.origin
        axis = np.asarray(self.axis) / length
        if self.type == "prismatic":
            return self.origin @ pose_matrix(axis * position)
        return self.origin @ pose_matrix((0.0, 0.0, 0.0), quaternion_from_axis_angle(axis, position))

    @property
    def has_range(self) -> bool:
        """True where both bounds are given and the lower one is below the upper one."""
        return self.lower is not None and self.upper is not None and self.lower < self.upper


@dataclass(kw_only=True, eq=False)
class MaterialElement:
    """A `<material>`, the robot's or a visual's."""

    element: ET.Element
    link: str
    """Link of the visual; empty for the robot's own."""
    name: str
    rgba: tuple[float, ...] | None
    """(3,) or (4,), as many as are given; None without a colour or where it cannot be read."""
    texture: Resolved | None
    """None without a texture, or with one that names no file."""

    @property
    def who(self) -> str:
        """As in `material "red"`."""
        return f'material "{self.name}"'

    @property
    def line(self) -> int | None:
        """1-based line in the file."""
        return line_of(self.element)

    @property
    def link_names(self) -> tuple[str, ...]:
        """The link of the visual, in a tuple."""
        return (self.link,) if self.link else ()


def plain_type(text: str) -> str:
    """Return a joint type as URDF spells it, where only case or blanks differ."""
    plain = text.strip().lower()
    return plain if plain in JOINT_TYPES else text
