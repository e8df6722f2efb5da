"""How an exported robot starts: its joints at rest, upright, with its lowest point on the floor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from roboyard.description.model import Joint, Quaternion
from roboyard.errors import MeshError
from roboyard.morphology.bounds import robot_bounds
from roboyard.morphology.upright import standing_orientation, turned
from roboyard.transforms import matrix_from_quaternion

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel


def rest_posture(robot: RobotModel) -> dict[str, float]:
    """Return the positions (rad or m) of joints at rest, those that the planner holds included."""
    locked = {} if robot.planning is None else robot.planning.lock_joints
    return {**robot.semantic.rest, **locked}


def is_scalar(joint: Joint) -> bool:
    """Return whether a joint has one degree of freedom."""
    return joint.type in ("revolute", "continuous", "prismatic")


def joint_positions(robot: RobotModel, posture: Mapping[str, float]) -> dict[str, float]:
    """Return the position (rad or m) of each joint with one degree of freedom; mimic joints follow."""
    values = {}
    for joint in robot.description.depth_first_joints:
        if is_scalar(joint):
            value = posture.get(joint.name, 0.0)
            if joint.mimic is not None and joint.mimic.joint in posture:
                value = joint.mimic.multiplier * posture[joint.mimic.joint] + joint.mimic.offset
            values[joint.name] = value
    return values


def standing(robot: RobotModel) -> Quaternion:
    """Return the orientation (x, y, z, w) in which the robot stands."""
    fits = robot.semantic.base_link == robot.description.root.name
    return (standing_orientation(robot.semantic) if fits else None) or (0.0, 0.0, 0.0, 1.0)


def height_above_floor(robot: RobotModel, values: Mapping[str, float]) -> float:
    """Return the height (m) of the root at which the standing robot's collision shapes touch the floor.

    Args:
        robot: with its description.
        values: positions of its joints, see `joint_positions`.
    """
    upright = turned(robot.description, matrix_from_quaternion(np.array(standing(robot))))
    try:
        bounds = robot_bounds(upright, visual=False, positions=values)
    except MeshError:  # the shapes' writers report it
        bounds = None
    return 0.0 if bounds is None else 0.0 - float(bounds[0, 2])
