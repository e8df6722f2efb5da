"""Names that other tools cannot bear become plain ones.

Blanks, parentheses, accents and the like go. What only USD forbids (`-`, `.`, a digit in front, the `/` of
ROS name spaces) stays: the USD writer finds its own identifiers and keeps the name beside them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from roboyard.urdf.auditing.renames import identifier
from roboyard.urdf.model import Joint, RobotDescription

_BEARABLE = re.compile(r"/?[A-Za-z0-9_][A-Za-z0-9_.-]*(/[A-Za-z0-9_][A-Za-z0-9_.-]*)*")


@dataclass(frozen=True, kw_only=True, slots=True)
class Renames:
    """Old name to new name, only where they differ; links and joints are two name spaces."""

    links: Mapping[str, str]
    joints: Mapping[str, str]


def planned_names(description: RobotDescription) -> Renames:
    """What is renamed; the new names are distinct from each other and from all that stay."""
    return Renames(
        links=_plan(link.name for link in description.links),
        joints=_plan(joint.name for joint in description.joints),
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


def _plan(names: Iterable[str]) -> dict[str, str]:
    all_names = list(names)
    taken = {name for name in all_names if _BEARABLE.fullmatch(name)}
    plan: dict[str, str] = {}
    for name in all_names:
        if name in taken:
            continue
        new = base = identifier(name)
        number = 0
        while new in taken:
            number += 1
            new = f"{base}_{number}"
        taken.add(new)
        plan[name] = new
    return plan
