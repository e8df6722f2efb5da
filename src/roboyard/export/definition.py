"""RobotDefinition: what OmniGibson and Roboyard need to drive a robot. A skeleton to complete by hand.

| concept | where it goes |
| --- | --- |
| end effectors with their chains and grippers | `manipulation` |
| joints that the chains of all arms share, or the torso joints | `articulated_trunk` |
| six virtual joints | `holonomic_base`, `locomotion` |
| wheels | `locomotion`; `two_wheel` where there are just two, side by side |
| the vendor's root link | `base_footprint_link_name` |
| links that overlap at rest | `disabled_collision_pairs` |
| rest posture | `default_joint_pos`, breadth first, each number with its joint's name |
| groups of joints | `raw_controller_order`, `default_controllers` |

A chain to an end effector counts as an arm if a gripper belongs to it or at least four joints lead to it.
What cannot be known from the files stands in comments.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard.config.yaml_text import Column, annotate, dump
from roboyard.description.model import Joint
from roboyard.export.export_result import ExportResult
from roboyard.export.names import free_name
from roboyard.export.planner import Planner
from roboyard.kinematics.description_poses import chain
from roboyard.kinematics.joint_order import SINGLE_DOF_TYPES, breadth_first_joints, single_dof_joints
from roboyard.morphology.wheels import WheelPair, find_wheel_pair, find_wheels

if TYPE_CHECKING:
    from roboyard.description.robot_model import EndEffector, RobotModel

ARM_JOINTS = 4
"""Joints that make a chain without gripper an arm."""
HOLONOMIC_JOINTS = ["base_footprint_x_joint", "base_footprint_y_joint", "base_footprint_rz_joint"]
_SIDES = {"left": "left", "l": "left", "right": "right", "r": "right"}


@dataclass(frozen=True, kw_only=True, slots=True)
class Arm:
    """One arm and its gripper."""

    name: str
    effector: EndEffector
    joints: tuple[Joint, ...]


def write(robot: RobotModel, path: Path | str) -> ExportResult:
    """Write the skeleton of a robot's definition."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    trunk, arms = _trunk_and_arms(robot)
    groups = _groups(robot, trunk, arms)
    parts = [
        f"# Definition of {robot.name}. Entries behind '#' are yours to fill in; unknown keys are errors.\n",
        _controllers(groups),
        _general(robot),
        _base(robot),
        _trunk(trunk),
        _manipulation(arms),
    ]
    target.write_text("\n".join(part for part in parts if part), encoding="utf-8")
    return ExportResult(files=(target,))


def _trunk_and_arms(robot: RobotModel) -> tuple[tuple[Joint, ...], tuple[Arm, ...]]:
    if robot.planning is None:
        return (), ()
    description = robot.description
    chains: list[tuple[EndEffector, list[Joint]]] = []
    for effector in robot.planning.end_effectors:
        grips = set(effector.gripper_joints)
        way = [
            joint
            for joint in chain(description, robot.base_link, effector.link)
            if joint.type in SINGLE_DOF_TYPES and joint.mimic is None and joint.name not in grips
        ]
        if effector.gripper_links or len(way) >= ARM_JOINTS:
            chains.append((effector, way))
    trunk = [joint for joint in description.joints if joint.name in robot.planning.torso_joints]
    if not trunk and len(chains) > 1:
        trunk = [joint for joint in chains[0][1] if all(joint in way for _, way in chains[1:])]
    used: set[str] = set()
    arms = []
    for number, (effector, way) in enumerate(chains):
        name = _arm_name(effector.link, number, used, alone=len(chains) == 1)
        used.add(name)
        own = tuple(joint for joint in way if joint not in trunk)
        arms.append(Arm(name=name, effector=effector, joints=own))
    return tuple(trunk), tuple(sorted(arms, key=lambda arm: arm.name))


def _arm_name(link: str, number: int, used: set[str], *, alone: bool) -> str:
    """`left` or `right` where the link says so, else a number."""
    if alone:
        return "0"
    for word in re.split(r"[^A-Za-z]+", link.lower()):
        if word in _SIDES:
            return free_name(_SIDES[word], used)
    return free_name(str(number), used)


def _groups(robot: RobotModel, trunk: tuple[Joint, ...], arms: tuple[Arm, ...]) -> dict[str, str]:
    """Group to controller, in action order."""
    groups: dict[str, str] = {}
    if robot.holonomic:
        groups["base"] = "HolonomicBaseJointController"
    elif _wheel_joints(robot):
        groups["base"] = "JointController" if _axle(robot) is None else "DifferentialDriveController"
    if trunk:
        groups["trunk"] = "JointController"
    for arm in arms:
        groups[f"arm_{arm.name}"] = "InverseKinematicsController"
        if arm.effector.gripper_joints:
            groups[f"gripper_{arm.name}"] = "MultiFingerGripperController"
    return groups


