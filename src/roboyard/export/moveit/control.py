"""`ros2_control`: the tag that names each joint's interfaces, and the controllers that use them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from roboyard.config.yaml_text import dump
from roboyard.export.moveit.groups import Group
from roboyard.export.names import identifier

if TYPE_CHECKING:
    from roboyard.description.model import Joint
    from roboyard.description.robot_model import RobotModel

XACRO = "http://www.ros.org/wiki/xacro"
HARDWARE = "mock_components/GenericSystem"
"""Follows its commands at once; a simulator or a robot has its own plugin, given by the macro's argument."""
RATE = 100
"""Hz"""


def control_text(robot: RobotModel) -> str:
    """Return a xacro file with the macro `<name>_ros2_control`, whose parameters are a name and a plugin."""
    ET.register_namespace("xacro", XACRO)
    name = identifier(robot.name, "robot")
    root = ET.Element("robot")
    macro = ET.SubElement(
        root, f"{{{XACRO}}}macro", name=f"{name}_ros2_control", params=f"name:={name} plugin:={HARDWARE}"
    )
    control = ET.SubElement(macro, "ros2_control", name="${name}", type="system")
    ET.SubElement(ET.SubElement(control, "hardware"), "plugin").text = "${plugin}"
    for joint in robot.description.joints:
        kind = robot.drives.get(joint.name, "none")
        follows = joint.mimic is not None
        if joint.type in ("revolute", "continuous", "prismatic") and (kind != "none" or follows):
            _add_joint(control, joint, kind, robot.semantic.rest.get(joint.name, 0.0))
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _add_joint(control: ET.Element, joint: Joint, kind: str, rest: float) -> None:
    element = ET.SubElement(control, "joint", name=joint.name)
    if joint.mimic is None:
        command = ET.SubElement(element, "command_interface", name=kind)
        for key, value in _range(joint, kind).items():
            ET.SubElement(command, "param", name=key).text = repr(value)
    for state in ("position", "velocity"):
        interface = ET.SubElement(element, "state_interface", name=state)
        if state == "position" and rest:
            ET.SubElement(interface, "param", name="initial_value").text = repr(float(rest))


def _range(joint: Joint, kind: str) -> dict[str, float]:
    """Return the smallest and the largest command; empty where the joint has no such limit."""
    limits = joint.position_limits() if kind == "position" else None
    if limits is None and kind != "position" and joint.limit is not None:
        most = getattr(joint.limit, kind)
        limits = (-most, most) if most else None
    return {} if limits is None else {"min": float(limits[0]), "max": float(limits[1])}


def ros2_controllers(robot: RobotModel, groups: Sequence[Group]) -> str:
    """Return the parameters of the controller manager and of each controller."""
    manager: dict[str, Any] = {
        "update_rate": RATE,
        "joint_state_broadcaster": {"type": "joint_state_broadcaster/JointStateBroadcaster"},
    }
    parameters: dict[str, Any] = {}
    for group in groups:
        driven = [joint for joint in group.joints if robot.drives.get(joint, "none") != "none"]
        if not driven:
            continue
        kinds = sorted({str(robot.drives[joint]) for joint in driven})
        if group.kind == "gripper" and len(driven) == 1 and kinds == ["position"]:
            manager[group.controller] = {"type": "position_controllers/GripperActionController"}
            parameters[group.controller] = {"ros__parameters": {"joint": driven[0]}}
            continue
        manager[group.controller] = {"type": "joint_trajectory_controller/JointTrajectoryController"}
        parameters[group.controller] = {
            "ros__parameters": {
                "joints": driven,
                "command_interfaces": kinds,
                "state_interfaces": ["position", "velocity"],
            }
        }
    base = _base(robot)
    if base is not None:
        manager["base_controller"] = {"type": "diff_drive_controller/DiffDriveController"}
        parameters["base_controller"] = {"ros__parameters": base}
    return dump({"controller_manager": {"ros__parameters": manager}, **parameters})


def _base(robot: RobotModel) -> dict[str, Any] | None:
    """Return the parameters of a differential drive, skid steering too; None for other bases."""
    semantic = robot.semantic
    wheels = [wheel for wheel in semantic.driven_wheels if wheel.steer_joint is None]
    if semantic.base != "differential" or not wheels:
        return None
    middle = sum(wheel.centre[1] for wheel in wheels) / len(wheels)
    left = [wheel for wheel in wheels if wheel.centre[1] > middle]
    right = [wheel for wheel in wheels if wheel.centre[1] <= middle]
    if not left or not right:
        return None
    sides = [sum(wheel.centre[1] for wheel in side) / len(side) for side in (left, right)]
    return {
        "left_wheel_names": [wheel.joint for wheel in left],
        "right_wheel_names": [wheel.joint for wheel in right],
        "wheel_separation": float(sides[0] - sides[1]),
        "wheel_radius": float(sum(wheel.radius for wheel in wheels) / len(wheels)),
        "base_frame_id": semantic.base_link,
        "use_stamped_vel": False,
    }
