"""Keyframes of MJCF: the rest posture as `home`, the tucked one as `tuck`, standing on the floor."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from roboyard.export.mjcf.xml import add
from roboyard.export.start import height_above_floor, is_scalar, joint_positions, rest_posture, standing

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
    home = rest_posture(robot)
    postures = {"home": home}
    if robot.semantic.tuck:
        postures["tuck"] = {**home, **robot.semantic.tuck}
    keys = add(root, "keyframe")
    for name, posture in postures.items():
        values = joint_positions(robot, posture)
        x, y, z, w = standing(robot)
        numbers = [0.0, 0.0, height_above_floor(robot, values), w, x, y, z] if floating else []
        for joint in robot.description.depth_first_joints:
            if is_scalar(joint):
                numbers.append(values[joint.name])
            elif joint.type == "planar":
                numbers += [0.0] * len(joints[joint.name])
            elif joint.type in ("spherical", "floating"):
                numbers += [0.0] * (len(joints[joint.name]) - 1) + [1.0, 0.0, 0.0, 0.0]
        control = [values[joint] if robot.drives[joint] == "position" else 0.0 for joint in actuators]
        add(keys, "key", name=name, qpos=np.array(numbers), ctrl=np.array(control) if control else None)
