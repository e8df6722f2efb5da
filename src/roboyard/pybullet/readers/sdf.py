"""SDF models as Bullet reads them: link poses relative to the model, joints at their child links.

Each model is converted to equivalent URDF elements, which the URDF reader builds.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from roboyard.description import load_description
from roboyard.description.model import RobotDescription
from roboyard.description.urdf.xml import LocatedElement, line_of, read_xml
from roboyard.errors import DescriptionError
from roboyard.transforms import Array, pose_matrix, quaternion_from_matrix, quaternion_from_rpy

_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_SHAPES: Mapping[str, Mapping[str, str]] = {
    "sphere": {"radius": "radius"},
    "box": {"size": "size"},
    "cylinder": {"radius": "radius", "length": "length"},
    "capsule": {"radius": "radius", "length": "length"},
    "mesh": {"uri": "filename", "scale": "scale"},
    "plane": {"normal": "normal"},
}
"""SDF shape to its child elements and the URDF attributes that they become."""
_LIMITS = ("lower", "upper", "effort", "velocity")


@dataclass(frozen=True, kw_only=True, slots=True)
class SdfModel:
    """One model of a file."""

    description: RobotDescription
    """The model as a robot."""
    pose: Array
    """(4, 4) pose of the root link frame in the world."""
    is_static: bool
    """Whether `<static>` fixes the base."""


def load_sdf(path: Path, search_paths: Sequence[Path] = ()) -> list[SdfModel]:
    """Return all models of a file (of its world, if it has one), in file order.

    Raises:
        DescriptionError: the file is not SDF, or a model cannot be built.
    """
    root, _ = read_xml(path)
    if root.tag != "sdf":
        raise DescriptionError(
            f"the root element is <{root.tag}>, expected <sdf>", file=path, line=line_of(root)
        )
    world = root.find("world")
    return [
        _read_model(model, path, [path.parent, *search_paths])
        for model in (root if world is None else world).findall("model")
    ]


def _read_model(model: ET.Element, path: Path, search_paths: Sequence[Path]) -> SdfModel:
    poses = {link.get("name", ""): _pose(link) for link in model.findall("link")}
    robot = _element("robot", model, name=model.get("name", ""))
    robot.extend(_link(link) for link in model.findall("link"))
    robot.extend(_joint(joint, poses) for joint in model.findall("joint"))
    try:
        description = load_description(
            robot, search_paths=search_paths, missing_meshes="note", words_are_zero=True
        )
    except DescriptionError as problem:
        raise DescriptionError(
            str(problem), file=path, line=line_of(model), element=f'model "{model.get("name", "")}"'
        ) from problem
    static = (_text(model, "static") or "0").lower()
    return SdfModel(
        description=description,
        pose=_pose(model) @ poses[description.root.name],
        is_static=static in ("1", "true"),
    )


def _link(link: ET.Element) -> ET.Element:
    made = _element("link", link, name=link.get("name", ""))
    inertial = link.find("inertial")
    if inertial is not None:
        part = _element("inertial", inertial)
        part.append(_origin(_pose(inertial)))
        part.append(_element("mass", inertial, value=_text(inertial, "mass") or "0"))
        tensor = inertial.find("inertia")
        values = {key: (_text(tensor, key) if tensor is not None else None) or "0" for key in _INERTIA}
        part.append(_element("inertia", inertial, **values))
        made.append(part)
    for tag in ("visual", "collision"):
        made.extend(_shape(shape, tag) for shape in link.findall(tag))
    contact = link.find("contact")
    if contact is not None:
        part = _element("contact", contact)
        for child in contact:
            value = child.get("value") or (child.text or "").strip()
            part.append(_element(child.tag, child, value=value))
        made.append(part)
    return made


def _shape(shape: ET.Element, tag: str) -> ET.Element:
    made = _element(tag, shape, name=shape.get("name", tag))
    made.append(_origin(_pose(shape)))
    geometry = shape.find("geometry")
    for kind in geometry if geometry is not None else ():
        if kind.tag in _SHAPES:
            values = {key: _text(kind, child) for child, key in _SHAPES[kind.tag].items()}
            part = _element("geometry", kind)
            part.append(_element(kind.tag, kind, **{k: v for k, v in values.items() if v is not None}))
            made.append(part)
            break
    diffuse = _text(shape, "material/diffuse")
    if tag == "visual" and diffuse is not None:
        colour = [*diffuse.split(), "1"][:4]
        material = _element("material", shape, name="")
        material.append(_element("color", shape, rgba=" ".join(colour)))
        made.append(material)
    return made


def _joint(joint: ET.Element, poses: Mapping[str, Array]) -> ET.Element:
    kind = joint.get("type", "")
    made = _element("joint", joint, name=joint.get("name", ""), type=kind)
    parent, child = _text(joint, "parent") or "", _text(joint, "child") or ""
    made.append(_element("parent", joint, link=parent))
    made.append(_element("child", joint, link=child))
    if parent in poses and child in poses:
        made.append(_origin(np.linalg.inv(poses[parent]) @ poses[child]))
    axis = joint.find("axis")
    if axis is None:
        return made
    made.append(_element("axis", axis, xyz=_text(axis, "xyz") or "1 0 0"))
    limit, dynamics = axis.find("limit"), axis.find("dynamics")
    if limit is not None and kind != "continuous":
        values = {key: _text(limit, key) for key in _LIMITS}
        made.append(_element("limit", limit, **{k: v for k, v in values.items() if v is not None}))
    if dynamics is not None:
        values = {key: _text(dynamics, key) for key in ("damping", "friction")}
        made.append(_element("dynamics", dynamics, **{k: v for k, v in values.items() if v is not None}))
    return made


def _element(tag: str, like: ET.Element, **attributes: str) -> ET.Element:
    """Return a new element with the line number of another one."""
    made = LocatedElement(tag, attributes)
    made.line = line_of(like)
    return made


def _text(element: ET.Element, path: str) -> str | None:
    found = element.find(path)
    return None if found is None or found.text is None else found.text.strip() or None


def _pose(element: ET.Element) -> Array:
    """Return the (4, 4) pose of an element's `<pose>`: x y z (m) roll pitch yaw (rad); default identity."""
    text = _text(element, "pose")
    if text is None:
        return np.eye(4)
    try:
        numbers = [float(token) for token in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) < 6 or not np.isfinite(numbers).all():
        raise DescriptionError(
            f"<pose>{text}</pose> must have six finite numbers: x y z roll pitch yaw", line=line_of(element)
        )
    return pose_matrix(numbers[:3], quaternion_from_rpy(numbers[3:6]))


def _origin(pose: Array) -> ET.Element:
    xyz = " ".join(repr(float(v)) for v in pose[:3, 3])
    quaternion = " ".join(repr(float(v)) for v in quaternion_from_matrix(pose[:3, :3]))
    return LocatedElement("origin", {"xyz": xyz, "quat_xyzw": quaternion})
