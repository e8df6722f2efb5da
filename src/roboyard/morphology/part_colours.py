"""The parts that a robot was understood to have, each with its joints and a colour."""

from __future__ import annotations

from dataclasses import dataclass

from roboyard.description.model import RobotDescription
from roboyard.description.semantic import SemanticDescription

RGBA = tuple[float, float, float, float]

BODY: RGBA = (0.66, 0.69, 0.74, 1.0)
"""Colour of links that belong to no part."""
ARMS: tuple[RGBA, ...] = ((0.20, 0.47, 0.85, 1.0), (0.16, 0.66, 0.80, 1.0), (0.45, 0.40, 0.85, 1.0))
GRIPPER: RGBA = (0.93, 0.55, 0.15, 1.0)
WHEEL: RGBA = (0.16, 0.18, 0.22, 1.0)
CASTER: RGBA = (0.45, 0.47, 0.50, 1.0)
LEGS: tuple[RGBA, ...] = (
    (0.22, 0.62, 0.33, 1.0),
    (0.50, 0.76, 0.30, 1.0),
    (0.10, 0.48, 0.42, 1.0),
    (0.66, 0.74, 0.20, 1.0),
)
HEAD: RGBA = (0.83, 0.33, 0.52, 1.0)
TRUNK: RGBA = (0.58, 0.44, 0.32, 1.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class Part:
    """A part of the robot with its colour."""

    name: str
    rgba: RGBA
    joints: tuple[str, ...]


def parts_of(semantic: SemanticDescription) -> tuple[Part, ...]:
    """Return the parts that a robot was understood to have; sensors are apart, since they move no joint."""
    found: list[Part] = []
    for index, arm in enumerate(semantic.arms):
        found.append(Part(name=f"arm {arm.name}", rgba=ARMS[index % len(ARMS)], joints=arm.joints))
        gripper = arm.end_effector.gripper
        joints = arm.end_effector.gripper_joints
        if gripper is not None:
            joints = (*joints, *gripper.joints, *gripper.mimic_joints)
        if joints:
            found.append(Part(name=f"gripper {arm.name}", rgba=GRIPPER, joints=tuple(dict.fromkeys(joints))))
    owned = {joint for part in found for joint in part.joints}
    for gripper in semantic.grippers:
        joints = tuple(j for j in (*gripper.joints, *gripper.mimic_joints) if j not in owned)
        if joints:
            found.append(Part(name=f"gripper on {gripper.palm}", rgba=GRIPPER, joints=joints))
    for index, leg in enumerate(semantic.legs):
        found.append(Part(name=f"leg {leg.name}", rgba=LEGS[index % len(LEGS)], joints=leg.joints))
    wheels = tuple(wheel.joint for wheel in semantic.wheels if not wheel.is_caster)
    found.append(Part(name="wheels", rgba=WHEEL, joints=(*wheels, *semantic.steer_joints)))
    found.append(Part(name="casters", rgba=CASTER, joints=semantic.caster_joints))
    found.append(Part(name="trunk", rgba=TRUNK, joints=semantic.trunk_joints))
    found.append(Part(name="head", rgba=HEAD, joints=semantic.head_joints))
    return tuple(part for part in found if part.joints)


def colours_of_links(description: RobotDescription, semantic: SemanticDescription) -> dict[str, RGBA]:
    """Return the colour of each link: that of the part whose joint is the nearest above it."""
    by_joint: dict[str, RGBA] = {}
    for part in parts_of(semantic):
        for joint in part.joints:
            by_joint.setdefault(joint, part.rgba)
    colours = {description.root.name: BODY}
    for joint in description.depth_first_joints:
        moved = by_joint.get(joint.name, BODY) if joint.is_moving else colours[joint.parent]
        colours[joint.child] = moved
    return colours
