"""RobotDefinition: the file with which OmniGibson and Roboyard drive a robot. A skeleton to complete by hand.

| concept | where it goes |
| --- | --- |
| end effectors with their chains and grippers | `manipulation` |
| trunk joints | `articulated_trunk` |
| virtual joints | `holonomic_base`, `locomotion` |
| wheels | `locomotion`; `two_wheel` for a differential drive |
| the base link | `base_footprint_link_name` |
| disabled collision pairs | `disabled_collision_pairs` |
| rest posture | `default_joint_pos`, breadth first, each number with its joint's name |
| groups of joints | `raw_controller_order`, `default_controllers` |

Settings that the files do not state are written as comments.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard.config.yaml_text import Column, annotate, dump
from roboyard.export.export_result import ExportResult
from roboyard.export.planner import Planner
from roboyard.kinematics.joint_order import breadth_first_joints, single_dof_joints

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel
    from roboyard.description.semantic import SemanticDescription

_CONTROLLERS = {
    "trunk": "JointController",
    "arm": "InverseKinematicsController",
    "gripper": "MultiFingerGripperController",
}
"""Beginning of a group's name to its controller."""


def write(robot: RobotModel, path: Path | str) -> ExportResult:
    """Write the skeleton of a robot's definition; returns the file."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    parts = [
        f"# Definition of {robot.name}. Entries behind '#' are yours to fill in; unknown keys are errors.\n",
        _controllers(_group_controllers(robot.semantic)),
        _general(robot),
        _base(robot),
        _trunk(robot),
        _manipulation(robot),
    ]
    target.write_text("\n".join(part for part in parts if part), encoding="utf-8")
    return ExportResult(files=(target,))


def _group_controllers(semantic: SemanticDescription) -> dict[str, str]:
    """Return each group's controller, in action order."""
    return {
        group: _base_controller(semantic) if group == "base" else _CONTROLLERS[group.partition("_")[0]]
        for group in semantic.groups
    }


def _base_controller(semantic: SemanticDescription) -> str:
    if semantic.virtual_joints:
        return "HolonomicBaseJointController"
    return "JointController" if semantic.wheel_pair is None else "DifferentialDriveController"


def _controllers(groups: dict[str, str]) -> str:
    text = "# Order of the groups in the action vector, and the controller of each.\n"
    text += dump({"raw_controller_order": list(groups), "default_controllers": groups})
    if not groups:
        text += "# No arm, gripper, trunk or base was detected: add its block below, then its group here.\n"
    return text


def _general(robot: RobotModel) -> str:
    joints = single_dof_joints(breadth_first_joints(robot.description))
    data: dict[str, Any] = {"base_footprint_link_name": robot.semantic.base_link}
    text = "# The link that counts as the base, below virtual joints.\n" + dump(data)
    if joints and robot.planning is not None:
        planner = Planner(robot=robot, data=robot.planning)
        text += "\n# Rest posture, one number for each joint, level by level from the root; rad or m.\n"
        values = Column(planner.locked.get(joint.name, planner.rest(joint)) for joint in joints)
        vector = dump({"default_joint_pos": values})
        text += annotate(vector, "default_joint_pos", [joint.name for joint in joints])
    pairs = robot.semantic.disabled_collision_pairs
    if pairs:
        text += "\n# Links that overlap at rest.\n"
        text += dump({"disabled_collision_pairs": [list(pair) for pair in pairs]})
    text += "\n# disabled_collision_link_names: []   # links that never collide\n"
    text += "# self_collisions: true\n"
    text += "# linear_velocity_gain_for_primitives: 0.3\n# angular_velocity_gain_for_primitives: 0.2\n"
    return text


def _base(robot: RobotModel) -> str:
    semantic = robot.semantic
    wheels = list(semantic.wheel_links)
    joints = {
        "base_joint_names": list(semantic.base_joints),
        "floor_touching_base_link_names": wheels,
    }
    if semantic.virtual_joints:
        spheres = any(robot.approximations.get(link) == "boundingSphere" for link in wheels)
        block = {"holonomic_base": {"force_sphere_wheel_approximation": spheres}, "locomotion": joints}
        return "# A holonomic base on virtual joints.\n" + dump(block)
    if semantic.wheel_pair is not None:
        pair = semantic.wheel_pair
        two_wheel = {"wheel_radius": round(pair.radius, 4), "wheel_axle_length": round(pair.length, 4)}
        return "# Two driven wheels, left and right.\n" + dump({"two_wheel": two_wheel, "locomotion": joints})
    if joints["base_joint_names"]:
        text = "# A base on wheels.\n" + dump({"locomotion": joints})
        return text + "# two_wheel:\n#   wheel_radius: 0.0        # m\n#   wheel_axle_length: 0.0   # m\n"
    return "# locomotion:\n#   base_joint_names: []\n#   floor_touching_base_link_names: []\n"


def _trunk(robot: RobotModel) -> str:
    trunk = [joint for joint in robot.description.joints if joint.name in robot.semantic.trunk_joints]
    if not trunk:
        return "# articulated_trunk:\n#   trunk_link_names: []\n#   trunk_joint_names: []\n"
    names = {
        "trunk_link_names": [joint.child for joint in trunk],
        "trunk_joint_names": [joint.name for joint in trunk],
    }
    return "# Joints that move all arms.\n" + dump({"articulated_trunk": names})


def _manipulation(robot: RobotModel) -> str:
    arms = robot.semantic.arms
    if not arms:
        return "# manipulation:\n#   n_arms: 1\n#   arm_link_names: {}\n#   eef_link_names: {}\n"
    child_of = {joint.name: joint.child for joint in robot.description.joints}
    block: dict[str, Any] = {
        "n_arms": len(arms),
        "arm_names": [arm.name for arm in arms],
        "arm_link_names": {arm.name: [child_of[joint] for joint in arm.joints] for arm in arms},
        "arm_joint_names": {arm.name: list(arm.joints) for arm in arms},
        "eef_link_names": {arm.name: arm.end_effector.link for arm in arms},
        "finger_link_names": {arm.name: list(arm.end_effector.gripper_links) for arm in arms},
        "finger_joint_names": {arm.name: list(arm.end_effector.gripper_joints) for arm in arms},
    }
    text = "# Arms and grippers.\n" + dump({"manipulation": block})
    text += "  # arm_workspace_range:   # degrees\n"
    text += "".join(f"  #   {arm.name}: [-45, 45]\n" for arm in arms)
    text += "  # assisted_grasp_start_points: {}   # arm to [[link, [x, y, z]], ...]\n"
    text += "  # assisted_grasp_end_points: {}\n"
    return text
