"""Hands of a robot that nobody described: where a chain of joints parts into fingers.

Going out from the root, the first link is a hand that has two moving branches or more, and more joints behind
it than any of its branches has in front. A trunk with arms has fewer behind it than in front, a hand on its
own none. What hangs from the deepest chains counts: eyes on a short neck are no hand.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from roboyard.description.model import Joint, RobotDescription
from roboyard.description.robot_model import EndEffector
from roboyard.kinematics.joint_models import position_size

LEAST_BEHIND = 3
"""Joints that carry a hand: with fewer it is a stand."""
AS_DEEP = 0.75
"""Share of the joints behind the deepest hand that the others have at least."""


def find_grippers(description: RobotDescription, virtual: Collection[str] = ()) -> tuple[EndEffector, ...]:
    """Hands in depth-first order, each with the links of its fingers; empty where there are none.

    How fingers are driven is for the user to say: their joints are left to no gripper.

    Args:
        virtual: joints that stand for the motion of the base and carry nothing.
    """
    behind, ahead, moving = _depths(description, virtual)
    found: list[str] = []
    todo = [description.root.name]
    while todo:
        link = todo.pop()
        joints = description.child_joints.get(link, ())
        branches = sum(moving[joint.name] for joint in joints)
        if branches > 1 and behind[link] >= LEAST_BEHIND and ahead[link] < behind[link]:
            found.append(link)
            continue
        todo += [joint.child for joint in reversed(joints)]
    deepest = max((behind[link] for link in found), default=0)
    return tuple(_hand(description, link) for link in found if behind[link] >= AS_DEEP * deepest)


def _drives(joint: Joint) -> bool:
    """Whether a joint is one that something of its own moves."""
    return position_size(joint) == 1 and joint.mimic is None


def _depths(
    description: RobotDescription, virtual: Collection[str]
) -> tuple[Mapping[str, int], Mapping[str, int], Mapping[str, bool]]:
    """Driven joints between the root and each link, at most from each link on, and whether a joint's branch
    moves at all.
    """
    behind = {description.root.name: 0}
    for joint in description.depth_first_joints:
        counts = _drives(joint) and joint.name not in virtual
        behind[joint.child] = behind[joint.parent] + int(counts)
    ahead = dict.fromkeys(behind, 0)
    moving: dict[str, bool] = {}
    for joint in reversed(description.depth_first_joints):
        ahead[joint.parent] = max(ahead[joint.parent], ahead[joint.child] + int(_drives(joint)))
        further = description.child_joints.get(joint.child, ())
        moving[joint.name] = joint.is_moving or any(moving[after.name] for after in further)
    return behind, ahead, moving


def _hand(description: RobotDescription, link: str) -> EndEffector:
    below: list[Joint] = []
    moved: set[str] = set()
    todo = list(reversed(description.child_joints.get(link, ())))
    while todo:
        joint = todo.pop()
        below.append(joint)
        if joint.is_moving or joint.parent in moved:
            moved.add(joint.child)
        todo += reversed(description.child_joints.get(joint.child, ()))
    return EndEffector(
        link=link,
        gripper_links=tuple(joint.child for joint in below if joint.child in moved),
    )
