"""The definition of a robot without a definition file, from its semantics: base, trunk, arms and grippers."""

from __future__ import annotations

from typing import Any

from roboyard.description.model import RobotDescription
from roboyard.description.semantic import SemanticDescription
from roboyard.errors import MeshError
from roboyard.kinematics.joint_order import single_dof_joints
from roboyard.morphology.analyze import complete_semantics, infer_semantics
from roboyard.robots.definition.schema import VIRTUAL_JOINTS, RobotDefinition


def default_definition(
    description: RobotDescription, semantic: SemanticDescription | None = None
) -> RobotDefinition:
    """Return a definition with controllers for all driven joints of a robot.

    | found | group and controller |
    | --- | --- |
    | six virtual joints | `base`, HolonomicBaseJointController |
    | two wheels side by side | `base`, DifferentialDriveController |
    | other wheels | `base`, JointController (velocity) |
    | joints of an arm | `arm_<name>`, JointController (position) |
    | fingers with limits | `gripper_<name>`, MultiFingerGripperController |
    | all other driven joints | `trunk`, JointController (position) |

    Args:
        description: of the robot.
        semantic: of the robot; inferred from its geometry by default.
    """
    semantic = _infer(description) if semantic is None else semantic
    data: dict[str, Any] = {"base_footprint_link_name": semantic.base_link}
    controllers: dict[str, str] = {}
    claimed = _add_base(semantic, data, controllers)
    driven = single_dof_joints(description.depth_first_joints)
    rest = {joint.name: joint.child for joint in driven if joint.mimic is None and joint.name not in claimed}
    claimed |= _add_arms(description, semantic, rest, data, controllers)
    trunk = [name for name in rest if name not in claimed]
    if trunk:
        data["articulated_trunk"] = {"trunk_joint_names": trunk}
        controllers["trunk"] = "JointController"
    if semantic.disabled_collision_pairs:
        data["disabled_collision_pairs"] = semantic.disabled_collision_pairs
    return RobotDefinition.model_validate(
        {**data, "raw_controller_order": list(controllers), "default_controllers": controllers}
    )


def _infer(description: RobotDescription) -> SemanticDescription:
    """Return the semantics of a robot by its geometry, or by its virtual joints."""
    joints = description.joint_by_name
    try:
        if not all(name in joints for name in VIRTUAL_JOINTS):
            return infer_semantics(description)
        stated = SemanticDescription(
            base_link=joints[VIRTUAL_JOINTS[5]].child,
            base="holonomic",
            base_joints=tuple(VIRTUAL_JOINTS[k] for k in (0, 1, 5)),
            virtual_joints=VIRTUAL_JOINTS,
        )
        return complete_semantics(description, stated)
    except MeshError:  # without its meshes wheels cannot be recognized; all joints join the trunk
        return SemanticDescription(base_link=description.root.name)


def _add_base(semantic: SemanticDescription, data: dict[str, Any], controllers: dict[str, str]) -> set[str]:
    """Add the blocks of the base, and return the names of its joints."""
    pair = semantic.wheel_pair
    if not semantic.base_joints:
        return set()
    if semantic.virtual_joints:
        data["holonomic_base"] = {}
        controllers["base"] = "HolonomicBaseJointController"
    elif pair is not None:
        data["two_wheel"] = {"wheel_radius": pair.radius, "wheel_axle_length": pair.length}
        controllers["base"] = "DifferentialDriveController"
    else:
        controllers["base"] = "JointController"
    data["locomotion"] = {
        "base_joint_names": semantic.base_joints,
        "floor_touching_base_link_names": (*semantic.wheel_links, *semantic.caster_links),
    }
    return {*semantic.base_joints, *semantic.virtual_joints}


def _add_arms(
    description: RobotDescription,
    semantic: SemanticDescription,
    rest: dict[str, str],
    data: dict[str, Any],
    controllers: dict[str, str],
) -> set[str]:
    """Add the `manipulation` block, and return the names of the joints of arms and grippers.

    `rest` has the child link of each driven joint that is not of the base.
    """
    arms = {arm.name: arm for arm in semantic.arms if arm.joints and all(name in rest for name in arm.joints)}
    if not arms:
        return set()
    fingers = {
        name: [joint for joint, child in rest.items() if child in arm.end_effector.gripper_links]
        for name, arm in arms.items()
    }
    data["manipulation"] = {
        "n_arms": len(arms),
        "arm_names": list(arms),
        "arm_joint_names": {name: arm.joints for name, arm in arms.items()},
        "eef_link_names": {name: arm.end_effector.link for name, arm in arms.items()},
        "finger_link_names": {name: [rest[joint] for joint in fingers[name]] for name in arms},
        "finger_joint_names": fingers,
    }
    for name in arms:
        controllers[f"arm_{name}"] = "JointController"
        if fingers[name]:
            limits = [description.joint_by_name[joint].position_limits() for joint in fingers[name]]
            bounded = all(limit is not None for limit in limits)
            controllers[f"gripper_{name}"] = "MultiFingerGripperController" if bounded else "JointController"
    return {joint for name, arm in arms.items() for joint in (*arm.joints, *fingers[name])}
