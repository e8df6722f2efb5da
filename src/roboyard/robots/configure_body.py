"""What a definition makes of a body once it stands in a world: links that glide, motors with inertia."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboyard.sim.actuation.gains import (
    CONTROLLER,
    carrying_motor_inertia,
    effort_per_error,
    motor_inertia,
)

if TYPE_CHECKING:
    from roboyard.robots.robot_body import RobotBody

SLIDES = 0.1
"""A link whose file gives it less friction than this slides on any floor (casters, skids)."""


def configure(robot: RobotBody) -> None:
    """Let casters and a gliding base slide, and give motors the inertia that nobody gave them."""
    _let_slide(robot)
    _add_motor_inertia(robot)


def _let_slide(robot: RobotBody) -> None:
    floor_links = robot.locomotion.floor_touching_links if robot.locomotion is not None else ()
    if robot.definition.holonomic_base is not None:
        for link in floor_links:
            link.set_frictionless()
        return
    if robot.two_wheel is not None and robot.locomotion is not None:
        driven = {joint.child.name for joint in map(robot.body.joint, robot.locomotion.joint_names)}
        for link in floor_links:
            if link.name not in driven:
                link.set_frictionless()
    for link in robot.description.links:
        given = link.contact.lateral_friction if link.contact is not None else None
        if given is not None and given < SLIDES:
            robot.body.link(link.name).set_frictionless(given)


def _add_motor_inertia(robot: RobotBody) -> None:
    """Of arms, trunk, camera, fingers, legs and driven wheels."""
    definition = robot.definition
    names: list[str] = []
    if definition.manipulation is not None:
        block = definition.manipulation
        for by_arm in (block.arm_joint_names, block.finger_joint_names):
            names += [name for joints in by_arm.values() for name in joints]
    if definition.articulated_trunk is not None:
        names += definition.articulated_trunk.trunk_joint_names
    if definition.active_camera is not None:
        names += definition.active_camera.camera_joint_names
    is_legged = robot.two_wheel is None and definition.holonomic_base is None
    if robot.locomotion is not None and is_legged:
        names += robot.locomotion.joint_names
    for place in robot.joints.places(names):
        joint = robot.joints.joints[place]
        if joint.armature == 0.0:
            is_slide = np.array([joint.type == "prismatic"])
            stiffness = effort_per_error(CONTROLLER, robot.limits.effort[[place]], is_slide)
            joint.armature = float(motor_inertia(CONTROLLER, stiffness)[0])
    if robot.two_wheel is not None and robot.locomotion is not None and not robot.body.is_fixed:
        for joint in map(robot.body.joint, robot.locomotion.joint_names):
            if joint.armature == 0.0:
                joint.armature = carrying_motor_inertia(robot.body.mass / 2, robot.two_wheel.wheel_radius)
