"""Read a URDF file into a `RobotDescription`.

Dialect: URDF as ROS documents it (wiki.ros.org/urdf/XML) with PyBullet's additions (`<contact>`, `<capsule>`,
`<plane>`, `concave="yes"`, spherical joints). What can be read only one way is read and noted; what cannot be
is an error, and one run reports all of them.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from roboyard.description.files.resolver import Resolver
from roboyard.description.model import RobotDescription
from roboyard.description.urdf.problems import Problems
from roboyard.description.urdf.read_context import Context, unread_attributes
from roboyard.description.urdf.read_joint import read_joint
from roboyard.description.urdf.read_link import read_link, read_material, resolve_materials
from roboyard.description.urdf.tree import check_tree, drop_unusable_mimics
from roboyard.description.urdf.xml import line_of, read_xml
from roboyard.errors import DescriptionError

MissingMeshes = Literal["error", "note"]


def load_urdf(
    source: Path | str | ET.ElementTree | ET.Element,
    *,
    packages: Mapping[str, Path] | None = None,
    search_paths: Sequence[Path] = (),
    missing_meshes: MissingMeshes = "error",
    strict: bool = False,
    words_are_zero: bool = False,
) -> RobotDescription:
    """The robot that a URDF describes, its mesh files found but not yet opened.

    Args:
        source: a URDF file; or XML text (a string that starts with `<`); or a parsed tree.
        packages: ROS package name to folder, for `package://` and `model://`.
        search_paths: more folders in which to look for packages and files; see
        `roboyard.description.files.resolver`.
        missing_meshes: "error", or "note" to keep such shapes with `Mesh.path` None.
        strict: treat as an error everything that would otherwise be put right and noted.
        words_are_zero: read every word among numbers as 0, as Bullet does, unexpanded xacro included.

    Returns:
        The description; its `notes` tell what was put right. Masses, inertias and limits are as written, also
        impossible ones; axes are scaled to unit length; an absent `<limit>` is None.

    Raises:
        DescriptionError: the file cannot be used; `problems` lists everything that is wrong with it.
    """
    root, file, notes = _root_element(source)
    problems = Problems(file, strict=strict, words_are_zero=words_are_zero)
    for note in notes:
        problems.note(None, "", note)
    if root.tag != "robot":
        raise DescriptionError(
            f"the root element is <{_short(root.tag)}>, not <robot>; give a URDF",
            file=file,
            line=line_of(root),
        )
    _refuse_xacro(root, file)
    base = None if file is None else Path(file).absolute().parent
    real_base = None if file is None or not file.is_symlink() else file.resolve().parent
    context = Context(
        problems=problems,
        resolver=Resolver(
            base=base,
            real_base=real_base,
            packages={name: Path(folder) for name, folder in (packages or {}).items()},
            search_paths=[Path(folder) for folder in search_paths],
        ),
        missing_meshes=missing_meshes,
    )
    return _read_robot(root, context)


def _root_element(
    source: Path | str | ET.ElementTree | ET.Element,
) -> tuple[ET.Element, Path | None, tuple[str, ...]]:
    if isinstance(source, ET.Element):
        return source, None, ()
    if isinstance(source, ET.ElementTree):
        root = source.getroot()
        if root is None:
            raise DescriptionError("the tree is empty; a URDF starts with a <robot> element")
        return root, None, ()
    if isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<"):
        root, notes = read_xml(source)
        return root, None, notes
    file = Path(source)
    root, notes = read_xml(file)
    return root, file, notes


def _refuse_xacro(root: ET.Element, file: Path | None) -> None:
    for element in root.iter():
        if isinstance(element.tag, str) and re.match(r"xacro:|\{[^}]*xacro[^}]*\}", element.tag):
            raise DescriptionError(
                f"<{_short(element.tag)}> is xacro; expand it first: xacro FILE.xacro > FILE.urdf",
                file=file,
                line=line_of(element),
            )


def _short(tag: str) -> str:
    return tag if len(tag) <= 60 else tag[:57] + "..."


def _read_robot(root: ET.Element, context: Context) -> RobotDescription:
    problems = context.problems
    name = root.get("name")
    if name is None:
        name = problems.file.stem if problems.file is not None else "robot"
        problems.note(root, "robot", f"<robot> has no name; called {name!r}")
    links, joints, materials, extra = [], [], [], []
    for element in root:
        if element.tag == "link":
            links.append(read_link(element, context))
        elif element.tag == "joint":
            joints.append(read_joint(element, context))
        elif element.tag == "material":
            materials.append(read_material(element, context))
        elif isinstance(element.tag, str):
            extra.append(element)
    read_links = [link for link in links if link is not None]
    read_joints = [joint for joint in joints if joint is not None]
    if not links:
        problems.error(root, "robot", "there is no <link>; a robot needs at least one link")
    elif len(read_links) == len(links) and len(read_joints) == len(joints):
        check_tree(read_links, read_joints, problems)
    problems.raise_errors()
    read_joints = drop_unusable_mimics(read_joints, problems)
    read_links = resolve_materials(read_links, materials, context)
    problems.raise_errors()
    return RobotDescription(
        name=name,
        links=tuple(read_links),
        joints=tuple(read_joints),
        materials=tuple(materials),
        extra=tuple(extra),
        attributes=unread_attributes(root, "name"),
        source=problems.source(root),
        notes=tuple(problems.notes),
    )
