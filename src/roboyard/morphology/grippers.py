"""Detect grippers from the joint tree: links at which a chain of joints splits into fingers.

Going out from the root, the first link is a gripper's base that has at least two moving branches, and more
driven joints between the root and itself than any of its branches has. A trunk with arms has fewer before
than after it; a gripper without an arm has none before it. Only the deepest chains count, so that eyes on a
short neck are no gripper.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from roboyard.description.model import Joint, RobotDescription
from roboyard.description.semantic import EndEffector
from roboyard.kinematics.description_poses import position_size

MIN_JOINTS_BEFORE = 3
"""Smallest number of driven joints between the root and a gripper; with fewer it is a stand."""
MIN_DEPTH = 0.75
"""Smallest number of joints before a gripper, as a share of the deepest gripper's."""


def find_grippers(description: RobotDescription, virtual: Collection[str] = ()) -> tuple[EndEffector, ...]:
    """Return the grippers in depth-first order, each with the links of its fingers; empty without any.

    Gripper joints stay empty: which joints open a gripper is a choice of the user's.

    Args:
        description: the robot.
        virtual: names of the joints that represent the motion of the base; they count as not driven.
    """
    before, after, moving = _depths(description, virtual)
    found: list[str] = []
    open_links = [description.root.name]
    while open_links:
        link = open_links.pop()
        joints = description.child_joints.get(link, ())
        branches = sum(moving[joint.name] for joint in joints)
        if branches > 1 and before[link] >= MIN_JOINTS_BEFORE and after[link] < before[link]:
            found.append(link)
            continue
        open_links += [joint.child for joint in reversed(joints)]
    deepest = max((before[link] for link in found), default=0)
    return tuple(_gripper(description, link) for link in found if before[link] >= MIN_DEPTH * deepest)


def _is_driven(joint: Joint) -> bool:
    """Return whether a joint has one degree of freedom and no leader."""
    return position_size(joint) == 1 and joint.mimic is None


def _depths(
    description: RobotDescription, virtual: Collection[str]
) -> tuple[Mapping[str, int], Mapping[str, int], Mapping[str, bool]]:
    """Return three mappings: link to the number of driven joints before it, link to the largest number of
    driven joints after it, and joint to whether it or a joint after it moves.
    """
    before = {description.root.name: 0}
    for joint in description.depth_first_joints:
        counts = _is_driven(joint) and joint.name not in virtual
        before[joint.child] = before[joint.parent] + int(counts)
    after = dict.fromkeys(before, 0)
    moving: dict[str, bool] = {}
    for joint in reversed(description.depth_first_joints):
        after[joint.parent] = max(after[joint.parent], after[joint.child] + int(_is_driven(joint)))
        further = description.child_joints.get(joint.child, ())
        moving[joint.name] = joint.is_moving or any(moving[next_joint.name] for next_joint in further)
    return before, after, moving


def _gripper(description: RobotDescription, link: str) -> EndEffector:
    """Return the gripper whose base is `link`, with every link that moves relative to it."""
    below: list[Joint] = []
    moved: set[str] = set()
    open_joints = list(reversed(description.child_joints.get(link, ())))
    while open_joints:
        joint = open_joints.pop()
        below.append(joint)
        if joint.is_moving or joint.parent in moved:
            moved.add(joint.child)
        open_joints += reversed(description.child_joints.get(joint.child, ()))
    return EndEffector(
        link=link,
        gripper_links=tuple(joint.child for joint in below if joint.child in moved),
    )
