"""MJCF files as Bullet reads them: a subset of the format, with a link of its own for every joint.

A body with joints becomes a chain: a massless link for each joint, and the body fixed to the last of them by
a joint called `jointfix_<count>_<parent>`. Without a free joint at its top, the chain starts at a base of
mass 0. Where the file gives no mass, it is 1000 kg/m³ times the volume of the body's own shapes. Defaults are
those of the outermost `<default>` and of a body's `childclass`; other classes, tendons and actuators are
ignored.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import field, replace
from itertools import count
from math import pi
from pathlib import Path

import numpy as np

from roboyard._records import dataclass
from roboyard.description.axes import unit_axis
from roboyard.description.model import (
    Contact,
    Inertial,
    Joint,
    JointType,
    Limit,
    Link,
    Material,
    Pose,
    RobotDescription,
    Visual,
)
from roboyard.description.urdf.xml import line_of, read_xml
from roboyard.errors import DescriptionError
from roboyard.pybullet.readers.mjcf_geoms import Geom, GeomDefaults, Reader, numbers, pose_of, read_geom
from roboyard.transforms import Array, inverse_pose, quaternion_from_matrix

DENSITY = 1000.0
"""Density of bodies without a mass (kg/m³)."""
_TYPES: dict[str, JointType] = {"fixed": "fixed", "slide": "prismatic", "hinge": "revolute"}
_counted = [0]
"""Number of unnamed joints and bodies so far; like Bullet's, it grows as long as the process runs."""


@dataclass(frozen=True, kw_only=True, slots=True)
class MjcfModel:
    """A top-level body with its descendants, or one fixed shape."""

    description: RobotDescription
    """The body as a robot."""
    position: Array
    """(3,) position of the body in the world (m), where Bullet places the base's inertial frame."""
    orientation: Array
    """(4,) orientation of the body in the world (x, y, z, w)."""
    filters: dict[str, tuple[int, int]]
    """Link name to its contype and conaffinity."""
    numbered: dict[str, tuple[str, int, str]]
    """Name of each unnamed joint, which has a number that counts from 0 in the file, to its parts."""

    def names(self, first: int) -> dict[str, str]:
        """Return the names that scripts see of unnamed joints, by their names in the description.

        Args:
            first: the number of the file's first unnamed joint or body, from `take_numbers`.
        """
        return {
            name: f"{before}{first + number}{after}"
            for name, (before, number, after) in self.numbered.items()
        }


@dataclass(kw_only=True, slots=True)
class MjcfFile:
    """What a file was read to; the same for each time that it is loaded."""

    models: list[MjcfModel]
    numbers: int
    """How many unnamed joints and bodies it has."""

    def take_numbers(self) -> int:
        """Return the first of as many numbers as it needs, which no other names get."""
        first = _counted[0]
        _counted[0] += self.numbers
        return first


@dataclass(kw_only=True, slots=True)
class _Tree:
    """A model that is being read."""

    number: int
    counter: count[int]
    """Of unnamed joints and bodies of the file."""
    numbered: dict[str, tuple[str, int, str]] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    filters: dict[str, tuple[int, int]] = field(default_factory=dict)

    def add_link(self, name: str | None) -> int:
        index = len(self.links)
        wanted = name or f"link{self.number}_{index}"
        if any(link.name == wanted for link in self.links):
            raise DescriptionError(f"two bodies have the name {wanted!r}; rename one")
        self.links.append(Link(name=wanted, inertial=Inertial(mass=0.0)))
        return index

    def numbered_name(self, before: str, after: str) -> str:
        number = next(self.counter)
        name = f"{before}{number}{after}"
        self.numbered[name] = before, number, after
        return name


def load_mjcf(path: Path, search_paths: Sequence[Path] = (), *, colors: bool = False) -> MjcfFile:
    """Return all models of a file, in file order.

    Args:
        path: MJCF file.
        search_paths: folders where meshes are searched after the file's own.
        colors: whether to read colours.

    Raises:
        DescriptionError: the file is not MJCF, or a number is not valid.
    """
    root, _ = read_xml(path)
    if root.tag != "mujoco":
        raise DescriptionError(
            f"the root element is <{root.tag}>, expected <mujoco>", file=path, line=line_of(root)
        )
    reader = Reader(path=path, search_paths=(path.parent, *search_paths), colors=colors)
    for section in root:
        if section.tag == "compiler":
            reader.read_compiler(section)
        elif section.tag == "asset":
            reader.read_assets(section)
        elif section.tag == "default":
            reader.defaults = reader.read_default(section, reader.defaults)
    models: list[MjcfModel] = []
    name, counter = root.get("model", ""), count()
    for world in root.findall("worldbody"):
        for element in world:
            if element.tag == "body":
                models.append(_top_body(element, reader, name, len(models), counter))
            elif element.tag == "geom":
                models.append(_fixed_geom(element, reader, name))
    return MjcfFile(models=models, numbers=next(counter))


def _fixed_geom(element: ET.Element, reader: Reader, name: str) -> MjcfModel:
    geom = read_geom(element, reader, reader.defaults)
    link = Link(name=element.get("name", "anonymous"), inertial=Inertial(mass=0.0))
    filters: dict[str, tuple[int, int]] = {}
    if geom is not None:
        link = _with_geoms(link, [geom])
        filters[link.name] = (geom.settings.group, geom.settings.mask)
    description = RobotDescription(name=name, links=(link,), source=reader.source(element))
    return MjcfModel(
        description=description,
        position=np.zeros(3),
        orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        filters=filters,
        numbered={},
    )


