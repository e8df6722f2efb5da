"""Configure a spawned body by its definition: frictionless links, and inertia of motors."""

from __future__ import annotations

import numpy as np

from roboyard.robots.robot_body import RobotBody
from roboyard.sim.actuation.gains import (
    CONTROLLER,
    carrying_motor_inertia,
    effort_per_error,
    motor_inertia,
)

LOW_FRICTION = 0.1
"""A link whose file gives it a friction coefficient below this slides on any floor (casters, skids)."""

FINGER_SPINNING_FRICTION = 0.005
"""Of fingers (m): 2/3 mu r for a pad with a radius of 8 mm and a friction coefficient of 1."""


def configure_body(robot: RobotBody) -> None:
    """Make casters and the floor links of a holonomic base frictionless, let fingers hold against turning,
    and add default motor inertia.
    """
    _set_frictionless_links(robot)
    _set_finger_friction(robot)
    _add_motor_inertia(robot)


def _set_frictionless_links(robot: RobotBody) -> None:
    floor_links = robot.locomotion.floor_touching_links if robot.locomotion is not None else ()
    if robot.definition.holonomic_base is not None:
        for link in floor_links:
            link.set_frictionless()
        return
    if robot.two_wheel is not None and robot.locomotion is not None:
        driven = {joint.child.name for joint in map(robot.joint, robot.locomotion.joint_names)}
        for link in floor_links:
            if link.name not in driven:
                link.set_frictionless()
    for link in robot.description.links:
        given = link.contact.lateral_friction if link.contact is not None else None
        if given is not None and given < LOW_FRICTION:
            robot.link(link.name).set_frictionless(given)


def _set_finger_friction(robot: RobotBody) -> None:
    """Let fingers hold what they grip also against turning about the line between them.

    Two flat fingers touch a can in points on that line, about which it would swing like a pendulum.
    """
    block = robot.definition.manipulation
    for names in block.finger_link_names.values() if block is not None else ():
        for name in names:
            robot.link(name).set_friction(spinning=FINGER_SPINNING_FRICTION)


def _add_motor_inertia(robot: RobotBody) -> None:
    """Set the armature of arm, trunk, camera, finger, leg and wheel joints whose file has none."""
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
    arrays = robot.joint_arrays
    for index in arrays.indices_of(names):
        joint = arrays.joints[index]
        if joint.armature == 0.0:
            is_slide = np.array([joint.type == "prismatic"])
            stiffness = effort_per_error(CONTROLLER, robot.limits.effort[[index]], is_slide)
            joint.armature = float(motor_inertia(CONTROLLER, stiffness)[0])
    if robot.two_wheel is not None and robot.locomotion is not None and not robot.body.is_fixed:
        for joint in map(robot.joint, robot.locomotion.joint_names):
            if joint.armature == 0.0:
                joint.armature = carrying_motor_inertia(robot.mass / 2, robot.two_wheel.wheel_radius)
