"""Second stage of reading a URDF: turn its elements into a `RobotDescription`, or raise.

Dialect: URDF as ROS documents it (wiki.ros.org/urdf/XML) with PyBullet's additions (`<contact>`, `<capsule>`,
`<plane>`, `concave="yes"`, spherical joints). Input with only one possible meaning is read and noted; all
other faults are errors, and one run reports all of them.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from roboyard.description.model import Joint, Link, LoopJoint, Material, RobotDescription
from roboyard.description.urdf.build_context import BuildContext, MissingMeshes, unread_attributes
from roboyard.description.urdf.build_joint import build_joint, drop_unusable_mimics
from roboyard.description.urdf.build_link import build_link, build_material, resolve_materials
from roboyard.description.urdf.build_loops import build_loop
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.problems import Problems
from roboyard.description.urdf.tree_problems import report_tree_problems
from roboyard.description.urdf.xml import is_xacro, line_of, xacro_colours
from roboyard.errors import DescriptionError


def build_description(
    elements: UrdfElements, *, missing_meshes: MissingMeshes = "error", strict: bool = False
) -> RobotDescription:
    """Build the description of a parsed URDF.

    Args:
        elements: of the file.
        missing_meshes: "error", or "note" to keep such shapes with `Mesh.path` None.
        strict: raise an error for everything that would otherwise be corrected and noted.

    Raises:
        DescriptionError: the robot cannot be used; `problems` lists everything that is wrong with it.
    """
    if elements.refusal is not None:
        raise elements.refusal
    root = elements.root
    if root.tag != "robot":
        raise DescriptionError(
            f"the root element is <{_short(root.tag)}>, not <robot>; give a URDF",
            file=elements.file,
            line=line_of(root),
        )
    cosmetic = _refuse_xacro(root, elements)
    problems = Problems(elements.file, elements.number_faults, strict=strict)
    if cosmetic:
        problems.note(
            cosmetic[0],
            "robot",
            f"<{_short(str(cosmetic[0].tag))}> is xacro that was not expanded, in {len(cosmetic)} visual "
            "shapes; omitted",
        )
    for note in elements.xml_notes:
        problems.note(None, "", note)
    materials = {material.element: material for material in elements.materials}
    context = BuildContext(
        problems=problems,
        materials=materials,
        missing_meshes=missing_meshes,
        as_bullet=elements.words_are_zero,
    )
    return _build_robot(elements, context)


def _refuse_xacro(root: ET.Element, elements: UrdfElements) -> list[ET.Element]:
    """Return the unexpanded macros of the colours of visual shapes.

    Where words are read as Bullet reads them, other xacro elements are unknown elements, which it skips.

    Raises:
        DescriptionError: there is another xacro element.
    """
    colours = xacro_colours(root)
    if elements.words_are_zero:
        return colours
    known = {id(element) for element in colours}
    for element in root.iter():
        if is_xacro(element) and id(element) not in known:
            raise DescriptionError(
                f"<{_short(element.tag)}> is xacro; expand it first: xacro FILE.xacro > FILE.urdf",
                file=elements.file,
                line=line_of(element),
            )
    return colours


def _short(tag: str) -> str:
    return tag if len(tag) <= 60 else tag[:57] + "..."


def _build_robot(elements: UrdfElements, context: BuildContext) -> RobotDescription:
    problems, root = context.problems, elements.root
    name = root.get("name")
    if name is None:
        name = elements.file.stem if elements.file is not None else "robot"
        problems.note(root, "robot", f"<robot> has no name; called {name!r}")
    links: list[Link] = []
    joints: list[Joint] = []
    loops: list[LoopJoint] = []
    materials: list[Material] = []
    extra: list[ET.Element] = []
    link_elements, joint_elements = iter(elements.links), iter(elements.joints)
    is_complete = True
    for element in root:  # in file order, which is the order of the report
        if element.tag == "link":
            link = build_link(next(link_elements), context)
            is_complete &= link is not None
            links += [] if link is None else [link]
        elif element.tag == "joint":
            joint = build_joint(next(joint_elements), problems)
            is_complete &= joint is not None
            joints += [] if joint is None else [joint]
        elif element.tag == "material":
            materials.append(build_material(context.materials[element], problems))
        elif element.tag == "loop":
            loop = build_loop(element, elements.link_by_name, problems)
            loops += [] if loop is None else [loop]
            extra += [element] if loop is None else []
        elif isinstance(element.tag, str):
            extra.append(element)
    if not elements.links:
        problems.error(root, "robot", "there is no <link>; a robot needs at least one link")
    elif is_complete:
        report_tree_problems(elements, problems)
    problems.raise_errors()
    joints = drop_unusable_mimics(joints, elements, problems)
    links = resolve_materials(links, materials, problems)
    problems.raise_errors()
    return RobotDescription(
        name=name,
        links=tuple(links),
        joints=tuple(joints),
        loops=tuple(loops),
        materials=tuple(materials),
        extra=tuple(extra),
        attributes=unread_attributes(root, "name"),
        source=problems.source(root),
        notes=tuple(problems.notes),
    )
