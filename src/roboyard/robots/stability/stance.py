"""Least gains of the joints of legs that carry a robot.

The inertia that an ankle moves with its foot in the air is small, and a drive that is sized by it yields
under the robot: standing, the ankle is the pivot of an inverted pendulum, which falls with the stiffness
m g h and turns with the inertia m h². Its drive has to be several times stiffer than the fall, and damped
for that inertia.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard.description.mass_properties import GRAVITY
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.robots.robot_body import RobotBody
from roboyard.transforms import Array, pose_matrix

STIFFER = 6.0
"""Stiffness of a leg's joint, in multiples of the one with which the robot above it topples."""
LEAST_ERROR = 0.03
"""Error at which a drive may use its full effort, as `roboyard.sim.actuation.gains` has it (rad)."""
DAMPING_RATIO = 0.7
"""Of the robot that sways above the joint."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Stance:
    """Least gains of n joints, zero where a joint carries nothing."""

    stiffness: Array
    """(n,) kp (N m/rad)."""
    damping: Array
    """(n,) kd (N m s/rad)."""


def stance_of(robot: RobotBody, posture: Array) -> Stance | None:
    """Return the least gains with which a robot's legs carry it; None for a robot that has none.

    Args:
        robot: standing on its locomotion joints, unless these are wheels or its base is fixed.
        posture: (n,) positions of its joints as it stands (rad or m).
    """
    block = robot.locomotion
    if block is None or robot.two_wheel is not None or robot.definition.holonomic_base is not None:
        return None
    if robot.body.is_fixed:
        return None
    names, description, scale = set(block.joint_names), robot.description, robot.body.scale
    poses = forward_kinematics(description, dict(zip(robot.joint_names, posture.tolist(), strict=True)))
    standing = robot.definition.standing_orientation
    if standing is not None:
        T_upright_root = pose_matrix(np.zeros(3), np.array(standing))
        poses = {name: T_upright_root @ pose for name, pose in poses.items()}
    masses, centres = [], []
    for link in description.links:
        if link.inertial is not None and link.inertial.mass > 0:
            pose = poses[link.name]
            masses.append(link.inertial.mass)
            centres.append(pose[:3, :3] @ np.asarray(link.inertial.origin.position) + pose[:3, 3])
    if not masses:
        return None
    centre = np.average(centres, axis=0, weights=masses)
    legs = 0
    for name in names:
        above = description.parent_joint.get(description.joint_by_name[name].parent)
        legs += above is None or above.name not in names
    stiffness, damping = np.zeros(len(robot.joint_names)), np.zeros(len(robot.joint_names))
    share = robot.mass / max(legs, 1)
    for index, name in enumerate(robot.joint_names):
        joint = description.joint_by_name.get(name)
        if name not in names or joint is None or joint.type != "revolute":
            continue
        pose = poses[joint.child]
        axis, lever = pose[:3, :3] @ np.asarray(joint.axis), scale * (centre - pose[:3, 3])
        topples = share * GRAVITY * max(float(lever[2]), 0.0) * (1.0 - float(axis[2]) ** 2)
        inertia = share * float(np.sum(np.cross(axis, lever) ** 2))
        stiffness[index] = min(STIFFER * topples, float(robot.limits.effort[index]) / LEAST_ERROR)
        damping[index] = 2.0 * DAMPING_RATIO * np.sqrt(max(STIFFER - 1.0, 0.0) * topples * inertia)
    return Stance(stiffness=stiffness, damping=damping)