def _wheel_joints(robot: RobotModel) -> list[str]:
    found = (robot.description.parent_joint.get(link) for link in robot.wheel_links)
    return [joint.name for joint in found if joint is not None and joint.is_moving]


def _axle(robot: RobotModel) -> WheelPair | None:
    """The two wheels that a robot drives by, where it has no others."""
    joints = _wheel_joints(robot)
    axle = find_wheel_pair([wheel for wheel in find_wheels(robot.description) if wheel.joint.name in joints])
    return axle if len(joints) == 2 else None


def _controllers(groups: dict[str, str]) -> str:
    text = "# Order of the groups in the action vector, and the controller of each.\n"
    text += dump({"raw_controller_order": list(groups), "default_controllers": groups})
    if not groups:
        text += "# No arm, gripper, trunk or base was recognised: add its block below, then its group here.\n"
    return text


def _general(robot: RobotModel) -> str:
    joints = single_dof_joints(breadth_first_joints(robot.description))
    data: dict[str, Any] = {"base_footprint_link_name": robot.base_link}
    text = "# The link that counts as the base, below virtual joints.\n" + dump(data)
    if joints and robot.planning is not None:
        planner = Planner(robot=robot, data=robot.planning)
        text += "\n# Rest posture, one number for each joint, level by level from the root; rad or m.\n"
        values = Column(planner.locked.get(joint.name, planner.rest(joint)) for joint in joints)
        vector = dump({"default_joint_pos": values})
        text += annotate(vector, "default_joint_pos", [joint.name for joint in joints])
    if robot.filtered_pairs:
        text += "\n# Links that overlap at rest.\n"
        text += dump({"disabled_collision_pairs": [list(pair) for pair in robot.filtered_pairs]})
    text += "\n# disabled_collision_link_names: []   # links that never collide\n"
    text += "# self_collisions: true\n"
    text += "# linear_velocity_gain_for_primitives: 0.3\n# angular_velocity_gain_for_primitives: 0.2\n"
    return text


def _base(robot: RobotModel) -> str:
    wheels = list(robot.wheel_links)
    if robot.holonomic:
        spheres = any(robot.approximations.get(link) == "boundingSphere" for link in wheels)
        blocks: dict[str, Any] = {
            "holonomic_base": {"force_sphere_wheel_approximation": spheres},
            "locomotion": {"base_joint_names": HOLONOMIC_JOINTS, "floor_touching_base_link_names": wheels},
        }
        return "# A base that glides on its virtual joints.\n" + dump(blocks)
    axle = _axle(robot)
    if axle is not None:
        blocks = {
            "two_wheel": {
                "wheel_radius": round(axle.radius, 4),
                "wheel_axle_length": round(axle.length, 4),
            },
            "locomotion": {
                "base_joint_names": [axle.left, axle.right],
                "floor_touching_base_link_names": wheels,
            },
        }
        return "# Two driven wheels, left and right.\n" + dump(blocks)
    if _wheel_joints(robot):
        block = {"base_joint_names": _wheel_joints(robot), "floor_touching_base_link_names": wheels}
        text = "# A base on wheels.\n" + dump({"locomotion": block})
        return text + "# two_wheel:\n#   wheel_radius: 0.0        # m\n#   wheel_axle_length: 0.0   # m\n"
    return "# locomotion:\n#   base_joint_names: []\n#   floor_touching_base_link_names: []\n"


def _trunk(trunk: tuple[Joint, ...]) -> str:
    if not trunk:
        return "# articulated_trunk:\n#   trunk_link_names: []\n#   trunk_joint_names: []\n"
    names = {
        "trunk_link_names": [joint.child for joint in trunk],
        "trunk_joint_names": [joint.name for joint in trunk],
    }
    return "# What all arms stand on.\n" + dump({"articulated_trunk": names})


def _manipulation(arms: tuple[Arm, ...]) -> str:
    if not arms:
        return "# manipulation:\n#   n_arms: 1\n#   arm_link_names: {}\n#   eef_link_names: {}\n"
    block: dict[str, Any] = {
        "n_arms": len(arms),
        "arm_names": [arm.name for arm in arms],
        "arm_link_names": {arm.name: [joint.child for joint in arm.joints] for arm in arms},
        "arm_joint_names": {arm.name: [joint.name for joint in arm.joints] for arm in arms},
        "eef_link_names": {arm.name: arm.effector.link for arm in arms},
        "finger_link_names": {arm.name: list(arm.effector.gripper_links) for arm in arms},
        "finger_joint_names": {arm.name: list(arm.effector.gripper_joints) for arm in arms},
    }
    text = "# Arms and grippers.\n" + dump({"manipulation": block})
    text += "  # arm_workspace_range:   # degrees\n"
    text += "".join(f"  #   {arm.name}: [-45, 45]\n" for arm in arms)
    text += "  # assisted_grasp_start_points: {}   # arm to [[link, [x, y, z]], ...]\n"
    text += "  # assisted_grasp_end_points: {}\n"
    return text
