"""MoveIt's YAML files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from roboyard.config.yaml_text import dump
from roboyard.export.moveit.groups import Group
from roboyard.export.planner import MAX_ACCELERATION

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel

SOLVER = "kdl_kinematics_plugin/KDLKinematicsPlugin"
"""Ships with MoveIt."""


def kinematics(groups: Sequence[Group]) -> str:
    """Return a solver for each group that is a chain."""
    return dump(
        {
            group.name: {
                "kinematics_solver": SOLVER,
                "kinematics_solver_search_resolution": 0.005,
                "kinematics_solver_timeout": 0.05,
            }
            for group in groups
            if group.chain is not None
        }
    )


def joint_limits(robot: RobotModel) -> str:
    """Return the largest speed and acceleration of each joint that moves on its own."""
    limits: dict[str, Any] = {}
    for joint in robot.description.joints:
        if joint.type not in ("revolute", "continuous", "prismatic") or joint.mimic is not None:
            continue
        velocity = joint.limit.velocity if joint.limit is not None else None
        has_velocity = velocity is not None and velocity > 0
        limits[joint.name] = {
            "has_velocity_limits": has_velocity,
            **({"max_velocity": float(velocity or 0.0)} if has_velocity else {}),
            "has_acceleration_limits": True,
            "max_acceleration": MAX_ACCELERATION,
        }
    header = ("Speeds are those of the URDF; accelerations are an assumption (rad/s² or m/s²).",)
    factors = {"default_velocity_scaling_factor": 0.1, "default_acceleration_scaling_factor": 0.1}
    return dump({**factors, "joint_limits": limits}, header=header)


def moveit_controllers(groups: Sequence[Group]) -> str:
    """Return the controllers of the groups, as `MoveItSimpleControllerManager` names them."""
    single = {group.name for group in groups if group.kind == "gripper" and len(group.joints) == 1}
    manager: dict[str, Any] = {"controller_names": [group.controller for group in groups]}
    for group in groups:
        manager[group.controller] = {
            "type": "GripperCommand" if group.name in single else "FollowJointTrajectory",
            "action_ns": "gripper_cmd" if group.name in single else "follow_joint_trajectory",
            "default": True,
            "joints": list(group.joints),
        }
    return dump(
        {
            "moveit_controller_manager": "moveit_simple_controller_manager/MoveItSimpleControllerManager",
            "moveit_simple_controller_manager": manager,
        }
    )
