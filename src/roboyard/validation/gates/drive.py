"""Test that the base follows its commands: straight, in place and in arcs, forwards and backwards.

Each twist is commanded for two seconds and compared with the mean velocity in the second one, in the base's
own axes. Errors are relative to the largest commanded speed along the same axis.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.robots import RegisteredRobot, Robot
from roboyard.robots.control import DifferentialDriveController, HolonomicBaseJointController
from roboyard.robots.definition.schema import TwoWheel
from roboyard.robots.stability.wheels import Wheel, driven_wheels
from roboyard.transforms import Array, conjugate, multiply, rotate
from roboyard.validation.report import Curve, Gate
from roboyard.validation.test_world import TestWorld, advance, zero_action

SPEED, TURN = 0.3, 0.8
"""Commanded speeds (m/s, rad/s), at most half of the highest speeds of the base."""
LEAST_LOAD = 0.2
"""Share of the weight on driven wheels below which they are named."""
START_SECONDS, MEASURED_SECONDS = 1.0, 1.0
"""Durations of acceleration and of the measurement (s)."""
MAX_ERROR = 0.02
"""Largest error, as a fraction of the commanded speed."""
SKID_TURN_ERROR = 0.4
"""The same of the yaw rate of a base with several wheels a side, which slip sideways in a curve."""
SKID_DRIFT = 0.05
"""The same of its forward speed in a curve: with its weight beside the middle it creeps along."""
MAX_VEER = 0.05
"""Largest sideways motion and turn (rad) in a drive with equal wheel speeds, as a share of the way."""
MAX_RADIUS_ERROR = 0.1
"""Largest error of the definition's wheel radius, as a fraction of it."""
WHEEL_SPEED = 5.0
"""Speed of wheels that are driven one by one (rad/s)."""
WHEEL_INERTIA = 4.0
"""Largest inertia of a wheel about its axle, as a multiple of its mass at the radius of its rim."""
LEVEL = 0.2
"""Largest |z| component of a wheel's axis."""
TITLE = "The base follows its commands"


