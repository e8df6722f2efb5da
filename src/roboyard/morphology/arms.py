"""Arms and trunk of a robot: the chains of joints to its end effectors, and the joints that these share."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from itertools import chain as concatenate
from itertools import count

from roboyard.description.model import Joint, RobotDescription
from roboyard.description.semantic import Arm, EndEffector
from roboyard.kinematics.description_poses import chain
from roboyard.kinematics.joint_order import single_dof_joints

MIN_ARM_JOINTS = 4
"""Smallest number of joints of an arm without gripper."""
_SIDES = {"left": "left", "l": "left", "right": "right", "r": "right"}


def longest_chain_tip(description: RobotDescription) -> str:
    """Return the link with the most moving joints before it; the first in depth-first order among equals."""
    joints_before = {description.root.name: 0}
    for joint in description.depth_first_joints:
        counts = joint.is_moving and joint.mimic is None
        joints_before[joint.child] = joints_before[joint.parent] + int(counts)
    most = max(joints_before.values())
    return next(name for name, number in joints_before.items() if number == most)


def find_trunk(
    description: RobotDescription, base_link: str, end_effectors: Sequence[EndEffector]
) -> tuple[str, ...]:
    """Return the driven joints on all chains from the base to the end effectors; to the arms where those have
    none in common.

    Args:
        description: the robot.
        base_link: where the chains begin.
        end_effectors: where they end; a trunk needs at least two.
    """
    arms = [effector for effector in end_effectors if _is_arm(description, base_link, effector)]
    return _shared_joints(description, base_link, end_effectors) or _shared_joints(
        description, base_link, arms
    )


def find_arms(
    description: RobotDescription,
    base_link: str,
    end_effectors: Sequence[EndEffector],
    trunk_joints: Collection[str] = (),
) -> tuple[Arm, ...]:
    """Return the arms, ordered by name.

    The chain to an end effector is an arm if a gripper belongs to it or at least four joints lead to it.

    Args:
        description: the robot.
        base_link: where the chains begin.
        end_effectors: where they end.
        trunk_joints: joints that belong to no arm.
    """
    effectors = [effector for effector in end_effectors if _is_arm(description, base_link, effector)]
    used: set[str] = set()
    arms = []
    for number, effector in enumerate(effectors):
        name = "0" if len(effectors) == 1 else _arm_name(effector.link, number, used)
        used.add(name)
        joints = _driven_chain(description, base_link, effector)
        own = tuple(joint.name for joint in joints if joint.name not in trunk_joints)
        arms.append(Arm(name=name, joints=own, end_effector=effector))
    return tuple(sorted(arms, key=lambda arm: arm.name))


def _driven_chain(description: RobotDescription, base_link: str, effector: EndEffector) -> list[Joint]:
    """Return the driven joints from the base to an end effector, without those of its gripper."""
    joints = single_dof_joints(chain(description, base_link, effector.link), effector.gripper_joints)
    return [joint for joint in joints if joint.mimic is None]


def _is_arm(description: RobotDescription, base_link: str, effector: EndEffector) -> bool:
    joints = _driven_chain(description, base_link, effector)
    return bool(effector.gripper_links) or len(joints) >= MIN_ARM_JOINTS


def _shared_joints(
    description: RobotDescription, base_link: str, end_effectors: Sequence[EndEffector]
) -> tuple[str, ...]:
    """Return the driven joints on all chains; empty for fewer than two end effectors."""
    if len(end_effectors) < 2:
        return ()
    first, *others = (chain(description, base_link, effector.link) for effector in end_effectors)
    shared = [joint for joint in first if all(joint in other for other in others)]
    return tuple(joint.name for joint in single_dof_joints(shared) if joint.mimic is None)


def _arm_name(link: str, number: int, used: set[str]) -> str:
    """Return `left` or `right` where the link's name says so, else the number; with a suffix if in use."""
    name = next(
        (_SIDES[part] for part in re.split(r"[^A-Za-z]+", link.lower()) if part in _SIDES), str(number)
    )
    candidates = concatenate((name,), (f"{name}_{suffix}" for suffix in count(2)))
    return next(candidate for candidate in candidates if candidate not in used)
