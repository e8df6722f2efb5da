"""The semantic description (SRDF)."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from roboyard.export.moveit.groups import Group

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel


def srdf_text(robot: RobotModel, groups: Sequence[Group]) -> str:
    """Return an SRDF."""
    description, semantic = robot.description, robot.semantic
    root = ET.Element("robot", name=description.name)
    for group in groups:
        element = ET.SubElement(root, "group", name=group.name)
        if group.chain is not None:
            ET.SubElement(element, "chain", base_link=group.chain[0], tip_link=group.chain[1])
        else:
            for joint in group.joints:
                ET.SubElement(element, "joint", name=joint)
    for posture, positions in semantic.postures.items():
        for group in groups:
            own = {joint: positions[joint] for joint in group.joints if joint in positions}
            if len(own) < len(group.joints):
                continue
            state = ET.SubElement(root, "group_state", name=posture, group=group.name)
            for joint, value in own.items():
                ET.SubElement(state, "joint", name=joint, value=repr(float(value)))
    for group in groups:
        if group.kind == "gripper" and group.mount is not None:
            named = {} if group.arm is None else {"parent_group": group.arm}
            ET.SubElement(
                root,
                "end_effector",
                {"name": f"{group.name}_tool", "parent_link": group.mount, "group": group.name, **named},
            )
    if description.root.name != "world":
        kind = {"none": "fixed", "fixed": "fixed", "legged": "floating", "floating": "floating"}
        ET.SubElement(
            root,
            "virtual_joint",
            name="world_joint",
            type="fixed" if semantic.virtual_joints else kind.get(semantic.base, "planar"),
            parent_frame="world",
            child_link=description.root.name,
        )
    for joint in description.joints:
        if joint.is_moving and joint.mimic is None and robot.drives.get(joint.name, "none") == "none":
            ET.SubElement(root, "passive_joint", name=joint.name)
    for one, other, reason in _pairs(robot):
        ET.SubElement(root, "disable_collisions", link1=one, link2=other, reason=reason)
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _pairs(robot: RobotModel) -> Iterator[tuple[str, str, str]]:
    """Yield each pair of links with shapes that is not checked, once, with MoveIt's word for the reason."""
    description = robot.description
    shaped = {link.name for link in description.links if link.collisions}
    seen: set[frozenset[str]] = set()

    def fresh(one: str, other: str) -> bool:
        pair = frozenset((one, other))
        if len(pair) < 2 or pair in seen or not pair <= shaped:
            return False
        seen.add(pair)
        return True

    for link in description.links:  # a body of several links: the nearest shapes above count as adjacent
        above = description.parent_joint.get(link.name)
        while above is not None and above.parent not in shaped:
            above = description.parent_joint.get(above.parent)
        if above is not None and fresh(above.parent, link.name):
            yield above.parent, link.name, "Adjacent"
    for one, other in robot.semantic.disabled_collision_pairs:
        if fresh(one, other):
            yield one, other, "Default"
    ignored = robot.planning.ignore if robot.planning is not None else {}
    for one, others in ignored.items():
        for other in others:
            if fresh(one, other):
                yield one, other, "Never"
