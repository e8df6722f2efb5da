"""The posture a robot rests in, joint by joint, and the joints a planner leaves alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from roboyard.description.model import Joint, RobotDescription
from roboyard.description.robot_model import EndEffector, RobotModel
from roboyard.importer.config.checks import frozen_joints, virtual_joints
from roboyard.importer.config.schema import ImportConfig
from roboyard.kinematics.description_poses import chain
from roboyard.kinematics.joint_order import breadth_first_joints, single_dof_joints
from roboyard.morphology.grippers import find_grippers

UNDRIVEN_VIRTUAL = ("base_footprint_z_joint", "base_footprint_rx_joint", "base_footprint_ry_joint")


def rest_posture(robot: RobotModel, config: ImportConfig) -> dict[str, float]:
    """Position of every joint that moves by one number: rad or m.

    The configuration's `default_qpos` where it gives one; else zero, or the nearest value to zero inside the
    limits. A mimic joint follows its leader. Virtual joints rest at zero.
    """
    description = robot.description
    given = named_qpos(robot, config)
    rest: dict[str, float] = {}
    for joint in single_dof_joints(description.joints):
        rest[joint.name] = given.get(joint.name, nearest_to_zero(joint))
    for _ in range(len(description.joints)):
        changed = False
        for joint in single_dof_joints(description.joints):
            if joint.mimic is None or joint.mimic.joint not in rest:
                continue
            value = joint.mimic.multiplier * rest[joint.mimic.joint] + joint.mimic.offset
            changed |= value != rest[joint.name]
            rest[joint.name] = value
        if not changed:
            break
    return rest


def named_qpos(robot: RobotModel, config: ImportConfig) -> dict[str, float]:
    """The configuration's `default_qpos` by joint name."""
    given = config.curobo.default_qpos
    if given is None:
        return {}
    if isinstance(given, dict):
        return dict(given)
    order = single_dof_joints(breadth_first_joints(robot.description), frozen_joints(config))
    names = [joint.name for joint in order if not (robot.holonomic and joint.name in virtual_joints())]
    return dict(zip(names, given, strict=True))


def nearest_to_zero(joint: Joint) -> float:
    """Zero, or the limit nearest to it."""
    limits = joint.position_limits()
    return 0.0 if limits is None else float(np.clip(0.0, *limits))


def lock_joints(robot: RobotModel, config: ImportConfig, rest: Mapping[str, float]) -> dict[str, float]:
    """Joints that a planner leaves alone: the configuration's, the undriven virtual ones, open grippers."""
    locked: dict[str, float] = {}
    for name, value in config.curobo.lock_joints.items():
        locked[name] = rest.get(name, 0.0) if value is None else value
    if robot.holonomic:
        locked |= {name: 0.0 for name in UNDRIVEN_VIRTUAL if name not in locked}
    for gripper in config.curobo.eef_to_gripper_info.values():
        for name in gripper.joints:
            joint = robot.description.joint_by_name.get(name)
            if joint is None or name in locked or name not in rest:
                continue
            limits = joint.position_limits()
            locked[name] = rest[name] if limits is None else limits[1]
    return locked


def end_effectors(robot: RobotModel, config: ImportConfig) -> tuple[EndEffector, ...]:
    """The configuration's end effectors; else the hands that are found; else the tip of the longest chain of
    moving joints.
    """
    given = config.curobo.eef_to_gripper_info
    if given:
        return tuple(
            EndEffector(link=link, gripper_links=tuple(g.links), gripper_joints=tuple(g.joints))
            for link, g in given.items()
        )
    hands = find_grippers(robot.description, virtual_joints() if robot.holonomic else ())
    return hands or (EndEffector(link=longest_chain_tip(robot.description)),)


def torso_joints(
    robot: RobotModel, config: ImportConfig, effectors: Sequence[EndEffector]
) -> tuple[str, ...]:
    """The configuration's torso joints; without any, the moving joints that the chains to all arms share."""
    given = config.curobo.torso_joints
    if given or len(effectors) < 2:
        return tuple(given)
    ways = [chain(robot.description, robot.base_link, effector.link) for effector in effectors]
    shared = [joint for joint in ways[0] if all(joint in way for way in ways[1:])]
    return tuple(joint.name for joint in single_dof_joints(shared) if joint.mimic is None)


def longest_chain_tip(description: RobotDescription) -> str:
    """The link that most moving joints lead to; of equals the first in file order, as near the root as
    possible.
    """
    moves = {description.root.name: 0}
    for joint in description.depth_first_joints:
        counts = joint.is_moving and joint.mimic is None
        moves[joint.child] = moves[joint.parent] + int(counts)
    most = max(moves.values())
    return next(name for name, count in moves.items() if count == most)
