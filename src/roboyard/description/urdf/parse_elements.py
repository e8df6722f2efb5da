"""Read a draft: what is there, right or wrong."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

from roboyard.description.files.resolver import Resolver
from roboyard.description.model import CONTACT_TAGS, INERTIA_KEYS
from roboyard.description.urdf.build_context import read_pose
from roboyard.description.urdf.elements import (
    InertialElement,
    JointElement,
    LinkElement,
    Location,
    MaterialElement,
    MeshUse,
    NumberFault,
    ShapeElement,
    UrdfElements,
    plain_type,
)
from roboyard.description.urdf.numbers import read_number, read_vector
from roboyard.description.urdf.problems import Problems
from roboyard.description.urdf.xml import line_of
from roboyard.errors import DescriptionError, MeshError
from roboyard.shapes.mesh_stats import MeshStats
from roboyard.transforms import Array


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
        place = Location(who=element, line=line, link_names=self.links)
        self.faults.append(NumberFault(at=place, message=message, fatal=fatal))


def parse_elements(
    file: Path,
    root: ET.Element,
    xml_notes: tuple[str, ...],
    resolver: Resolver,
    *,
    known_meshes: Mapping[Path, MeshStats | MeshError] | None = None,
) -> UrdfElements:
    """Read what is there; mesh files are opened too, but for those that are known."""
    recorder = _Recorder(file)
    meshes: dict[Path, MeshStats | MeshError] = dict(known_meshes or {})
    links = tuple(_link(element, recorder, resolver, meshes) for element in root.findall("link"))
    joints = tuple(_joint(element, recorder) for element in root.findall("joint"))
    draft = UrdfElements(
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


def refused(file: Path, error: DescriptionError, resolver: Resolver) -> UrdfElements:
    """A draft of nothing, for a file that cannot be read."""
    return UrdfElements(
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


def _materials(root: ET.Element, recorder: _Recorder, resolver: Resolver) -> tuple[MaterialElement, ...]:
    found = [("", element) for element in root.findall("material")]
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            found += [(_name(link), element) for element in visual.findall("material")[:1]]
    return tuple(_material(element, link, recorder, resolver) for link, element in found)


def _material(element: ET.Element, link: str, recorder: _Recorder, resolver: Resolver) -> MaterialElement:
    name = _name(element)
    recorder.links = (link,) if link else ()
    color, texture = element.find("color"), element.find("texture")
    rgba: tuple[float, ...] | None = None
    if color is not None and (text := color.get("rgba")):
        size = 3 if len(text.split()) == 3 else 4
        rgba = read_vector(color, "rgba", size, f'material "{name}"', recorder)
    uri = None if texture is None else texture.get("filename")
    return MaterialElement(
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
    element: ET.Element, recorder: _Recorder, resolver: Resolver, meshes: Mapping[Path, MeshStats | MeshError]
) -> LinkElement:
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
    return LinkElement(
        element=element,
        name=name,
        inertial=None if inertial is None else _inertial(inertial, who, recorder),
        shapes=tuple(shapes),
    )


def _inertial(element: ET.Element, who: str, recorder: _Recorder) -> InertialElement:
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
    return InertialElement(
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
    meshes: Mapping[Path, MeshStats | MeshError],
) -> ShapeElement:
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
    return ShapeElement(
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


def _joint(element: ET.Element, recorder: _Recorder) -> JointElement:
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
    return JointElement(
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