def _top_body(element: ET.Element, reader: Reader, name: str, number: int, counter: count[int]) -> MjcfModel:
    tree = _Tree(number=number, counter=counter)
    root_pose = _body(element, reader, reader.defaults, tree, None)
    children = {joint.child for joint in tree.joints}
    root = next(link for link in tree.links if link.name not in children)
    links = (root, *(link for link in tree.links if link is not root))
    description = RobotDescription(
        name=name, links=links, joints=tuple(tree.joints), source=reader.source(element)
    )
    return MjcfModel(
        description=description,
        position=root_pose[:3, 3],
        orientation=quaternion_from_matrix(root_pose[:3, :3]),
        filters=tree.filters,
        numbered=tree.numbered,
    )


def _body(
    element: ET.Element, reader: Reader, defaults: GeomDefaults, tree: _Tree, parent: int | None
) -> Array:
    """Read a body and all below it; gives the pose of the tree's root in the world."""
    defaults = reader.classes.get(element.get("childclass", ""), defaults)
    own = tree.add_link(element.get("name"))
    if element.get("name") is None:
        next(tree.counter)
    place = pose_of(element, reader)
    is_top, root_pose = parent is None, place
    frame, mass = _inertial(element, reader)
    joint_pose = np.eye(4)
    geoms: list[Geom] = []
    has_joint = False
    for child in element:
        if child.tag == "joint" and (parent is not None or child.get("type") != "free"):
            if parent is None:
                parent, root_pose = tree.add_link(None), np.eye(4)
            link = tree.add_link(None)
            if not has_joint:
                joint_pose = pose_of(child, reader)
                at, place = place @ joint_pose, inverse_pose(joint_pose)
            else:
                at = inverse_pose(joint_pose) @ pose_of(child, reader)
            _joint(child, reader, defaults, tree, parent, link, at)
            parent, has_joint = link, True
        elif child.tag == "geom":
            geom = read_geom(child, reader, defaults)
            if geom is not None:
                geoms.append(geom)
                if mass is None:
                    frame = replace(frame, position=geom.shift)
        elif child.tag == "body":
            _body(child, reader, defaults, tree, own)
    if geoms:
        tree.links[own] = _with_geoms(tree.links[own], geoms)
        tree.filters[tree.links[own].name] = (geoms[-1].settings.group, geoms[-1].settings.mask)
    if mass is None:
        mass = DENSITY * sum(geom.volume for geom in geoms)
    tensor = _tensor(element, reader)
    tree.links[own] = replace(
        tree.links[own],
        inertial=Inertial(mass=mass, origin=frame, inertia=tensor),
        source=reader.source(element),
    )
    if parent is not None:
        tree.joints.append(
            Joint(
                name=tree.numbered_name("jointfix_", f"_{parent}"),
                type="fixed",
                parent=tree.links[parent].name,
                child=tree.links[own].name,
                origin=_as_pose(place),
                source=reader.source(element),
            )
        )
    return root_pose if is_top else np.eye(4)


def _joint(
    element: ET.Element,
    reader: Reader,
    defaults: GeomDefaults,
    tree: _Tree,
    parent: int,
    link: int,
    pose: Array,
) -> None:
    kind = _TYPES.get(element.get("type", ""))
    if kind is None:
        raise DescriptionError(
            f'Bullet does not support <joint type="{element.get("type", "")}">; use hinge, slide or free',
            file=reader.path,
            line=line_of(element),
        )
    limited = element.get("limited", defaults.limited) == "true"
    low, high = 1.0, 0.0
    if limited:
        low, high = numbers(element, "range", 2, reader) or (low, high)
        if kind == "revolute" and reader.in_degrees:
            low, high = low * pi / 180.0, high * pi / 180.0
    elif kind == "revolute":
        kind = "continuous"
    axis, length = unit_axis(numbers(element, "axis", 3, reader) or (1.0, 0.0, 0.0))
    name = element.get("name")
    tree.joints.append(
        Joint(
            name=name or tree.numbered_name("joint", f"_{link}_{len(tree.joints)}"),
            type=kind,
            parent=tree.links[parent].name,
            child=tree.links[link].name,
            origin=_as_pose(pose),
            axis=axis,
            axis_length=length,
            limit=Limit(lower=low, upper=high),
            source=reader.source(element),
        )
    )


def _inertial(element: ET.Element, reader: Reader) -> tuple[Pose, float | None]:
    """Return the inertial frame and mass (kg) of a body's `<inertial>`; mass None without one."""
    found = element.find("inertial")
    if found is None:
        return Pose(), None
    mass = numbers(found, "mass", 1, reader)
    return _as_pose(pose_of(found, reader)), 0.0 if mass is None else mass[0]


def _tensor(element: ET.Element, reader: Reader) -> tuple[float, float, float, float, float, float]:
    found = element.find("inertial")
    diagonal = None
    if found is not None and not reader.inertia_from_geoms:
        diagonal = numbers(found, "diaginertia", 3, reader)
    x, y, z = diagonal or (0.0, 0.0, 0.0)
    return x, 0.0, 0.0, y, 0.0, z


def _with_geoms(link: Link, geoms: Sequence[Geom]) -> Link:
    last = geoms[-1].settings
    return replace(
        link,
        collisions=tuple(g.collision() for g in geoms),
        visuals=tuple(
            Visual(geometry=g.geometry, origin=g.origin, material=Material(rgba=g.settings.rgba))
            for g in geoms
        ),
        contact=Contact(
            lateral_friction=last.friction, spinning_friction=last.spinning, rolling_friction=last.rolling
        ),
    )


def _as_pose(matrix: Array) -> Pose:
    x, y, z = (float(v) for v in matrix[:3, 3])
    qx, qy, qz, qw = (float(v) for v in quaternion_from_matrix(matrix[:3, :3]))
    return Pose(position=(x, y, z), quaternion=(qx, qy, qz, qw))
