"""A holonomic base: wheel joints are fixed, and six virtual joints move the robot; x, y and rz are driven.

    base_footprint_x -x-> base_footprint_y -y-> base_footprint_z -z-> base_footprint_rx -rx->
    base_footprint_ry -ry-> base_footprint_rz -rz-> the vendor's root link

The parent of joint `base_footprint_<a>_joint` is link `base_footprint_<a>`; all frames coincide at zero.
"""

from __future__ import annotations

import math
from dataclasses import replace

from roboyard.description.model import Joint, Limit, Link, Vector3
from roboyard.description.robot_model import RobotModel
from roboyard.importer.config.checks import VIRTUAL_AXES, virtual_joints
from roboyard.importer.context import ImportContext

DIRECTIONS: dict[str, Vector3] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
DRIVEN = ("base_footprint_x_joint", "base_footprint_y_joint", "base_footprint_rz_joint")
"""Virtual joints that have a drive."""
EFFORT = 1000.0
"""Effort limit of the virtual joints, as in OmniGibson (N and N m)."""
LINEAR_SPEED, ANGULAR_SPEED = 1.5, math.pi
"""Velocity limits of the virtual joints, as in OmniGibson (m/s and rad/s)."""


def add_virtual_joints(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot on its virtual joints, where `use_holonomic_joints` is set."""
    base = context.config.base_motion
    if not base.use_holonomic_joints:
        return robot
    description = robot.description
    wheels = set(base.wheel_joints)
    joints = tuple(frozen(j) if j.name in wheels else j for j in description.joints)
    for joint in description.joints:
        if joint.name in wheels and joint.is_moving:
            context.log.note("fixed: the base moves by its virtual joints", f'joint "{joint.name}"')
        elif joint.mimic is not None and joint.mimic.joint in wheels and joint.name not in wheels:
            context.log.warn("mimics a joint that became fixed; fixed too", f'joint "{joint.name}"')
    joints = tuple(frozen(j) if j.mimic is not None and j.mimic.joint in wheels else j for j in joints)
    links, virtual = virtual_base(description.root.name)
    context.log.note(f"six virtual joints move {description.root.name!r}; x, y and rz are driven")
    return replace(
        robot,
        description=replace(description, links=(*links, *description.links), joints=(*virtual, *joints)),
        solids={**{link.name: () for link in links}, **robot.solids},
        semantic=replace(
            robot.semantic, base="holonomic", virtual_joints=virtual_joints(), base_joints=DRIVEN
        ),
    )


def virtual_base(root: str) -> tuple[tuple[Link, ...], tuple[Joint, ...]]:
    """Return the six virtual links and joints above a root link, in order."""
    names = [f"base_footprint_{axis}" for axis in VIRTUAL_AXES]
    joints = []
    for index, axis in enumerate(VIRTUAL_AXES):
        turns = axis.startswith("r")
        joints.append(
            Joint(
                name=f"{names[index]}_joint",
                type="continuous" if turns else "prismatic",
                parent=names[index],
                child=names[index + 1] if index + 1 < len(names) else root,
                axis=DIRECTIONS[axis[-1]],
                limit=Limit(effort=EFFORT, velocity=ANGULAR_SPEED if turns else LINEAR_SPEED),
            )
        )
    return tuple(Link(name=name) for name in names), tuple(joints)


def frozen(joint: Joint) -> Joint:
    """Return the joint fixed at its zero position."""
    if not joint.is_moving:
        return joint
    return replace(joint, type="fixed", limit=None, mimic=None, damping=0.0, friction=0.0)
