"""SDF models as Bullet reads them: link poses relative to the model, joints at their child links.

Each model is converted to equivalent URDF elements, which the URDF reader builds.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from roboyard._records import dataclass
from roboyard.description import load_description
from roboyard.description.files.resolver import Resolver
from roboyard.description.model import RobotDescription
from roboyard.description.sdf.parts import (
    axis_element,
    colour_element,
    dynamics_element,
    inertial_element,
    shape_element,
)
from roboyard.description.sdf.values import made, pose_of, text_of
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.xml import LocatedElement, line_of, read_xml
from roboyard.errors import DescriptionError
from roboyard.pybullet.bullet_rules.unreadable_meshes import (
    lacks_meshes,
    refuse_unknown_types,
    skips_meshes,
)
from roboyard.pybullet.state.file_search import folders_above
from roboyard.transforms import Array, quaternion_from_matrix

_LIMITS = ("lower", "upper", "effort", "velocity")


_CACHE_SIZE = 64


@dataclass(frozen=True, kw_only=True, slots=True)
class SdfModel:
    """One model of a file."""

    description: RobotDescription
    """The model as a robot."""
    pose: Array
    """(4, 4) pose of the root link frame in the world."""
    is_static: bool
    """Whether `<static>` fixes the base."""


_files: dict[tuple[Path, int, int], list[SdfModel]] = {}
"""By path, modification time and size."""


def read_models(
    path: Path, search_paths: Sequence[Path], readable: Sequence[Path] = (), *, uses_cache: bool
) -> list[SdfModel]:
    """Do what `load_sdf` does, once for a file that has not changed, whose bodies share descriptions.

    Args:
        path: SDF file.
        search_paths: folders where meshes are searched after the file's own.
        readable: folders whose files may be read, but in which nothing is searched.
        uses_cache: whether a file may be as it was when it was read before with the same time and size.

    Raises:
        DescriptionError: the file is not SDF, or a model cannot be built.
    """
    stamp = path.stat()
    key = path, stamp.st_mtime_ns, stamp.st_size
    known = _files.get(key) if uses_cache else None
    if known is None:
        known = load_sdf(path, search_paths, readable)
        if uses_cache and not any(part.description.notes for part in known):  # as of a mesh that was moved
            _files[key] = known
            while len(_files) > _CACHE_SIZE:
                del _files[next(iter(_files))]
    return known


def load_sdf(path: Path, search_paths: Sequence[Path] = (), readable: Sequence[Path] = ()) -> list[SdfModel]:
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
    resolvers = [
        Resolver.of_file(path, search_paths=folders, readable=readable)
        for folders in (search_paths, (*search_paths, *folders_above(path)))
    ]
    return [
        _read_model(model, path, resolvers) for model in (root if world is None else world).findall("model")
    ]


def _read_model(model: ET.Element, path: Path, resolvers: Sequence[Resolver]) -> SdfModel:
    poses = {link.get("name", ""): pose_of(link) for link in model.findall("link")}
    robot = made("robot", model, name=model.get("name", ""))
    robot.extend(_link(link) for link in model.findall("link"))
    robot.extend(_joint(joint, poses) for joint in model.findall("joint"))
    try:
        first, second = (
            UrdfElements(file=None, root=robot, resolver=resolver, words_are_zero=True)
            for resolver in resolvers
        )
        description = load_description(first, missing_meshes="note")
        if lacks_meshes(description, path.parent):
            description = load_description(second, missing_meshes="note")
            if lacks_meshes(description, path.parent):
                load_description(first)  # raises the error that says which, and where they were looked for
        refuse_unknown_types(description)
        skips_meshes(description)
    except DescriptionError as problem:
        raise DescriptionError(
            str(problem), file=path, line=line_of(model), element=f'model "{model.get("name", "")}"'
        ) from problem
    return SdfModel(
        description=description,
        pose=pose_of(model) @ poses[description.root.name],
        is_static=_is_one(text_of(model, "static") or ""),
    )


def _is_one(text: str) -> bool:
    """Return whether Bullet reads 1 as a whole number, which it does not of "true"."""
    try:
        return 1.0 <= float(text) < 2.0
    except ValueError:
        return False


def _link(link: ET.Element) -> ET.Element:
    element = made("link", link, name=link.get("name", ""))
    inertial = link.find("inertial")
    if inertial is not None:
        element.append(inertial_element(inertial, _origin(pose_of(inertial))))
    for tag in ("visual", "collision"):
        element.extend(_shape(shape, tag) for shape in link.findall(tag))
    contact = link.find("contact")
    if contact is not None:
        part = made("contact", contact)
        for child in contact:
            value = child.get("value") or (child.text or "").strip()
            part.append(made(child.tag, child, value=value))
        element.append(part)
    return element


def _shape(shape: ET.Element, tag: str) -> ET.Element:
    element = shape_element(shape, tag, _origin(pose_of(shape)))
    diffuse = text_of(shape, "material/diffuse")
    if tag == "visual" and diffuse is not None:
        element.append(colour_element(shape, " ".join([*diffuse.split(), "1"][:4])))
    return element


def _joint(joint: ET.Element, poses: Mapping[str, Array]) -> ET.Element:
    kind = joint.get("type", "")
    element = made("joint", joint, name=joint.get("name", ""), type=kind)
    parent, child = text_of(joint, "parent") or "", text_of(joint, "child") or ""
    element.append(made("parent", joint, link=parent))
    element.append(made("child", joint, link=child))
    if parent in poses and child in poses:
        element.append(_origin(np.linalg.inv(poses[parent]) @ poses[child]))
    axis = joint.find("axis")
    if axis is None or kind == "fixed":
        return element
    element.append(axis_element(axis, text_of(axis, "xyz") or "1 0 0"))
    limit, dynamics = axis.find("limit"), dynamics_element(axis)
    if limit is not None and kind != "continuous":
        values = {key: text_of(limit, key) for key in _LIMITS}
        element.append(made("limit", limit, **{k: v for k, v in values.items() if v is not None}))
    if dynamics is not None:
        element.append(dynamics)
    return element


def _origin(pose: Array) -> ET.Element:
    xyz = " ".join(repr(float(v)) for v in pose[:3, 3])
    quaternion = " ".join(repr(float(v)) for v in quaternion_from_matrix(pose[:3, :3]))
    return LocatedElement("origin", {"xyz": xyz, "quat_xyzw": quaternion})
