"""Parse the elements of a URDF, right or wrong: nothing is refused, each faulty number is recorded."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, cast

from roboyard._records import dataclass
from roboyard.description.files.resolver import Resolved, Resolver
from roboyard.description.model import CONTACT_TAGS, INERTIA_KEYS, Pose, Quaternion, Vector3
from roboyard.description.urdf.elements import (
    GEOMETRY_TAGS,
    InertialElement,
    JointElement,
    LinkElement,
    MaterialElement,
    MeshElement,
    ShapeElement,
    plain_type,
)
from roboyard.description.urdf.numbers import UNIT_TOLERANCE, NumberFault, NumberParser, unit_quaternion
from roboyard.errors import MeshError
from roboyard.transforms import quaternion_from_rpy

if TYPE_CHECKING:
    from roboyard.shapes.mesh_stats import MeshStats

_SIZES = {"sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}


@dataclass(frozen=True, kw_only=True, slots=True)
class ParsedElements:
    """The elements of one file, in file order."""

    links: tuple[LinkElement, ...]
    joints: tuple[JointElement, ...]
    materials: tuple[MaterialElement, ...]
    """The robot's own, then those of the visuals."""
    number_faults: tuple[NumberFault, ...]


@dataclass(frozen=True, kw_only=True, slots=True)
class _Parser:
    numbers: NumberParser
    resolver: Resolver
    stats_by_file: Mapping[Path, MeshStats | MeshError]
    found: dict[str, Resolved] = field(default_factory=dict)

    def file(self, uri: str) -> Resolved:
        """Return the file that a URI names; each is looked for once."""
        if uri not in self.found:
            self.found[uri] = self.resolver.resolve(uri)
        return self.found[uri]


def parse_elements(
    root: ET.Element,
    resolver: Resolver,
    *,
    stats_by_file: Mapping[Path, MeshStats | MeshError],
    words_are_zero: bool = False,
) -> ParsedElements:
    """Parse the links, joints and materials of a `<robot>` element.

    Args:
        root: the `<robot>` element.
        resolver: finds the files that the description names.
        stats_by_file: statistics of mesh files, kept by reference: a file's are added when they are needed.
        words_are_zero: read every word among numbers as 0.
    """
    numbers = NumberParser(words_are_zero=words_are_zero)
    parser = _Parser(numbers=numbers, resolver=resolver, stats_by_file=stats_by_file)
    links = tuple(_link(element, parser) for element in root.findall("link"))
    joints = tuple(_joint(element, numbers) for element in root.findall("joint"))
    materials = [_material(element, "", parser) for element in root.findall("material")]
    for link in links:
        for visual in link.visuals:
            material = visual.element.find("material")
            if material is not None:
                materials.append(_material(material, link.name, parser))
    return ParsedElements(
        links=links, joints=joints, materials=tuple(materials), number_faults=tuple(numbers.faults)
    )


def _name(element: ET.Element) -> str:
    return element.get("name") or ""


def _children(element: ET.Element, tag: str) -> list[ET.Element]:
    """Children of the first child of this tag."""
    child = element.find(tag)
    return [] if child is None else list(child)


def origin_of(parent: ET.Element, numbers: NumberParser) -> Pose:
    """The `<origin>` of an element; the identity where there is none."""
    element = parent.find("origin")
    if element is None:
        return Pose()
    position = cast(Vector3, numbers.vector(element, "xyz", 3) or (0.0, 0.0, 0.0))
    quaternion = numbers.vector(element, "quat_xyzw", 4)
    if quaternion is not None:
        unit = unit_quaternion(quaternion)
        if unit is None:
            message = '<origin quat_xyzw="0 0 0 0"> is no rotation'
            numbers.record(element, "quat_xyzw", "wrong", message, "give a unit quaternion")
            return Pose(position=position)
        length = math.hypot(*quaternion)
        if abs(length - 1.0) > UNIT_TOLERANCE:
            message = f"<origin quat_xyzw> has length {length:.6g}; scaled to unit length"
            numbers.record(element, "quat_xyzw", "sloppy", message)
        return Pose(position=position, quaternion=unit)
    rpy = cast(Vector3 | None, numbers.vector(element, "rpy", 3))
    if rpy is None:
        return Pose(position=position)
    turned = cast(Quaternion, tuple(quaternion_from_rpy(rpy).tolist()))
    return Pose(position=position, quaternion=turned, rpy=rpy)


