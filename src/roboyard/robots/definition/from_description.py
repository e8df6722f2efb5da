"""The definition of a robot without a definition file, from its wheels, grippers and chains."""

from __future__ import annotations

from typing import Any

from roboyard.description.model import Joint, RobotDescription
from roboyard.errors import MeshError
from roboyard.kinematics.description_poses import chain
from roboyard.kinematics.joint_order import single_dof_joints
from roboyard.morphology.grippers import find_grippers
from roboyard.morphology.wheels import Wheel, find_wheel_pair, find_wheels
from roboyard.robots.definition.schema import VIRTUAL_JOINTS, RobotDefinition

MIN_ARM_JOINTS = 4
"""Driven joints of a serial chain that make it an arm."""


def default_definition(description: RobotDescription) -> RobotDefinition:
    """Return a definition with controllers for all driven joints of a robot.

    | found | group and controller |
    | --- | --- |
    | six virtual joints | `base`, HolonomicBaseJointController |
    | two wheels side by side | `base`, DifferentialDriveController |
    | other wheels | `base`, JointController (velocity) |
    | joints that lead to one gripper, or a serial chain | `arm_<n>`, JointController (position) |
    | fingers with limits | `gripper_<n>`, MultiFingerGripperController |
    | all other driven joints | `trunk`, JointController (position) |
    """
    driven = [joint for joint in single_dof_joints(description.depth_first_joints) if joint.mimic is None]
    data: dict[str, Any] = {}
    controllers: dict[str, str] = {}
    base = _base(description, data, controllers)
    rest = [joint for joint in driven if joint.name not in base]
    claimed = _arms(description, rest, data, controllers)
    trunk = [joint.name for joint in rest if joint.name not in claimed]
    if trunk:
        data["articulated_trunk"] = {"trunk_joint_names": trunk}
        controllers["trunk"] = "JointController"
    return RobotDefinition.model_validate(
        {**data, "raw_controller_order": list(controllers), "default_controllers": controllers}
    )


def _base(description: RobotDescription, data: dict[str, Any], controllers: dict[str, str]) -> set[str]:
    """Add the blocks of the base, and return the names of its joints."""
    by_name = description.joint_by_name
    if all(name in by_name for name in VIRTUAL_JOINTS):
        data["holonomic_base"] = {}
        data["locomotion"] = {"base_joint_names": [VIRTUAL_JOINTS[k] for k in (0, 1, 5)]}
        data["base_footprint_link_name"] = by_name[VIRTUAL_JOINTS[5]].child
        controllers["base"] = "HolonomicBaseJointController"
        return set(VIRTUAL_JOINTS)
    wheels = _wheels(description)
    if not wheels:
        return set()
    names = [wheel.joint.name for wheel in wheels]
    pair = find_wheel_pair(wheels)
    if pair is not None:
        data["two_wheel"] = {"wheel_radius": pair.radius, "wheel_axle_length": pair.length}
        names = [pair.left, pair.right]
    data["locomotion"] = {
        "base_joint_names": names,
        "floor_touching_base_link_names": [wheel.link for wheel in wheels],
    }
    controllers["base"] = "JointController" if pair is None else "DifferentialDriveController"
    return set(names)


def _wheels(description: RobotDescription) -> tuple[Wheel, ...]:
    try:
        return find_wheels(description)
    except MeshError:  # without its meshes a wheel cannot be recognized; its joint joins the trunk
        return ()


def _arms(
    description: RobotDescription, rest: list[Joint], data: dict[str, Any], controllers: dict[str, str]
) -> set[str]:
    """Add the `manipulation` block, and return the names of the joints of arms and grippers."""
    free = {joint.name for joint in rest}
    chains: dict[str, list[Joint]] = {}
    fingers: dict[str, list[Joint]] = {}
    for effector in find_grippers(description, VIRTUAL_JOINTS):
        way = chain(description, description.root.name, effector.link)
        chains[effector.link] = [joint for joint in way if joint.name in free]
        links = set(effector.gripper_links)
        fingers[effector.link] = [joint for joint in rest if joint.child in links]
    if not chains and len(rest) >= MIN_ARM_JOINTS:
        tip = rest[-1].child
        way = [joint for joint in chain(description, description.root.name, tip) if joint.name in free]
        if way == rest:
            chains[tip], fingers[tip] = way, []
    shared = (
        set.intersection(*({joint.name for joint in way} for way in chains.values())) if chains else set()
    )
    if len(chains) > 1:
        chains = {tip: [joint for joint in way if joint.name not in shared] for tip, way in chains.items()}
    chains = {tip: way for tip, way in chains.items() if way}
    if not chains:
        return set()
    arms = dict(zip(map(str, range(len(chains))), chains, strict=True))
    data["manipulation"] = {
        "n_arms": len(arms),
        "arm_joint_names": {arm: [joint.name for joint in chains[tip]] for arm, tip in arms.items()},
        "eef_link_names": dict(arms),
        "finger_link_names": {arm: [joint.child for joint in fingers[tip]] for arm, tip in arms.items()},
        "finger_joint_names": {arm: [joint.name for joint in fingers[tip]] for arm, tip in arms.items()},
    }
    for arm, tip in arms.items():
        controllers[f"arm_{arm}"] = "JointController"
        if fingers[tip]:
            bounded = all(joint.position_limits() is not None for joint in fingers[tip])
            controllers[f"gripper_{arm}"] = "MultiFingerGripperController" if bounded else "JointController"
    return {joint.name for tip in chains for joint in (*chains[tip], *fingers[tip])}
