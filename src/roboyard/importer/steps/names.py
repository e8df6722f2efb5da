"""Replace names that other tools do not accept.

Blanks, parentheses, accents and similar characters are removed. Characters that only USD forbids (`-`, `.`, a
leading digit, the `/` of ROS namespaces) are kept: the USD writer makes its own identifiers and stores the
name beside them.
"""

from __future__ import annotations

import re
from dataclasses import replace

from roboyard.audit.renames import Renames, distinct_names
from roboyard.description.loops import with_renamed_links
from roboyard.description.model import Joint, RobotDescription

_PORTABLE = re.compile(r"/?[A-Za-z0-9_][A-Za-z0-9_.-]*(/[A-Za-z0-9_][A-Za-z0-9_.-]*)*")


def planned_names(description: RobotDescription) -> Renames:
    """Return the renames; the new names differ from each other and from all names that are kept."""
    return Renames(
        links=distinct_names((link.name for link in description.links), _PORTABLE),
        joints=distinct_names((joint.name for joint in description.joints), _PORTABLE),
    )


def renamed(description: RobotDescription, renames: Renames) -> RobotDescription:
    """Return the description with the new names everywhere."""
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
        loops=with_renamed_links(description.loops, links),
    )
