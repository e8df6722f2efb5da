"""Keyframes of MJCF: the rest posture as `home`, the tucked one as `tuck`, standing on the floor."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from roboyard.description.model import Joint, Quaternion
from roboyard.errors import MeshError
from roboyard.export.mjcf.xml import add
from roboyard.morphology.bounds import robot_bounds
from roboyard.morphology.upright import standing_orientation, turned
from roboyard.transforms import matrix_from_quaternion

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel


def add_keyframes(
    root: ET.Element,
    robot: RobotModel,
    joints: Mapping[str, tuple[str, ...]],
    actuators: tuple[str, ...],
    floating: bool,
) -> None:
    """Add a keyframe for each known posture; none without a rest posture.

    Args:
        root: `<mujoco>`.
        robot: with its postures.
        joints: joint to its joints in MuJoCo.
        actuators: joints that have an actuator, in order.
        floating: whether the root has a free joint; it is put on the floor.
    """
    if robot.planning is None or not robot.semantic.rest:
        return
    home = {**robot.semantic.rest, **robot.planning.lock_joints}
    postures = {"home": home}
    if robot.semantic.tuck:
        postures["tuck"] = {**home, **robot.semantic.tuck}
    keys = add(root, "keyframe")
    for name, posture in postures.items():
        values = _followed(robot, posture)
        numbers = _root(robot, values) if floating else []
        for joint in robot.description.depth_first_joints:
            if is_scalar(joint):
                numbers.append(values[joint.name])
            elif joint.type == "planar":
                numbers += [0.0] * len(joints[joint.name])
            elif joint.type in ("spherical", "floating"):
                numbers += [0.0] * (len(joints[joint.name]) - 1) + [1.0, 0.0, 0.0, 0.0]
        control = [values[joint] if robot.drives[joint] == "position" else 0.0 for joint in actuators]
        add(keys, "key", name=name, qpos=np.array(numbers), ctrl=np.array(control) if control else None)


def standing(robot: RobotModel) -> Quaternion:
    """Return the orientation (x, y, z, w) in which the robot stands."""
    fits = robot.semantic.base_link == robot.description.root.name
    return (standing_orientation(robot.semantic) if fits else None) or (0.0, 0.0, 0.0, 1.0)


def is_scalar(joint: Joint) -> bool:
    """Return whether a joint has one degree of freedom."""
    return joint.type in ("revolute", "continuous", "prismatic")


def _followed(robot: RobotModel, posture: Mapping[str, float]) -> dict[str, float]:
    """Return the position of each joint with one degree of freedom; mimic joints follow."""
    values = {}
    for joint in robot.description.depth_first_joints:
        if is_scalar(joint):
            value = posture.get(joint.name, 0.0)
            if joint.mimic is not None and joint.mimic.joint in posture:
                value = joint.mimic.multiplier * posture[joint.mimic.joint] + joint.mimic.offset
            values[joint.name] = value
    return values


def _root(robot: RobotModel, values: Mapping[str, float]) -> list[float]:
    """Return the free joint's seven numbers with the lowest point of the collision shapes on the floor."""
    x, y, z, w = standing(robot)
    upright = turned(robot.description, matrix_from_quaternion(np.array((x, y, z, w))))
    try:
        bounds = robot_bounds(upright, visual=False, positions=values)
    except MeshError:  # the shapes' writers report it
        bounds = None
    height = 0.0 if bounds is None else -float(bounds[0, 2])
    return [0.0, 0.0, height + 0.0, w, x, y, z]
