"""Read a URDF file into a `RobotDescription`.

Dialect: URDF as ROS documents it (wiki.ros.org/urdf/XML) with PyBullet's additions (`<contact>`, `<capsule>`,
`<plane>`, `concave="yes"`, spherical joints). What can be read only one way is read and noted; what cannot be
is an error, and one run reports all of them.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

from roboyard.description.model import RobotDescription
from roboyard.description.urdf.build_context import Context, unread_attributes
from roboyard.description.urdf.build_joint import read_joint
from roboyard.description.urdf.build_link import read_link, read_material, resolve_materials
from roboyard.description.urdf.tree import check_tree, drop_unusable_mimics
from roboyard.description.urdf.xml import line_of
from roboyard.errors import DescriptionError


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


def read_urdf(root: ET.Element, context: Context) -> RobotDescription:
    """Read a `<robot>` element.

    Raises:
        DescriptionError: the robot cannot be used; `problems` lists everything that is wrong with it.
    """
    problems = context.problems
    _refuse_xacro(root, problems.file)
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
