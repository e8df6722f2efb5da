"""Names that other tools cannot bear become plain ones.

Blanks, parentheses, accents and the like go. What only USD forbids (`-`, `.`, a digit in front, the `/` of
ROS name spaces) stays: the USD writer finds its own identifiers and keeps the name beside them.
"""

from __future__ import annotations

import re
from dataclasses import replace

from roboyard.audit.renames import Renames, distinct_names
from roboyard.description.model import Joint, RobotDescription

_BEARABLE = re.compile(r"/?[A-Za-z0-9_][A-Za-z0-9_.-]*(/[A-Za-z0-9_][A-Za-z0-9_.-]*)*")


def planned_names(description: RobotDescription) -> Renames:
    """What is renamed; the new names are distinct from each other and from all that stay."""
    return Renames(
        links=distinct_names((link.name for link in description.links), _BEARABLE),
        joints=distinct_names((joint.name for joint in description.joints), _BEARABLE),
    )


def renamed(description: RobotDescription, renames: Renames) -> RobotDescription:
    """The description with new names everywhere a name stands."""
    if not renames.links and not renames.joints:
        return description
    links, joints = renames.links, renames.joints

    def joint_renamed(joint: Joint) -> Joint:
        mimic = joint.mimic
        if mimic is not None:
            mimic = replace(mimic, joint=joints.get(mimic.joint, mimic.joint))
        return replace(
            joint,
            name=joints.get(joint.name, joint.name),
            parent=links.get(joint.parent, joint.parent),
            child=links.get(joint.child, joint.child),
            mimic=mimic,
        )

    return replace(
        description,
        links=tuple(replace(link, name=links.get(link.name, link.name)) for link in description.links),
        joints=tuple(joint_renamed(joint) for joint in description.joints),
    )