def _link(element: ET.Element, parser: _Parser) -> LinkElement:
    name, numbers = _name(element), parser.numbers
    numbers.enter(f'link "{name}"', name)
    contact: dict[str, float | None] = {}
    for child in _children(element, "contact"):
        if child.tag in CONTACT_TAGS:
            contact.setdefault(child.tag, numbers.number(child, "value"))
    shapes = [_shape(child, name, parser) for child in element if child.tag in ("visual", "collision")]
    inertial = element.find("inertial")
    return LinkElement(
        element=element,
        name=name,
        inertial=None if inertial is None else _inertial(inertial, numbers),
        shapes=tuple(shapes),
        contact=contact,
    )


def _inertial(element: ET.Element, numbers: NumberParser) -> InertialElement:
    inertia = element.find("inertia")
    return InertialElement(
        element=element,
        mass=numbers.number(element.find("mass"), "value"),
        pose=origin_of(element, numbers),
        inertia=inertia,
        moments=tuple(numbers.number(inertia, key) for key in INERTIA_KEYS),
    )


def _shape(element: ET.Element, link: str, parser: _Parser) -> ShapeElement:
    numbers, geometry = parser.numbers, _geometry(element)
    mesh: MeshElement | None = None
    sizes: tuple[float | None, ...] = ()
    normal: tuple[float, ...] | None = None
    if geometry is not None:
        if geometry.tag == "mesh":
            mesh = _mesh(geometry, parser)
        elif geometry.tag == "box":
            sizes = numbers.vector(geometry, "size", 3) or (None, None, None)
        elif geometry.tag == "plane":
            normal = numbers.vector(geometry, "normal", 3)
        else:
            sizes = tuple(numbers.number(geometry, key) for key in _SIZES.get(geometry.tag, ()))
    return ShapeElement(
        element=element,
        kind=element.tag,
        link=link,
        geometry=geometry,
        pose=origin_of(element, numbers),
        sizes=sizes,
        normal=normal,
        mesh=mesh,
    )


def _geometry(shape: ET.Element) -> ET.Element | None:
    children = [child for child in _children(shape, "geometry") if isinstance(child.tag, str)]
    known = (child for child in children if child.tag in GEOMETRY_TAGS)
    return next(known, children[0] if children else None)


def _mesh(element: ET.Element, parser: _Parser) -> MeshElement:
    uri, numbers = element.get("filename") or "", parser.numbers
    if len((element.get("scale") or "").split()) == 1:  # one number for all three axes, as Bullet reads it
        factor = numbers.number(element, "scale")
        scale = (1.0, 1.0, 1.0) if factor is None else (factor, factor, factor)
    else:
        scale = numbers.vector(element, "scale", 3) or (1.0, 1.0, 1.0)
    return MeshElement(
        element=element,
        uri=uri,
        found=parser.file(uri),
        scale=scale,
        stats_by_file=parser.stats_by_file,
    )


def _material(element: ET.Element, link: str, parser: _Parser) -> MaterialElement:
    name, numbers = _name(element), parser.numbers
    numbers.enter(f'material "{name}"', *((link,) if link else ()))
    color, texture = element.find("color"), element.find("texture")
    count = 0 if color is None else len((color.get("rgba") or "").split())
    uri = None if texture is None else texture.get("filename")
    return MaterialElement(
        element=element,
        link=link,
        name=name,
        rgba=numbers.vector(color, "rgba", 3 if count == 3 else 4),
        texture=parser.file(uri) if uri else None,
    )


def _joint(element: ET.Element, numbers: NumberParser) -> JointElement:
    name = _name(element)
    parent, child = element.find("parent"), element.find("child")
    limit, dynamics, mimic = element.find("limit"), element.find("dynamics"), element.find("mimic")
    child_name = "" if child is None else child.get("link") or ""
    numbers.enter(f'joint "{name}"', *((child_name,) if child_name else ()))
    multiplier = numbers.number(mimic, "multiplier")
    return JointElement(
        element=element,
        name=name,
        type=plain_type(element.get("type") or ""),
        parent="" if parent is None else parent.get("link") or "",
        child=child_name,
        pose=origin_of(element, numbers),
        axis=numbers.vector(element.find("axis"), "xyz", 3),
        limit=limit,
        lower=numbers.number(limit, "lower"),
        upper=numbers.number(limit, "upper"),
        effort=numbers.number(limit, "effort"),
        velocity=numbers.number(limit, "velocity"),
        damping=numbers.number(dynamics, "damping"),
        friction=numbers.number(dynamics, "friction"),
        mimic=mimic,
        mimic_of="" if mimic is None else mimic.get("joint") or "",
        multiplier=1.0 if multiplier is None else multiplier,
        offset=numbers.number(mimic, "offset") or 0.0,
    )
