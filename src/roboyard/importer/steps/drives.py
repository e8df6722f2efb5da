"""Kinds of drives of a robot's joints."""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.model import Joint
from roboyard.description.robot_model import DriveKind, RobotModel
from roboyard.importer.context import ImportContext
from roboyard.kinematics.joint_order import SINGLE_DOF_TYPES
from roboyard.morphology.motor_limits import with_motors


def add_drives(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot with position drives on joints with limits, and velocity drives on continuous joints
    and on the base.
    """
    description, given = with_motors(robot.description)
    if given:
        robot = replace(robot, description=description)
        shown = ", ".join(given[:6]) + (f", ... ({len(given)} in all)" if len(given) > 6 else "")
        context.log.warn(
            f"effort limits of 0 on {shown} are replaced by twice the effort that holds the load; "
            f"set the real limits in the URDF"
        )
    found: dict[str, DriveKind] = {}
    for joint in robot.description.joints:
        if joint.type not in SINGLE_DOF_TYPES:
            continue
        if joint.name in robot.semantic.virtual_joints:
            found[joint.name] = "velocity" if joint.name in robot.semantic.base_joints else "none"
            continue
        found[joint.name] = _kind(joint, context)
    return replace(robot, drives=found)


def _kind(joint: Joint, context: ImportContext) -> DriveKind:
    if joint.mimic is not None:
        return "none"
    limit = joint.limit
    if limit is not None and limit.effort == 0:
        context.log.warn("effort limit 0 allows no motor; the joint moves freely", f'joint "{joint.name}"')
        return "none"
    return "velocity" if joint.type == "continuous" else "position"
