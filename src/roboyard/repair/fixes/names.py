"""Names of links and joints, and everything that refers to them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence

from roboyard.audit.registry import Fault
from roboyard.audit.renames import planned_renames
from roboyard.description.urdf.elements import JointElement, LinkElement
from roboyard.repair.registry import Changes, RepairContext, change, fix


def link_references(root: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    """Every (element, attribute) that holds a link's name."""
    for link in root.iterfind("link"):
        yield link, "name"
    for joint in root.iterfind("joint"):
        for tag in ("parent", "child"):
            for element in joint.iterfind(tag):
                yield element, "link"
    for gazebo in root.iterfind("gazebo"):
        yield gazebo, "reference"
    for sensor in root.iterfind("sensor"):
        for element in sensor.iterfind("parent"):
            yield element, "link"


def joint_references(root: ET.Element) -> Iterator[tuple[ET.Element, str]]:
    """Every (element, attribute) that holds a joint's name."""
    for joint in root.iterfind("joint"):
        yield joint, "name"
        for element in joint.iterfind("mimic"):
            yield element, "joint"
    for tag in ("transmission", "ros2_control"):
        for holder in root.iterfind(tag):
            for element in holder.iterfind("joint"):
                yield element, "name"
    for gazebo in root.iterfind("gazebo"):
        yield gazebo, "reference"


def rename(references: Iterator[tuple[ET.Element, str]], renames: Mapping[str, str]) -> None:
    """Put the new names in place of the old ones."""
    for element, attribute in list(references):
        new = renames.get(element.get(attribute) or "")
        if new is not None:
            element.set(attribute, new)


@fix("link-name-odd")
def plain_link_names(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Rename links to identifiers."""
    context.link_renames.update(planned_renames(context.urdf).links)
    rename(link_references(context.urdf.root), context.link_renames)
    for fault in faults:
        assert isinstance(fault.at, LinkElement)
        yield change(fault, fault.at.name, context.link_renames[fault.at.name])


@fix("joint-name-odd")
def plain_joint_names(context: RepairContext, faults: Sequence[Fault]) -> Changes:
    """Rename joints to identifiers."""
    context.joint_renames.update(planned_renames(context.urdf).joints)
    rename(joint_references(context.urdf.root), context.joint_renames)
    for fault in faults:
        assert isinstance(fault.at, JointElement)
        yield change(fault, fault.at.name, context.joint_renames[fault.at.name])
