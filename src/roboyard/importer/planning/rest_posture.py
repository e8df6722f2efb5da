"""Rest posture of a robot, and the joints that a planner does not move."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from roboyard.description.model import Joint
from roboyard.description.robot_model import RobotModel
from roboyard.importer.config.checks import frozen_joints
from roboyard.importer.config.schema import ImportConfig
from roboyard.kinematics.joint_order import breadth_first_joints, single_dof_joints


def rest_posture(robot: RobotModel, config: ImportConfig) -> dict[str, float]:
    """Return the rest position of every joint with one degree of freedom (rad or m).

    It is the configuration's `default_qpos` where given; else zero, or the limit nearest to zero. A mimic
    joint follows its leader. Virtual joints rest at zero.
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
    """Return the configuration's `default_qpos` by joint name (rad or m)."""
    given = config.curobo.default_qpos
    if given is None:
        return {}
    if isinstance(given, dict):
        return dict(given)
    order = single_dof_joints(breadth_first_joints(robot.description), frozen_joints(config))
    names = [joint.name for joint in order if joint.name not in robot.semantic.virtual_joints]
    return dict(zip(names, given, strict=True))


def nearest_to_zero(joint: Joint) -> float:
    """Return zero, or the limit nearest to it (rad or m)."""
    limits = joint.position_limits()
    return 0.0 if limits is None else float(np.clip(0.0, *limits))


def lock_joints(robot: RobotModel, config: ImportConfig, rest: Mapping[str, float]) -> dict[str, float]:
    """Return the joints that a planner does not move, with their positions (rad or m).

    They are the configuration's, the virtual joints without a drive, and the gripper joints, opened. Joints
    of a hand that open nothing stay at rest.
    """
    locked: dict[str, float] = {}
    for name, value in config.curobo.lock_joints.items():
        locked[name] = rest.get(name, 0.0) if value is None else value
    undriven = [name for name in robot.semantic.virtual_joints if name not in robot.semantic.base_joints]
    locked |= {name: 0.0 for name in undriven if name not in locked}
    ways = {name: way for hand in robot.semantic.grippers for name, way in hand.opening_of.items()}
    known = {name for hand in robot.semantic.grippers if hand.opening_of for name in hand.joints}
    for gripper in config.curobo.eef_to_gripper_info.values():
        for name in gripper.joints:
            joint = robot.description.joint_by_name.get(name)
            if joint is None or name in locked or name not in rest:
                continue
            limits = joint.position_limits()
            way = ways.get(name, None if name in known else "increasing")
            ends = {"increasing": 1, "decreasing": 0}
            locked[name] = rest[name] if limits is None or way is None else limits[ends[way]]
    return locked