def drive_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Measure the largest error of any twist."""
    robot = test_world.robot()
    group = robot.groups.get("base")
    controller = group.controller if group is not None else None
    two_wheeled = isinstance(controller, DifferentialDriveController)
    holonomic = isinstance(controller, HolonomicBaseJointController)
    wheels = _rolling_joints(robot)
    walks = test_world.understood.get("base") == "legged" and not test_world.understood.get("drive_wheels")
    if wheels and not two_wheeled and not holonomic and not walks:
        return (_straight(robot, wheels),)
    if controller is None or not (
        two_wheeled or (holonomic and controller.settings.motor_type == "velocity")
    ):
        skipped = (
            "the robot walks on legs and has no driven wheel"
            if walks
            else "the base has no velocity controller"
            if controller is not None
            else "the robot has no base group"
        )
        return (
            Gate(
                name="drive",
                title=TITLE,
                figure=0.0,
                threshold=MAX_ERROR,
                unit="of the speed",
                skipped=skipped,
            ),
        )
    fastest = np.abs(controller.limits.velocity)
    if isinstance(controller, DifferentialDriveController):
        top = controller.settings.wheel_radius * fastest[0]
        scale = np.array([min(SPEED, top / 2), min(TURN, top / controller.settings.wheel_axle_length)])
        twists = scale * np.array([(1, 0), (-1, 0), (0, 1), (0, -1), (0.6, 0.6), (-0.6, 0.6)])
    else:
        scale = np.minimum((SPEED, SPEED, TURN), fastest / 2)
        twists = scale * np.array([(1, 0, 0), (0, -1, 0), (0, 0, 1), (-0.5, 0.5, -0.5)])
    measured = np.array([_mean_velocity(robot, twist) for twist in twists])
    errors = np.abs(measured - twists) / scale
    if two_wheeled and controller.limits.size > 2:
        errors[:, 1] *= MAX_ERROR / SKID_TURN_ERROR
        errors[twists[:, 1] != 0.0, 0] *= MAX_ERROR / SKID_DRIFT
    findings = [
        f"commanded {_text(twist)}: measured {_text(velocity)}"
        for twist, velocity, error in zip(twists, measured, errors, strict=True)
        if not error.max() <= MAX_ERROR
    ]
    if findings:
        findings += unloaded_wheels(robot)
    return (
        Gate(
            name="drive",
            title=TITLE,
            figure=float(errors.max()),
            threshold=MAX_ERROR,
            unit="of the speed",
            detail=f"{len(twists)} twists, mean of {MEASURED_SECONDS:g} s after {START_SECONDS:g} s",
            findings=[*findings, *_wheels(test_world, is_lost=bool(findings))],
            advice="wheel_radius and wheel_axle_length, links that touch the floor beside the wheels (list "
            "casters"
            " in floor_touching_base_link_names), and effort limits of the wheels",
            curve=Curve(
                x=np.arange(len(twists), dtype=float),
                lines={"error": errors.max(axis=1)},
                x_label="index of the twist",
                y_label="fraction of the speed",
            ),
        ),
    )


def unloaded_wheels(robot: Robot) -> list[str]:
    """Return a finding about driven wheels that carry next to nothing; their tyres slip."""
    robot.reset()
    advance(robot, START_SECONDS, robot.no_op_action())
    wheels = {robot.joint(name).child.name for name in robot.groups["base"].joints}
    loads: dict[bool, float] = {True: 0.0, False: 0.0}
    for contact in robot.world.contacts(robot.body):
        if contact.body_a is not contact.body_b:
            link = contact.link_a if contact.body_a is robot.body else contact.link_b
            loads[link.name in wheels] += contact.normal_force
    total = loads[True] + loads[False]
    if total <= 0.0 or loads[True] > LEAST_LOAD * total:
        return []
    slides = [
        joint.name
        for name in wheels
        if (joint := robot.description.parent_joint.get(robot.description.parent_joint[name].parent))
        and joint.type == "prismatic"
    ]
    why = f"; their suspensions ({', '.join(sorted(slides))}) have no spring in the file" if slides else ""
    return [f"the driven wheels carry {loads[True]:.0f} N of {total:.0f} N, so that they slip{why}"]


def _rolling_joints(robot: Robot) -> dict[str, float]:
    """Return the wheels of a base that is driven joint by joint by speeds: joint to the direction, 1 or -1,
    that rolls the robot along its x axis, or along y where its axles are along x.
    """
    group = robot.groups.get("base")
    if group is None or group.controller.control_type != "velocity":
        return {}
    poses = forward_kinematics(robot.description)
    found = {}
    for name in group.joints:
        joint = robot.description.joint_by_name[name]
        axis = poses[joint.child][:3, :3] @ np.asarray(joint.axis)
        if joint.position_limits() is None and abs(axis[2]) < LEVEL:
            found[name] = float(np.sign(axis[np.argmax(np.abs(axis[:2]))]))
    return found if len(found) > 1 else {}


def _straight(robot: Robot, wheels: Mapping[str, float]) -> Gate:
    """Return the gate of driving with equal speeds of all wheels, each joint having a command of its own."""
    group = robot.groups["base"]
    fastest = min(float(robot.limits.velocity[robot.joint_arrays.index[name]]) for name in wheels)
    speeds = np.array([wheels.get(name, 0.0) * min(fastest / 2, WHEEL_SPEED) for name in group.joints])
    action = robot.no_op_action()
    action[robot.controller_action_idx["base"]] = group.controller.scaling.invert(speeds)
    advance(robot, START_SECONDS, action)
    start, before = robot.pose
    advance(robot, 2 * MEASURED_SECONDS, action)
    position, after = robot.pose
    way = rotate(conjugate(before), position - start)[:2]
    length = float(np.hypot(*way))
    turn = abs(float(multiply(conjugate(before), after)[2])) * 2
    veer = float(np.abs(way).min()) + turn * length
    figure = veer / length if length > 0.02 else float("nan")
    lost = (
        "" if length > 0.02 else f"it moved by only {length * 1e3:.0f} mm; its wheels spin or nothing turns"
    )
    found = [
        lost or f"in {length:.2f} m it went {np.abs(way).min():.2f} m sideways and turned by {turn:.2f} rad"
    ]
    return Gate(
        name="drive",
        title="Equal wheel speeds drive straight",
        figure=figure,
        threshold=MAX_VEER,
        unit="of the way",
        detail=f"{len(wheels)} wheels, {2 * MEASURED_SECONDS:g} s after {START_SECONDS:g} s",
        findings=[] if figure <= MAX_VEER else found,
        advice="axes of the wheels' joints, joints of wheels that are missing in base_joint_names, links "
        "that touch the floor beside the wheels",
    )


def _mean_velocity(robot: Robot, twist: Array) -> Array:
    """Return the mean velocity of the base under a twist from rest, in its own axes (m/s, rad/s)."""
    robot.reset()
    controller = robot.controllers["base"]
    action = zero_action(robot)
    action[robot.controller_action_idx["base"]] = robot.controllers["base"].scaling.invert(twist)
    advance(robot, START_SECONDS, action)
    steps = round(MEASURED_SECONDS * robot.control_freq)
    speeds = np.zeros((steps, len(twist)))
    for k in range(steps):
        advance(robot, 1.0 / robot.control_freq, action)
        linear, angular = robot.velocity_in_base
        if isinstance(controller, DifferentialDriveController):
            speeds[k] = (linear[:2] @ controller.forward, angular[2])
        else:
            speeds[k] = (*linear[:2], angular[2])
    return speeds.mean(axis=0)


def _text(twist: Array) -> str:
    *linear, turn = twist
    return f"({', '.join(f'{v:.3f}' for v in linear)} m/s, {turn:.3f} rad/s)"


def _wheels(test_world: TestWorld, *, is_lost: bool) -> list[str]:
    """Return findings about the sizes of the driven wheels and, where commands are lost, their inertia."""
    definition, source = test_world.definition, test_world.source
    description = source.description(definition) if isinstance(source, RegisteredRobot) else source
    wheels = list(driven_wheels(definition, description).values())
    found = _sizes(definition.two_wheel, wheels)
    return found + _heavy(description, wheels) if is_lost else found


def _sizes(block: TwoWheel | None, wheels: Sequence[Wheel]) -> list[str]:
    """Return findings about wheel sizes that differ between the definition and the shapes."""
    if block is None or len(wheels) != 2:
        return []
    found = [
        f"two_wheel.wheel_radius is {block.wheel_radius:g} m; the shapes of {wheel.link} reach"
        f" {wheel.radius:.4g} m"
        for wheel in wheels
        if abs(wheel.radius - block.wheel_radius) > MAX_RADIUS_ERROR * block.wheel_radius
    ]
    apart = abs(wheels[0].side - wheels[1].side)
    if abs(apart - block.wheel_axle_length) > 1e-6:
        found.append(
            f"two_wheel.wheel_axle_length is {block.wheel_axle_length:g} m; the wheels' shapes allow at"
            f" most {apart:.4g} m"
        )
    return found


def _heavy(description: RobotDescription, wheels: Sequence[Wheel]) -> list[str]:
    """Return a finding about the first wheel whose inertia is beyond that of any wheel of its size."""
    for wheel in wheels:
        inertial = description.link_by_name[wheel.link].inertial
        if inertial is None:
            continue
        axis = inertial.origin.matrix()[:3, :3].T @ np.asarray(wheel.joint.axis)
        about = float(axis @ inertial.matrix() @ axis)
        rim = inertial.mass * wheel.radius**2
        if about > WHEEL_INERTIA * rim:
            return [
                f"link {wheel.link!r}: its inertia about the axle is {about:.2g} kg m²; its mass at the "
                f"rim has {rim:.2g}, so that the base tips over its wheels when they accelerate; correct "
                "<inertia>"
            ]
    return []
