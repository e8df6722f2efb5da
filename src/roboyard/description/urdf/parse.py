"""First stage of reading a URDF: parse a file into its elements, right or wrong.

`parse_urdf` never fails. An audit checks the elements, a repair edits their XML, and `build_description`
turns them into a `RobotDescription` or raises. Elements can be passed on from one to the other, so that each
file is parsed once.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from roboyard._records import dataclass
from roboyard.description.files.resolver import Resolver
from roboyard.description.urdf.elements import (
    MOVING_TYPES,
    ONE_AXIS_TYPES,
    JointElement,
    LinkElement,
    MaterialElement,
    MeshElement,
    ShapeElement,
)
from roboyard.description.urdf.link_tree import LinkTree
from roboyard.description.urdf.numbers import NumberFault
from roboyard.description.urdf.parse_elements import ParsedElements, parse_elements
from roboyard.description.urdf.xml import copy_tree
from roboyard.description.xacro.expand import read_robot_xml
from roboyard.errors import DescriptionError, MeshError

if TYPE_CHECKING:
    from roboyard.shapes.mesh_stats import MeshStats


@dataclass(kw_only=True, eq=False)
class UrdfElements:
    """A parsed URDF. Links, joints and materials are parsed from the XML when they are first used."""

    file: Path | None
    """None for XML made in memory."""
    root: ET.Element
    resolver: Resolver
    xml_notes: tuple[str, ...] = ()
    """Corrections that made the file well-formed XML."""
    words_are_zero: bool = False
    """True where every word among numbers is read as 0."""
    mesh_stats: dict[Path, MeshStats | MeshError] = field(default_factory=dict)
    """Of every mesh file found; empty until an audit reads them."""
    refusal: DescriptionError | None = None
    """Why there is nothing to parse: the file cannot be read, or is no XML."""

    @cached_property
    def _parsed(self) -> ParsedElements:
        return parse_elements(
            self.root, self.resolver, stats_by_file=self.mesh_stats, words_are_zero=self.words_are_zero
        )

    @property
    def path(self) -> Path:
        """The file; `robot.urdf` for XML made in memory."""
        return Path("robot.urdf") if self.file is None else self.file

    @property
    def name(self) -> str:
        """The robot's name; empty where there is none."""
        return (self.root.get("name") or "").strip()

    @property
    def links(self) -> tuple[LinkElement, ...]:
        """Every `<link>`, in file order."""
        return self._parsed.links

    @property
    def joints(self) -> tuple[JointElement, ...]:
        """Every `<joint>`, in file order."""
        return self._parsed.joints

    @property
    def materials(self) -> tuple[MaterialElement, ...]:
        """The robot's materials, then those of the visuals."""
        return self._parsed.materials

    @property
    def number_faults(self) -> tuple[NumberFault, ...]:
        """Numbers that could not be read, or only by being lenient."""
        return self._parsed.number_faults

    @cached_property
    def link_by_name(self) -> dict[str, LinkElement]:
        """Name to link, the first of each name."""
        return {link.name: link for link in reversed(self.links) if link.name}

    @cached_property
    def joint_by_name(self) -> dict[str, JointElement]:
        """Name to joint, the first of each name."""
        return {joint.name: joint for joint in reversed(self.joints) if joint.name}

    @property
    def moving_joints(self) -> Iterator[JointElement]:
        """Joints of a known type other than fixed."""
        return (joint for joint in self.joints if joint.type in MOVING_TYPES)

    @property
    def one_axis_joints(self) -> Iterator[JointElement]:
        """Revolute, continuous and prismatic joints."""
        return (joint for joint in self.joints if joint.type in ONE_AXIS_TYPES)

    @property
    def shapes(self) -> Iterator[ShapeElement]:
        """The visuals and collisions of all links."""
        return (shape for link in self.links for shape in link.shapes)

    @property
    def mesh_shapes(self) -> Iterator[tuple[ShapeElement, MeshElement]]:
        """The shapes that are meshes, and their meshes."""
        return ((shape, shape.mesh) for shape in self.shapes if shape.mesh is not None)

    @cached_property
    def tree(self) -> LinkTree:
        """Links and the joints between them."""
        return LinkTree.of([link.name for link in self.links if link.name], self.joints)

    @cached_property
    def mimic_rings(self) -> tuple[tuple[str, ...], ...]:
        """Joints that follow each other in a ring, each ring once."""
        rings: list[tuple[str, ...]] = []
        known: set[str] = set()
        for joint in self.joints:
            entry = self.mimic_ring_entries.get(joint.name)
            if entry is not None and entry not in known:
                ring = [entry]
                while (follows := self.joint_by_name[ring[-1]].mimic_of) != entry:
                    ring.append(follows)
                known.update(ring)
                rings.append(tuple(ring))
        return tuple(rings)

    @cached_property
    def mimic_ring_entries(self) -> dict[str, str]:
        """Joint to the first joint of a ring that following leads to; only joints that lead to one."""
        follows = {
            name: joint.mimic_of for name, joint in self.joint_by_name.items() if joint.mimic is not None
        }
        entries: dict[str, str | None] = {}
        for start in follows:
            path: dict[str, None] = {}
            name = start
            while name in follows and name not in entries and name not in path:
                path[name] = None
                name = follows[name]
            if name in path:
                names = list(path)
                entries |= {member: member for member in names[names.index(name) :]}
            for member in path:
                entries.setdefault(member, entries.get(name))
        return {name: entry for name, entry in entries.items() if entry is not None}

    @cached_property
    def massless_bodies(self) -> frozenset[int]:
        """Indices in `tree.bodies` of those that must move and have no mass.

        The body that holds the root may be fixed to the ground, so it is never among them.
        """
        return frozenset(
            index
            for index, names in enumerate(self.tree.bodies)
            if all(self.tree.parents[name] for name in names)
            and not any(self.link_by_name[name].has_mass for name in names)
        )

    @cached_property
    def reach(self) -> float:
        """Largest distance between a link frame and its root, joints at rest (m)."""
        return max((float(np.linalg.norm(pose[:3, 3])) for pose in self.tree.frames.values()), default=0.0)

    def parsed_again(self) -> UrdfElements:
        """Return the elements of the XML as it is now, after edits; mesh files are not read again."""
        return UrdfElements(
            file=self.file, root=self.root, resolver=self.resolver, mesh_stats=self.mesh_stats
        )

    def moved_to(self, file: Path) -> UrdfElements:
        """Return the elements of a file that was moved with its meshes, which are found at the new place."""
        resolver = replace(self.resolver, base=file.absolute().parent, real_base=None)
        return UrdfElements(file=file, root=self.root, resolver=resolver, xml_notes=self.xml_notes)

    def editable_copy(self) -> UrdfElements:
        """Return elements with a copy of the XML, so that edits leave these as they are."""
        return UrdfElements(
            file=self.file,
            root=copy_tree(self.root),
            resolver=self.resolver,
            xml_notes=self.xml_notes,
            mesh_stats=self.mesh_stats,
        )


def parse_urdf(
    path: Path | str,
    *,
    packages: Mapping[str, Path] | None = None,
    search_paths: Sequence[Path] = (),
    xacro_args: Mapping[str, str] | None = None,
) -> UrdfElements:
    """Parse a URDF or xacro file; never fails: `UrdfElements.refusal` says why a file cannot be read.

    Args:
        path: the file.
        packages: ROS package name to folder, for `package://` and `model://`.
        search_paths: more folders to search for packages and files; see
            `roboyard.description.files.resolver`.
        xacro_args: values of `<xacro:arg>` by name, for a xacro file.
    """
    file = Path(path)
    resolver = Resolver.of_file(file, packages=packages, search_paths=search_paths)
    try:
        root, notes = read_robot_xml(file, resolver, xacro_args)
    except DescriptionError as error:
        return UrdfElements(file=file, root=ET.Element("robot"), resolver=resolver, refusal=error)
    return UrdfElements(file=file, root=root, resolver=resolver, xml_notes=notes)
