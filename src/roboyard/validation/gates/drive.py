"""Test that the base follows its commands: straight, in place and in arcs, forwards and backwards.

Each twist is commanded for two seconds and compared with the mean velocity in the second one, in the base's
own axes. Errors are relative to the largest commanded speed along the same axis.
"""

from __future__ import annotations

import numpy as np

from roboyard.robots import RegisteredRobot, Robot
from roboyard.robots.control import DifferentialDriveController, HolonomicBaseJointController
from roboyard.robots.stability.wheels import driven_wheels
from roboyard.transforms import Array
from roboyard.validation.report import Curve, Gate
from roboyard.validation.test_world import TestWorld, advance, zero_action

SPEED, TURN = 0.3, 0.8
"""Commanded speeds (m/s, rad/s), at most half of the highest speeds of the base."""
START_SECONDS, MEASURED_SECONDS = 1.0, 1.0
"""Durations of acceleration and of the measurement (s)."""
MAX_ERROR = 0.02
"""Largest error, as a fraction of the commanded speed."""
MAX_RADIUS_ERROR = 0.1
"""Largest error of the definition's wheel radius, as a fraction of it."""
TITLE = "The base follows its commands"


def drive_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Measure the largest error of any twist."""
    robot = test_world.robot()
    group = robot.groups.get("base")
    controller = group.controller if group is not None else None
    two_wheeled = isinstance(controller, DifferentialDriveController)
    holonomic = isinstance(controller, HolonomicBaseJointController)
    if controller is None or not (
        two_wheeled or (holonomic and controller.settings.motor_type == "velocity")
    ):
        skipped = (
            "the base has no velocity controller" if controller is not None else "the robot has no base group"
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
    findings = [
        f"commanded {_text(twist)}: measured {_text(velocity)}"
        for twist, velocity, error in zip(twists, measured, errors, strict=True)
        if not error.max() <= MAX_ERROR
    ]
    return (
        Gate(
            name="drive",
            title=TITLE,
            figure=float(errors.max()),
            threshold=MAX_ERROR,
            unit="of the speed",
            detail=f"{len(twists)} twists, mean of {MEASURED_SECONDS:g} s after {START_SECONDS:g} s",
            findings=[*findings, *_sizes(test_world)],
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


def _mean_velocity(robot: Robot, twist: Array) -> Array:
    """Return the mean velocity of the base under a twist from rest, in its own axes (m/s, rad/s)."""
    robot.reset()
    action = zero_action(robot)
    action[robot.controller_action_idx["base"]] = robot.controllers["base"].scaling.invert(twist)
    advance(robot, START_SECONDS, action)
    steps = round(MEASURED_SECONDS * robot.control_freq)
    speeds = np.zeros((steps, len(twist)))
    for k in range(steps):
        advance(robot, 1.0 / robot.control_freq, action)
        linear, angular = robot.velocity_in_base
        speeds[k] = (*linear[: len(twist) - 1], angular[2])
    return speeds.mean(axis=0)


def _text(twist: Array) -> str:
    *linear, turn = twist
    return f"({', '.join(f'{v:.3f}' for v in linear)} m/s, {turn:.3f} rad/s)"


def _sizes(test_world: TestWorld) -> list[str]:
    """Return findings about wheel sizes that differ between the definition and the shapes."""
    block, source = test_world.definition.two_wheel, test_world.source
    description = source.description(test_world.definition) if isinstance(source, RegisteredRobot) else source
    wheels = list(driven_wheels(test_world.definition, description).values())
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
