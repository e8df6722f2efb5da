"""The description as the checks see it: every element that is there, right or wrong, with its line.

Unlike `load_description`, reading a draft never fails once the file is XML: what cannot be read is None, and
each number that is wrong or sloppy is recorded for the checks of `numbers`.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from roboyard.description.files.resolver import Resolved, Resolver
from roboyard.description.urdf.link_tree import Tree
from roboyard.description.urdf.xml import line_of
from roboyard.errors import DescriptionError, MeshError
from roboyard.shapes.mesh_stats import MeshStats, mesh_stats
from roboyard.transforms import Array, pose_matrix, quaternion_from_axis_angle

MOVING_TYPES = ("revolute", "continuous", "prismatic", "floating", "planar", "spherical")
JOINT_TYPES = (*MOVING_TYPES, "fixed")
ONE_AXIS_TYPES = ("revolute", "continuous", "prismatic")
PRIMITIVES = ("box", "sphere", "cylinder", "capsule", "plane")


@dataclass(frozen=True, kw_only=True, slots=True)
class Location:
    """An element to point at."""

    who: str
    line: int | None
    link_names: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True, slots=True)
class NumberFault:
    """A number that the shared reader could not read, or read only by being lenient."""

    at: Location
    message: str
    fatal: bool


@dataclass(kw_only=True, eq=False)
class MeshUse:
    """One `<mesh>` of one shape."""

    element: ET.Element
    uri: str
    found: Resolved
    scale: tuple[float, ...]
    drafts_facts: Mapping[Path, MeshStats | MeshError]

    @property
    def facts(self) -> MeshStats | None:
        """What is known of the file; None where it was not found or cannot be read."""
        known = None if self.found.path is None else self.drafts_facts.get(self.found.path)
        return known if isinstance(known, MeshStats) else None

    @property
    def error(self) -> MeshError | None:
        """Why the file that was found cannot be read."""
        known = None if self.found.path is None else self.drafts_facts.get(self.found.path)
        return known if isinstance(known, MeshError) else None

    @cached_property
    def extents(self) -> Array | None:
        """(3,) size in the shape's frame, scale included; m."""
        facts = self.facts
        if facts is None or not facts.is_finite:
            return None
        return np.abs(np.asarray(self.scale)) * (facts.bounds[1] - facts.bounds[0])


@dataclass(kw_only=True, eq=False)
class ShapeElement:
    """A `<visual>` or `<collision>`."""

    element: ET.Element
    kind: str
    """visual or collision"""
    link: str
    geometry: ET.Element | None
    """The element inside `<geometry>`."""
    origin: Array
    """(4, 4) in the link frame; identity where it cannot be read."""
    size: tuple[float, ...] | None
    """Of a box its extents, of round ones (radius, length); None for a mesh or where it cannot be read."""
    mesh: MeshUse | None

    @property
    def who(self) -> str:
        return f'link "{self.link}"'

    @property
    def line(self) -> int | None:
        return line_of(self.element)

    @property
    def link_names(self) -> tuple[str, ...]:
        return (self.link,)

    @cached_property
    def bounds(self) -> Array | None:
        """(2, 3) corners in the shape's own frame, scale included; None where the size is not known; m."""
        if self.mesh is not None:
            facts = self.mesh.facts
            if facts is None or not facts.is_finite:
                return None
            corners = facts.bounds * np.asarray(self.mesh.scale)
            return np.stack([corners.min(axis=0), corners.max(axis=0)])
        if self.size is None or self.geometry is None:
            return None
        tag = self.geometry.tag
        if tag == "box":
            half = np.asarray(self.size) / 2.0
        elif tag == "sphere":
            half = np.full(3, self.size[0])
        elif tag in ("cylinder", "capsule"):
            radius, length = self.size
            half = np.array([radius, radius, length / 2.0 + (radius if tag == "capsule" else 0.0)])
        else:
            return None
        return np.stack([-half, half])


@dataclass(kw_only=True, eq=False)
class InertialElement:
    """An `<inertial>`; parts that are missing or cannot be read are None."""

    element: ET.Element
    mass: float | None
    origin: Array
    """(4, 4) of the inertial frame in the link frame."""
    tensor: tuple[float, ...] | None
    """ixx, ixy, ixz, iyy, iyz, izz"""

    def matrix(self) -> Array | None:
        """(3, 3) in the inertial frame; kg m²."""
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

    @property
    def who(self) -> str:
        return f'link "{self.name}"'

    @property
    def line(self) -> int | None:
        return line_of(self.element)

    @property
    def link_names(self) -> tuple[str, ...]:
        return (self.name,)

    @property
    def has_mass(self) -> bool:
        """True where its inertial gives a mass above zero."""
        return self.inertial is not None and self.inertial.mass is not None and self.inertial.mass > 0

    @property
    def visuals(self) -> list[ShapeElement]:
        return [shape for shape in self.shapes if shape.kind == "visual"]

    @property
    def collisions(self) -> list[ShapeElement]:
        return [shape for shape in self.shapes if shape.kind == "collision"]

    @cached_property
    def bounds(self) -> Array | None:
        """(2, 3) corners of the box round all shapes in the link frame; None without any of known size."""
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
    """A `<joint>`; numbers that are missing or cannot be read are None."""

    element: ET.Element
    name: str
    type: str
    parent: str
    child: str
    origin: Array
    """(4, 4) of the child frame in the parent frame; identity where it cannot be read."""
    rpy: tuple[float, ...] | None
    axis: tuple[float, ...] | None
    limit: ET.Element | None
    lower: float | None
    upper: float | None
    effort: float | None
    velocity: float | None
    damping: float | None
    friction: float | None
    mimic: ET.Element | None
    mimic_of: str
    multiplier: float
    offset: float

    @property
    def who(self) -> str:
        return f'joint "{self.name}"'

    @property
    def line(self) -> int | None:
        return line_of(self.element)

    @property
    def link_names(self) -> tuple[str, ...]:
        return (self.child,) if self.child else ()

    @property
    def unit(self) -> str:
        """Of its position."""
        return "m" if self.type == "prismatic" else "rad"

    @property
    def rest(self) -> Array:
        """(4, 4) of the child frame in the parent frame at the position nearest to zero within the limits."""
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
        """True where both bounds are given and leave room."""
        return self.lower is not None and self.upper is not None and self.lower < self.upper


