"""Does the base go where it is told: straight, in place and in arcs, forwards and backwards?

Each twist is commanded for two seconds; the mean over the second one, in the base's own axes, is held against
it. Errors count relative to the largest speed that is asked for along the same axis.
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
"""m/s and rad/s, or half of what the base can do where that is less"""
START_SECONDS, LOOK_SECONDS = 1.0, 1.0
OFF = 0.02
"""Share of the speed asked for"""
SIZE_OFF = 0.1
"""Share by which the definition's wheel radius may differ from the shapes'"""
TITLE = "The base follows its commands"


def drive(bench: TestWorld) -> tuple[Gate, ...]:
    """Largest error of any twist."""
    robot = bench.robot()
    group = robot.groups.get("base")
    controller = group.controller if group is not None else None
    two_wheeled = isinstance(controller, DifferentialDriveController)
    holonomic = isinstance(controller, HolonomicBaseJointController)
    if controller is None or not (
        two_wheeled or (holonomic and controller.settings.motor_type == "velocity")
    ):
        told = "the base takes no speeds" if controller is not None else "the robot has no base to drive"
        return (
            Gate(name="drive", title=TITLE, figure=0.0, threshold=OFF, unit="of the speed", skipped=told),
        )
    fastest = np.abs(controller.limits.velocity)
    if isinstance(controller, DifferentialDriveController):
        top = controller.settings.wheel_radius * fastest[0]
        scale = np.array([min(SPEED, top / 2), min(TURN, top / controller.settings.wheel_axle_length)])
        twists = scale * np.array([(1, 0), (-1, 0), (0, 1), (0, -1), (0.6, 0.6), (-0.6, 0.6)])
    else:
        scale = np.minimum((SPEED, SPEED, TURN), fastest / 2)
        twists = scale * np.array([(1, 0, 0), (0, -1, 0), (0, 0, 1), (-0.5, 0.5, -0.5)])
    seen = np.array([_followed(robot, twist) for twist in twists])
    errors = np.abs(seen - twists) / scale
    findings = [
        f"told {_told(twist)}: went {_told(was)}"
        for twist, was, error in zip(twists, seen, errors, strict=True)
        if not error.max() <= OFF
    ]
    return (
        Gate(
            name="drive",
            title=TITLE,
            figure=float(errors.max()),
            threshold=OFF,
            unit="of the speed",
            detail=f"{len(twists)} twists, mean of {LOOK_SECONDS:g} s after {START_SECONDS:g} s",
            findings=[*findings, *_sizes(bench)],
            advice="look at wheel_radius and wheel_axle_length, at links that touch the floor beside the"
            " wheels (name casters in floor_touching_base_link_names), and at effort limits of the wheels",
            curve=Curve(
                x=np.arange(len(twists), dtype=float),
                lines={"error": errors.max(axis=1)},
                x_label="number of the twist",
                y_label="share of the speed",
            ),
        ),
    )


def _followed(robot: Robot, twist: Array) -> Array:
    """Mean speeds of the base under a twist, from rest; m/s and rad/s."""
    robot.reset()
    action = zero_action(robot)
    action[robot.controller_action_idx["base"]] = robot.controllers["base"].scaling.invert(twist)
    advance(robot, START_SECONDS, action)
    steps = round(LOOK_SECONDS * robot.control_freq)
    speeds = np.zeros((steps, len(twist)))
    for k in range(steps):
        advance(robot, 1.0 / robot.control_freq, action)
        linear, angular = robot.velocity_in_base
        speeds[k] = (*linear[: len(twist) - 1], angular[2])
    return speeds.mean(axis=0)


def _told(twist: Array) -> str:
    *linear, turn = twist
    return f"({', '.join(f'{v:.3f}' for v in linear)} m/s, {turn:.3f} rad/s)"


def _sizes(bench: TestWorld) -> list[str]:
    """Where the wheels' shapes are not what the definition says."""
    block, source = bench.definition.two_wheel, bench.source
    description = source.description(bench.definition) if isinstance(source, RegisteredRobot) else source
    wheels = list(driven_wheels(bench.definition, description).values())
    if block is None or len(wheels) != 2:
        return []
    found = [
        f"two_wheel.wheel_radius is {block.wheel_radius:g} m; the shapes of {wheel.link} reach"
        f" {wheel.radius:.4g} m"
        for wheel in wheels
        if abs(wheel.radius - block.wheel_radius) > SIZE_OFF * block.wheel_radius
    ]
    apart = abs(wheels[0].side - wheels[1].side)
    if abs(apart - block.wheel_axle_length) > 1e-6:
        found.append(
            f"two_wheel.wheel_axle_length is {block.wheel_axle_length:g} m; wheels so far apart would lie"
            f" beside their shapes, which end at {apart:.4g} m"
        )
    return found
