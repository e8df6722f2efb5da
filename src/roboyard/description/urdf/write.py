"""Write a `RobotDescription` as URDF, with everything that reading it kept."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import assert_never

import numpy as np

from roboyard.description.model import (
    CONTACT_TAGS,
    INERTIA_KEYS,
    TYPES_WITH_AXIS,
    Attributes,
    Box,
    Capsule,
    Collision,
    Contact,
    Cylinder,
    Geometry,
    Heightfield,
    Inertial,
    Joint,
    Limit,
    Link,
    LoopJoint,
    Material,
    Mesh,
    Mimic,
    Plane,
    Pose,
    RobotDescription,
    Sphere,
    Visual,
)
from roboyard.errors import DescriptionError
from roboyard.transforms import matrix_from_quaternion, quaternion_from_rpy, rpy_from_matrix


def write_urdf(description: RobotDescription, path: Path | str) -> None:
    """Write the description to `path` as UTF-8 URDF.

    `load_description(path)` from the same folder returns equal data: numbers are written with as many digits
    as they need, file names as they were (`Mesh.uri`, `Material.texture_uri`), unread XML from `extra` and
    `attributes`.

    Raises:
        DescriptionError: the description holds a heightfield, or a mesh without a file name.
    """
    root = to_element(description)
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode", short_empty_elements=True)
    Path(path).write_text(f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n', encoding="utf-8")


def to_element(description: RobotDescription) -> ET.Element:
    """The description as a `<robot>` element: materials, then links, joints and the rest, in file order."""
    root = _element("robot", {"name": description.name}, description.attributes)
    root.extend([_material(material) for material in description.materials])
    root.extend([_link(link) for link in description.links])
    root.extend([_joint(joint) for joint in description.joints])
    root.extend([_loop(loop) for loop in description.loops])
    root.extend([copy.deepcopy(element) for element in description.extra])
    return root


def mimic_element(mimic: Mimic) -> ET.Element:
    """A `<mimic>` element."""
    return ET.Element(
        "mimic", {"joint": mimic.joint, "multiplier": _text(mimic.multiplier), "offset": _text(mimic.offset)}
    )


def _element(tag: str, attributes: dict[str, str], unread: Attributes = ()) -> ET.Element:
    return ET.Element(tag, {**attributes, **dict(unread)})


def _number(value: float) -> str:
    """The shortest text that reads back as the same number."""
    text = repr(float(value))
    return text.removesuffix(".0")


def _text(value: float | Iterable[float]) -> str:
    return _number(value) if isinstance(value, float | int) else " ".join(_number(v) for v in value)


def _merge(element: ET.Element, extra: Sequence[ET.Element]) -> ET.Element:
    """Append unread children; the unread part of an element that was written goes back into it."""
    for child in extra:
        written = element.find(child.tag) if child.tag not in ("visual", "collision") else None
        if written is not None and _is_part(child, written):
            written.attrib.update(child.attrib)
            _merge(written, list(child))
        else:
            element.append(copy.deepcopy(child))
    return element


def _is_part(child: ET.Element, written: ET.Element) -> bool:
    """True where `child` adds to `written` without contradicting it."""
    return not set(child.attrib) & set(written.attrib) and not (child.text or "").strip()


def _link(link: Link) -> ET.Element:
    element = _element("link", {"name": link.name}, link.attributes)
    if link.inertial is not None:
        element.append(_inertial(link.inertial))
    element.extend([_visual(visual) for visual in link.visuals])
    element.extend([_collision(collision) for collision in link.collisions])
    if link.contact is not None:
        element.append(_contact(link.contact))
    return _merge(element, link.extra)


def _inertial(inertial: Inertial) -> ET.Element:
    element = ET.Element("inertial")
    element.extend(_origin(inertial.origin))
    ET.SubElement(element, "mass", value=_text(inertial.mass))
    tensor = {key: _text(value) for key, value in zip(INERTIA_KEYS, inertial.inertia, strict=True)}
    ET.SubElement(element, "inertia", tensor)
    return element


def _contact(contact: Contact) -> ET.Element:
    element = ET.Element("contact")
    for tag in CONTACT_TAGS:
        value = getattr(contact, tag)
        if value is not None:
            ET.SubElement(element, tag, value=_text(value))
    return element


def _visual(visual: Visual) -> ET.Element:
    element = _shape("visual", visual)
    if visual.material is not None:
        element.append(_material(visual.material))
    return _merge(element, visual.extra)


def _collision(collision: Collision) -> ET.Element:
    element = _shape("collision", collision)
    if collision.concave:
        element.set("concave", "yes")
    return _merge(element, collision.extra)


def _shape(tag: str, shape: Visual | Collision) -> ET.Element:
    element = _element(tag, {} if shape.name is None else {"name": shape.name}, shape.attributes)
    element.extend(_origin(shape.origin))
    ET.SubElement(element, "geometry").append(_geometry(shape.geometry))
    return element


def _geometry(geometry: Geometry) -> ET.Element:
    match geometry:
        case Box(size=size):
            return ET.Element("box", size=_text(size))
        case Sphere(radius=radius):
            return ET.Element("sphere", radius=_text(radius))
        case Cylinder(radius=radius, length=length):
            return ET.Element("cylinder", radius=_text(radius), length=_text(length))
        case Capsule(radius=radius, length=length):
            return ET.Element("capsule", radius=_text(radius), length=_text(length))
        case Plane(normal=normal):
            return ET.Element("plane", normal=_text(normal))
        case Mesh(uri=uri, scale=scale):
            if not uri:
                raise DescriptionError(
                    f"a mesh made in memory has no file name ({uri!r}); save it and set Mesh.uri"
                )
            factors = {} if scale == (1.0, 1.0, 1.0) else {"scale": _text(scale)}
            return ET.Element("mesh", {"filename": uri, **factors})
        case Heightfield():
            size = " x ".join(map(str, geometry.heights.shape))
            raise DescriptionError(f"URDF has no heightfields ({size}); write the terrain as a mesh")
        case _:
            assert_never(geometry)


def _material(material: Material) -> ET.Element:
    element = ET.Element("material", {} if material.name is None else {"name": material.name})
    if material.rgba is not None:
        ET.SubElement(element, "color", rgba=_text(material.rgba))
    if material.texture_uri is not None:
        ET.SubElement(element, "texture", filename=material.texture_uri)
    return _merge(element, material.extra)


def _joint(joint: Joint) -> ET.Element:
    element = _element("joint", {"name": joint.name, "type": joint.type}, joint.attributes)
    element.extend(_origin(joint.origin))
    ET.SubElement(element, "parent", link=joint.parent)
    ET.SubElement(element, "child", link=joint.child)
    if joint.type in TYPES_WITH_AXIS:
        ET.SubElement(element, "axis", xyz=_text(joint.axis))
    if joint.limit is not None:
        element.append(_limit(joint.limit))
    if joint.damping or joint.friction:
        ET.SubElement(element, "dynamics", damping=_text(joint.damping), friction=_text(joint.friction))
    if joint.mimic is not None:
        element.append(mimic_element(joint.mimic))
    return _merge(element, joint.extra)


def _loop(loop: LoopJoint) -> ET.Element:
    """A `<loop>`, as extensions of URDF for loops of links write it."""
    element = ET.Element("loop", {"name": loop.name, "type": loop.type})
    ends = (("predecessor", loop.first, loop.first_origin), ("successor", loop.second, loop.second_origin))
    for tag, link, pose in ends:
        ET.SubElement(element, tag, link=link).extend(_origin(pose))
    if loop.type == "revolute":
        ET.SubElement(element, "axis", xyz=_text(loop.axis))
    return element


def _limit(limit: Limit) -> ET.Element:
    element = ET.Element("limit")
    for key in ("lower", "upper", "effort", "velocity"):
        value = getattr(limit, key)
        if value is not None:
            element.set(key, _text(value))
    return element


def _origin(pose: Pose) -> list[ET.Element]:
    """An `<origin>`, with roll, pitch and yaw as read where they still hold; none for the identity."""
    rpy = pose.rpy
    if rpy is None or not _same_rotation(quaternion_from_rpy(rpy), pose.quaternion):
        identity = pose.quaternion == (0.0, 0.0, 0.0, 1.0)
        rpy = None if identity else tuple(rpy_from_matrix(matrix_from_quaternion(pose.quaternion)).tolist())
    if rpy is None and pose.position == (0.0, 0.0, 0.0):
        return []
    element = ET.Element("origin", xyz=_text(pose.position))
    if rpy is not None:
        element.set("rpy", _text(rpy))
    return [element]


def _same_rotation(a: np.ndarray, b: Sequence[float]) -> bool:
    """True where two unit quaternions are the same rotation to 1e-9."""
    return bool(abs(abs(np.dot(a, b)) - 1.0) < 1e-9)
