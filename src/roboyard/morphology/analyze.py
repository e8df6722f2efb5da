"""Infer a robot's semantics from its geometry and joints."""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.model import RobotDescription
from roboyard.description.semantic import BaseKind, EndEffector, SemanticDescription, WheelPair
from roboyard.morphology.arms import find_arms, find_trunk, longest_chain_tip
from roboyard.morphology.grippers import find_grippers
from roboyard.morphology.wheels import Wheel, find_rolling_links, find_wheel_pair


def infer_semantics(description: RobotDescription) -> SemanticDescription:
    """Infer base, wheels, end effectors, trunk and arms of a robot about which nothing is stated.

    Raises:
        MeshError: a mesh file cannot be read.
    """
    wheels = tuple(wheel.link for wheel in find_rolling_links(description) if not wheel.is_caster)
    stated = SemanticDescription(base_link=description.root.name, wheel_links=wheels)
    return complete_semantics(description, stated)


def complete_semantics(description: RobotDescription, stated: SemanticDescription) -> SemanticDescription:
    """Infer the empty fields of a semantic description; wheels, disabled pairs and postures stay as stated.

    Args:
        description: the robot, with its virtual joints where `stated` names some.
        stated: the fields that are known, for example from a source configuration.

    Raises:
        MeshError: a mesh file cannot be read.
    """
    rolling = find_rolling_links(description)
    end_effectors = stated.end_effectors or find_end_effectors(description, stated.virtual_joints)
    trunk = stated.trunk_joints or find_trunk(description, stated.base_link, end_effectors)
    kind, base_joints, pair = stated.base, stated.base_joints, stated.wheel_pair
    if kind == "none":
        kind, base_joints, pair = _wheeled_base(description, stated, rolling)
    return replace(
        stated,
        base=kind,
        base_joints=base_joints,
        wheel_pair=pair,
        caster_links=stated.caster_links or tuple(wheel.link for wheel in rolling if wheel.is_caster),
        end_effectors=end_effectors,
        trunk_joints=trunk,
        arms=stated.arms or find_arms(description, stated.base_link, end_effectors, trunk),
    )


def find_end_effectors(
    description: RobotDescription, virtual_joints: tuple[str, ...] = ()
) -> tuple[EndEffector, ...]:
    """Return the grippers; without any, the tip of the longest chain of moving joints."""
    grippers = find_grippers(description, virtual_joints)
    return grippers or (EndEffector(link=longest_chain_tip(description)),)


def _wheeled_base(
    description: RobotDescription, stated: SemanticDescription, rolling: tuple[Wheel, ...]
) -> tuple[BaseKind, tuple[str, ...], WheelPair | None]:
    """Return kind, joints and wheel pair of a base that moves by the stated wheels."""
    parents = (description.parent_joint.get(link) for link in stated.wheel_links)
    joints = tuple(joint.name for joint in parents if joint is not None and joint.is_moving)
    driven = [wheel for wheel in rolling if not wheel.is_caster and wheel.joint.name in joints]
    pair = find_wheel_pair(driven) if len(joints) == 2 else None
    if pair is not None:
        return "differential", (pair.left, pair.right), pair
    return ("wheeled" if joints else "none"), joints, None
