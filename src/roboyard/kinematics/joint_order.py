"""Orders of joints that other tools use; Roboyard itself keys joint values by name."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from roboyard.description.model import Joint, RobotDescription

ONE_NUMBER = ("revolute", "continuous", "prismatic")
"""Types of joints whose position is one number."""


def breadth_first_joints(description: RobotDescription) -> tuple[Joint, ...]:
    """All joints, level by level from the root, children in file order: PhysX's order of joint vectors."""
    ordered: list[Joint] = []
    level = [description.root.name]
    while level:
        joints = [joint for link in level for joint in description.child_joints[link]]
        ordered += joints
        level = [joint.child for joint in joints]
    return tuple(ordered)


def planned_joints(joints: Iterable[Joint], frozen: Collection[str] = ()) -> tuple[Joint, ...]:
    """Those of them that move by one number, without the ones named in `frozen`."""
    return tuple(joint for joint in joints if joint.type in ONE_NUMBER and joint.name not in frozen)
