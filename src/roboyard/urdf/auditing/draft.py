"""The description as the checks see it: every element that is there, right or wrong, with its line.

Unlike `load_urdf`, reading a draft never fails once the file is XML: what cannot be read is None, and each
number that is wrong or sloppy is recorded for the checks of `numbers`.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from roboyard.errors import DescriptionError, MeshError
from roboyard.poses import Array, pose_matrix, quaternion_from_axis_angle
from roboyard.shapes.facts import MeshFacts, mesh_facts
from roboyard.urdf.auditing.tree import Tree
from roboyard.urdf.model import CONTACT_TAGS, INERTIA_KEYS
from roboyard.urdf.numbers import read_number, read_vector
from roboyard.urdf.problems import Problems
from roboyard.urdf.reading import read_pose
from roboyard.urdf.resolve import Resolved, Resolver
from roboyard.urdf.xml import line_of

MOVING_TYPES = ("revolute", "continuous", "prismatic", "floating", "planar", "spherical")
JOINT_TYPES = (*MOVING_TYPES, "fixed")
ONE_AXIS_TYPES = ("revolute", "continuous", "prismatic")
PRIMITIVES = ("box", "sphere", "cylinder", "capsule", "plane")


@dataclass(frozen=True, kw_only=True, slots=True)
class Place:
    """An element to point at."""

    who: str
    line: int | None
    link_names: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True, slots=True)
class NumberFault:
    """A number that the shared reader could not read, or read only by being lenient."""

    at: Place
    message: str
    fatal: bool


class _Recorder(Problems):
    """Keeps what the number reader reports, with its place."""

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self.faults: list[NumberFault] = []
        self.links: tuple[str, ...] = ()

    def error(self, at: ET.Element | int | None, element: str, message: str) -> None:
        self._keep(at, element, message, fatal=True)

    def note(self, at: ET.Element | int | None, element: str, message: str) -> None:
        self._keep(at, element, message, fatal=False)

    def _keep(self, at: ET.Element | int | None, element: str, message: str, *, fatal: bool) -> None:
        line = line_of(at) if isinstance(at, ET.Element) else at
        place = Place(who=element, line=line, link_names=self.links)
        self.faults.append(NumberFault(at=place, message=message, fatal=fatal))


@dataclass(kw_only=True, eq=False)
class MeshUse:
    """One `<mesh>` of one shape."""

    element: ET.Element
    uri: str
    found: Resolved
    scale: tuple[float, ...]
    drafts_facts: Mapping[Path, MeshFacts | MeshError]

    @property
    def facts(self) -> MeshFacts | None:
        """What is known of the file; None where it was not found or cannot be read."""
        known = None if self.found.path is None else self.drafts_facts.get(self.found.path)
        return known if isinstance(known, MeshFacts) else None

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
class DraftShape:
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
class DraftInertial:
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
class DraftLink:
    """A `<link>`."""

    element: ET.Element
    name: str
    """Empty where there is none."""
    inertial: DraftInertial | None
    shapes: tuple[DraftShape, ...]

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
    def visuals(self) -> list[DraftShape]:
        return [shape for shape in self.shapes if shape.kind == "visual"]

    @property
    def collisions(self) -> list[DraftShape]:
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
class DraftJoint:
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
class DraftMaterial:
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
class Draft:
    """A whole description, right or wrong."""

    file: Path
    root: ET.Element
    xml_notes: tuple[str, ...]
    links: tuple[DraftLink, ...]
    joints: tuple[DraftJoint, ...]
    materials: tuple[DraftMaterial, ...]
    number_faults: tuple[NumberFault, ...]
    resolver: Resolver
    meshes: dict[Path, MeshFacts | MeshError] = field(default_factory=dict)
    """Of every mesh file found."""
    refusal: DescriptionError | None = None
    """Why there is nothing to look at: the file cannot be read, or is no XML."""

    @property
    def name(self) -> str:
        return (self.root.get("name") or "").strip()

    @cached_property
    def link_by_name(self) -> dict[str, DraftLink]:
        return {link.name: link for link in reversed(self.links) if link.name}

    @cached_property
    def joint_by_name(self) -> dict[str, DraftJoint]:
        return {joint.name: joint for joint in reversed(self.joints) if joint.name}

    @property
    def moving_joints(self) -> Iterator[DraftJoint]:
        return (joint for joint in self.joints if joint.type in MOVING_TYPES)

    @property
    def one_axis_joints(self) -> Iterator[DraftJoint]:
        return (joint for joint in self.joints if joint.type in ONE_AXIS_TYPES)

    @property
    def shapes(self) -> Iterator[DraftShape]:
        return (shape for link in self.links for shape in link.shapes)

    @property
    def mesh_shapes(self) -> Iterator[tuple[DraftShape, MeshUse]]:
        return ((shape, shape.mesh) for shape in self.shapes if shape.mesh is not None)

    @cached_property
    def tree(self) -> Tree:
        """How links hang together."""
        edges = [(joint.parent, joint.child, joint.rest, joint.type == "fixed") for joint in self.joints]
        return Tree.of([link.name for link in self.links if link.name], edges)

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
                    self.meshes[path] = mesh_facts(path)
                except MeshError as error:
                    self.meshes[path] = error


def read_draft(
    file: Path,
    root: ET.Element,
    xml_notes: tuple[str, ...],
    resolver: Resolver,
    *,
    known_meshes: Mapping[Path, MeshFacts | MeshError] | None = None,
) -> Draft:
    """Read what is there; mesh files are opened too, but for those that are known."""
    recorder = _Recorder(file)
    meshes: dict[Path, MeshFacts | MeshError] = dict(known_meshes or {})
    links = tuple(_link(element, recorder, resolver, meshes) for element in root.findall("link"))
    joints = tuple(_joint(element, recorder) for element in root.findall("joint"))
    draft = Draft(
        file=file,
        root=root,
        xml_notes=xml_notes,
        links=links,
        joints=joints,
        materials=_materials(root, recorder, resolver),
        number_faults=tuple(recorder.faults),
        resolver=resolver,
        meshes=meshes,
    )
    draft.close()
    return draft


def refused(file: Path, error: DescriptionError, resolver: Resolver) -> Draft:
    """A draft of nothing, for a file that cannot be read."""
    return Draft(
        file=file,
        root=ET.Element("robot"),
        xml_notes=(),
        links=(),
        joints=(),
        materials=(),
        number_faults=(),
        resolver=resolver,
        refusal=error,
    )


def plain_type(text: str) -> str:
    """A joint type spelt as URDF spells it, where only case or blanks differ."""
    plain = text.strip().lower()
    return plain if plain in JOINT_TYPES else text


def _materials(root: ET.Element, recorder: _Recorder, resolver: Resolver) -> tuple[DraftMaterial, ...]:
    found = [("", element) for element in root.findall("material")]
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            found += [(_name(link), element) for element in visual.findall("material")[:1]]
    return tuple(_material(element, link, recorder, resolver) for link, element in found)


def _material(element: ET.Element, link: str, recorder: _Recorder, resolver: Resolver) -> DraftMaterial:
    name = _name(element)
    recorder.links = (link,) if link else ()
    color, texture = element.find("color"), element.find("texture")
    rgba: tuple[float, ...] | None = None
    if color is not None and (text := color.get("rgba")):
        size = 3 if len(text.split()) == 3 else 4
        rgba = read_vector(color, "rgba", size, f'material "{name}"', recorder)
    uri = None if texture is None else texture.get("filename")
    return DraftMaterial(
        element=element,
        link=link,
        name=name,
        rgba=rgba,
        texture=resolver.resolve(uri) if uri else None,
    )


def _name(element: ET.Element) -> str:
    return element.get("name") or ""


def _origin(parent: ET.Element, who: str, recorder: _Recorder) -> tuple[Array, tuple[float, ...] | None]:
    """(4, 4) pose and the roll, pitch, yaw as written."""
    pose = read_pose(parent.find("origin"), who, recorder)
    return pose.matrix(), pose.rpy


def _link(
    element: ET.Element, recorder: _Recorder, resolver: Resolver, meshes: Mapping[Path, MeshFacts | MeshError]
) -> DraftLink:
    name = _name(element)
    who = f'link "{name}"'
    recorder.links = (name,)
    inertial, contact = element.find("inertial"), element.find("contact")
    for child in () if contact is None else contact:
        if child.tag in CONTACT_TAGS:
            read_number(child, "value", who, recorder)
    shapes = [
        _shape(child, name, who, recorder, resolver, meshes)
        for child in element
        if child.tag in ("visual", "collision")
    ]
    return DraftLink(
        element=element,
        name=name,
        inertial=None if inertial is None else _inertial(inertial, who, recorder),
        shapes=tuple(shapes),
    )


def _inertial(element: ET.Element, who: str, recorder: _Recorder) -> DraftInertial:
    mass, inertia = element.find("mass"), element.find("inertia")
    tensor: tuple[float, ...] | None = None
    if inertia is not None:
        keys = INERTIA_KEYS
        numbers = [read_number(inertia, key, who, recorder) for key in keys]
        diagonal_is_there = all(numbers[k] is not None for k in (0, 3, 5))
        unreadable = any(
            number is None and inertia.get(key) for key, number in zip(keys, numbers, strict=True)
        )
        if diagonal_is_there and not unreadable:
            tensor = tuple(0.0 if number is None else number for number in numbers)
    return DraftInertial(
        element=element,
        mass=None if mass is None else read_number(mass, "value", who, recorder),
        origin=_origin(element, who, recorder)[0],
        tensor=tensor,
    )


def _shape(
    element: ET.Element,
    link: str,
    who: str,
    recorder: _Recorder,
    resolver: Resolver,
    meshes: Mapping[Path, MeshFacts | MeshError],
) -> DraftShape:
    holder = element.find("geometry")
    geometry = (
        next((child for child in holder if isinstance(child.tag, str)), None) if holder is not None else None
    )
    mesh: MeshUse | None = None
    size: tuple[float, ...] | None = None
    if geometry is not None and geometry.tag == "mesh":
        uri = geometry.get("filename") or ""
        scale = _scale(geometry, who, recorder)
        mesh = MeshUse(
            element=geometry,
            uri=uri,
            found=resolver.resolve(uri),
            scale=scale,
            drafts_facts=meshes,
        )
    elif geometry is not None:
        size = _size(geometry, who, recorder)
    return DraftShape(
        element=element,
        kind=element.tag,
        link=link,
        geometry=geometry,
        origin=_origin(element, who, recorder)[0],
        size=size,
        mesh=mesh,
    )


def _scale(geometry: ET.Element, who: str, recorder: _Recorder) -> tuple[float, ...]:
    text = geometry.get("scale") or ""
    if len(text.split()) == 1:  # one number for all three axes, as Bullet reads it
        factor = read_number(geometry, "scale", who, recorder)
        return (1.0, 1.0, 1.0) if factor is None else (factor, factor, factor)
    return read_vector(geometry, "scale", 3, who, recorder) or (1.0, 1.0, 1.0)


def _size(geometry: ET.Element, who: str, recorder: _Recorder) -> tuple[float, ...] | None:
    if geometry.tag == "box":
        return read_vector(geometry, "size", 3, who, recorder)
    if geometry.tag == "sphere":
        radius = read_number(geometry, "radius", who, recorder)
        return None if radius is None else (radius,)
    if geometry.tag in ("cylinder", "capsule"):
        radius = read_number(geometry, "radius", who, recorder)
        length = read_number(geometry, "length", who, recorder)
        return None if radius is None or length is None else (radius, length)
    return None


def _joint(element: ET.Element, recorder: _Recorder) -> DraftJoint:
    name = _name(element)
    who = f'joint "{name}"'
    parent, child = element.find("parent"), element.find("child")
    axis, limit = element.find("axis"), element.find("limit")
    dynamics, mimic = element.find("dynamics"), element.find("mimic")
    child_name = "" if child is None else child.get("link") or ""
    recorder.links = (child_name,) if child_name else ()

    def number(of: ET.Element | None, key: str) -> float | None:
        return None if of is None else read_number(of, key, who, recorder)

    origin, rpy = _origin(element, who, recorder)
    multiplier, offset = number(mimic, "multiplier"), number(mimic, "offset")
    return DraftJoint(
        element=element,
        name=name,
        type=plain_type(element.get("type") or ""),
        parent="" if parent is None else parent.get("link") or "",
        child=child_name,
        origin=origin,
        rpy=rpy,
        axis=None if axis is None else read_vector(axis, "xyz", 3, who, recorder),
        limit=limit,
        lower=number(limit, "lower"),
        upper=number(limit, "upper"),
        effort=number(limit, "effort"),
        velocity=number(limit, "velocity"),
        damping=number(dynamics, "damping"),
        friction=number(dynamics, "friction"),
        mimic=mimic,
        mimic_of="" if mimic is None else mimic.get("joint") or "",
        multiplier=1.0 if multiplier is None else multiplier,
        offset=0.0 if offset is None else offset,
    )