@dataclass(kw_only=True, eq=False)
class MaterialElement:
    """A `<material>`, the robot's or a visual's."""

    element: ET.Element
    link: str
    """Of the visual; empty for the robot's own."""
    name: str
    rgba: tuple[float, ...] | None
    """As many numbers as are given; None without a colour or where it cannot be read."""
    texture: Resolved | None

    @property
    def who(self) -> str:
        return f'material "{self.name}"'

    @property
    def line(self) -> int | None:
        return line_of(self.element)

    @property
    def link_names(self) -> tuple[str, ...]:
        return (self.link,) if self.link else ()


@dataclass(kw_only=True, eq=False)
class UrdfElements:
    """A whole description, right or wrong."""

    file: Path
    root: ET.Element
    xml_notes: tuple[str, ...]
    links: tuple[LinkElement, ...]
    joints: tuple[JointElement, ...]
    materials: tuple[MaterialElement, ...]
    number_faults: tuple[NumberFault, ...]
    resolver: Resolver
    meshes: dict[Path, MeshStats | MeshError] = field(default_factory=dict)
    """Of every mesh file found."""
    refusal: DescriptionError | None = None
    """Why there is nothing to look at: the file cannot be read, or is no XML."""

    @property
    def name(self) -> str:
        return (self.root.get("name") or "").strip()

    @cached_property
    def link_by_name(self) -> dict[str, LinkElement]:
        return {link.name: link for link in reversed(self.links) if link.name}

    @cached_property
    def joint_by_name(self) -> dict[str, JointElement]:
        return {joint.name: joint for joint in reversed(self.joints) if joint.name}

    @property
    def moving_joints(self) -> Iterator[JointElement]:
        return (joint for joint in self.joints if joint.type in MOVING_TYPES)

    @property
    def one_axis_joints(self) -> Iterator[JointElement]:
        return (joint for joint in self.joints if joint.type in ONE_AXIS_TYPES)

    @property
    def shapes(self) -> Iterator[ShapeElement]:
        return (shape for link in self.links for shape in link.shapes)

    @property
    def mesh_shapes(self) -> Iterator[tuple[ShapeElement, MeshUse]]:
        return ((shape, shape.mesh) for shape in self.shapes if shape.mesh is not None)

    @cached_property
    def tree(self) -> Tree:
        """How links hang together."""
        edges = [(joint.parent, joint.child, joint.rest, joint.type == "fixed") for joint in self.joints]
        return Tree.of([link.name for link in self.links if link.name], edges)

    @cached_property
    def mimic_rings(self) -> tuple[tuple[str, ...], ...]:
        """Joints that follow each other round, each ring once from its first joint in the file."""
        return self._followed[0]

    @cached_property
    def endless_mimics(self) -> frozenset[str]:
        """Joints that lead to such a ring, however far they follow."""
        return self._followed[1]

    @cached_property
    def _followed(self) -> tuple[tuple[tuple[str, ...], ...], frozenset[str]]:
        follows = {
            name: joint.mimic_of for name, joint in self.joint_by_name.items() if joint.mimic is not None
        }
        ends: dict[str, bool] = {}
        rings: list[tuple[str, ...]] = []
        for start in (joint.name for joint in self.joints if joint.name):
            way: dict[str, None] = {}
            name = start
            while name in follows and name not in ends and name not in way:
                way[name] = None
                name = follows[name]
            if name in way:
                names = list(way)
                rings.append(tuple(names[names.index(name) :]))
                ends |= dict.fromkeys(way, False)
            else:
                ends |= dict.fromkeys(way, ends.get(name, True))
        return tuple(rings), frozenset(name for name, does in ends.items() if not does)

    @cached_property
    def massless_bodies(self) -> frozenset[int]:
        """Indices in `tree.bodies` of those that must move and have no mass.

        The body that holds the root may be bolted down, so it is never among them.
        """
        return frozenset(
            index
            for index, names in enumerate(self.tree.bodies)
            if all(self.tree.parents[name] for name in names)
            and not any(self.link_by_name[name].has_mass for name in names)
        )

    @cached_property
    def reach(self) -> float:
        """Largest distance between a link frame and its root, joints at rest; m."""
        return max((float(np.linalg.norm(pose[:3, 3])) for pose in self.tree.frames.values()), default=0.0)

    def close(self) -> None:
        """Load the facts of every mesh file."""
        for _, mesh in self.mesh_shapes:
            path = mesh.found.path
            if path is not None and path not in self.meshes:
                try:
                    self.meshes[path] = mesh_stats(path)
                except MeshError as error:
                    self.meshes[path] = error


def plain_type(text: str) -> str:
    """A joint type spelt as URDF spells it, where only case or blanks differ."""
    plain = text.strip().lower()
    return plain if plain in JOINT_TYPES else text
