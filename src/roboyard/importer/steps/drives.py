"""Which joints have a motor, and how it is meant to be driven at first."""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.model import Joint
from roboyard.description.robot_model import DriveKind, RobotModel
from roboyard.importer.context import ImportContext
from roboyard.kinematics.joint_order import SINGLE_DOF_TYPES
from roboyard.morphology.motor_limits import with_motors


def drives(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Position drives on joints with a range, velocity drives on those that turn for ever and on the base."""
    description, given = with_motors(robot.description)
    if given:
        robot = replace(robot, description=description)
        shown = ", ".join(given[:6]) + (f", ... ({len(given)} in all)" if len(given) > 6 else "")
        context.log.warn(
            f"effort limits of 0 on {shown} are taken for unknown and set to what moves the load twice over; "
            f"give the drives' own in the URDF"
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
        context.log.warn("an effort limit of 0 allows no motor; it swings freely", f'joint "{joint.name}"')
        return "none"
    return "velocity" if joint.type == "continuous" else "position"
