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
from roboyard.export.definition_blocks import DefinitionBlocks, definition_blocks
from roboyard.export.export_result import ExportResult
from roboyard.export.planner import Planner
from roboyard.kinematics.joint_order import breadth_first_joints, single_dof_joints
from roboyard.morphology.upright import standing_orientation

if TYPE_CHECKING:
    from roboyard.description.model import Joint
    from roboyard.description.robot_model import RobotModel


def write(robot: RobotModel, path: Path | str) -> ExportResult:
    """Write the skeleton of a robot's definition; returns the file."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    wheels = robot.semantic.wheel_links
    blocks = definition_blocks(
        robot.description,
        robot.semantic,
        sphere_wheels=any(robot.approximations.get(link) == "boundingSphere" for link in wheels),
        rest=_rest(robot),
    )
    parts = [
        f"# Definition of {robot.name}. Entries behind '#' are yours to fill in; unknown keys are errors.\n",
        _controllers(blocks.controllers),
        _general(robot),
        _base(blocks),
        _trunk(blocks),
        _head(blocks),
        _manipulation(robot, blocks),
        _postures(robot),
    ]
    target.write_text("\n".join(part for part in parts if part), encoding="utf-8", errors="backslashreplace")
    return ExportResult(files=(target,))


def _controllers(groups: dict[str, str]) -> str:
    text = "# Order of the groups in the action vector, and the controller of each.\n"
    text += dump({"raw_controller_order": list(groups), "default_controllers": groups})
    if not groups:
        text += "# No arm, gripper, trunk or base was detected: add its block below, then its group here.\n"
    return text


def _general(robot: RobotModel) -> str:
    joints = _vector_joints(robot)
    data: dict[str, Any] = {"base_footprint_link_name": robot.semantic.base_link}
    text = "# The link that counts as the base, below virtual joints.\n" + dump(data)
    standing = standing_orientation(robot.semantic)
    if standing is not None and robot.semantic.base_link == robot.description.root.name:
        text += "\n# Orientation (x, y, z, w) of the root link in which the robot stands and faces +x.\n"
        text += dump({"standing_orientation": list(standing)})
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


def _rest(robot: RobotModel) -> dict[str, float]:
    """Return the rest position of each joint of the definition's vectors; empty without planning data."""
    if robot.planning is None:
        return {}
    planner = Planner(robot=robot, data=robot.planning)
    return {
        joint.name: planner.locked.get(joint.name, planner.rest(joint)) for joint in _vector_joints(robot)
    }


def _vector_joints(robot: RobotModel) -> tuple[Joint, ...]:
    """Return the joints of a definition's vectors, breadth first."""
    return single_dof_joints(breadth_first_joints(robot.description))


def _base(blocks: DefinitionBlocks) -> str:
    if "holonomic_base" in blocks.base:
        return "# A holonomic base on virtual joints.\n" + dump(blocks.base)
    if "two_wheel" in blocks.base:
        return "# Driven wheels, the left ones first.\n" + dump(blocks.base)
    if blocks.base:
        text = "# Joints that move the base, and the links on which it stands.\n" + dump(blocks.base)
        return text + "# two_wheel:\n#   wheel_radius: 0.0        # m\n#   wheel_axle_length: 0.0   # m\n"
    return "# locomotion:\n#   base_joint_names: []\n#   floor_touching_base_link_names: []\n"


def _trunk(blocks: DefinitionBlocks) -> str:
    if not blocks.trunk:
        return "# articulated_trunk:\n#   trunk_link_names: []\n#   trunk_joint_names: []\n"
    return "# Joints that move all arms, and joints of no other group.\n" + dump(blocks.trunk)


def _head(blocks: DefinitionBlocks) -> str:
    if not blocks.camera:
        return "# active_camera:\n#   camera_joint_names: []\n"
    return "# Joints that turn the head.\n" + dump(blocks.camera)


def _manipulation(robot: RobotModel, blocks: DefinitionBlocks) -> str:
    if not blocks.manipulation:
        return "# manipulation:\n#   n_arms: 1\n#   arm_link_names: {}\n#   eef_link_names: {}\n"
    return "# Arms and grippers.\n" + dump(blocks.manipulation)


def _postures(robot: RobotModel) -> str:
    """Return the block of the working and the tucked posture; empty where no tucked one is known."""
    joints, tuck = _vector_joints(robot), robot.semantic.tuck
    if not tuck or robot.planning is None:
        return ""
    planner = Planner(robot=robot, data=robot.planning)
    rest = {joint.name: planner.locked.get(joint.name, planner.rest(joint)) for joint in joints}
    tucked = {**rest, **{name: value for name, value in tuck.items() if name in rest}}
    block = {
        "mobile_manipulation": {
            "untucked_default_joint_pos": Column(rest[joint.name] for joint in joints),
            "tucked_default_joint_pos": Column(tucked[joint.name] for joint in joints),
        }
    }
    return "# Postures for working and for driving, in the order of default_joint_pos.\n" + dump(block)
