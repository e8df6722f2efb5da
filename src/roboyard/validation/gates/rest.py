"""Test a robot under zero actions: no self-collision, it comes to rest, and it does not drift."""

from __future__ import annotations

import math

import numpy as np

from roboyard.robots import Robot
from roboyard.robots.control.rotations import vector_of_matrix
from roboyard.transforms import Array, matrix_from_quaternion
from roboyard.validation.gates.weak_joints import because_loose, because_weak
from roboyard.validation.report import Curve, Gate
from roboyard.validation.test_world import TestWorld, own_contacts, zero_action

OVERLAP = 2e-4
"""Penetration of two links that counts as a self-collision (m)."""
SETTLE_SECONDS, MEASURED_SECONDS = 2.0, 0.25
"""Duration of the test, and its last part in which speeds are measured (s)."""
LEGGED_SETTLE_SECONDS = 5.0
"""Duration of the test for a robot that sways on its legs (s): a period or two of an inverted pendulum."""
LONGEST_SETTLE_SECONDS = 10.0
"""Duration of the test for the longest travel of fingers (s)."""
FINGER_TURN, FINGER_SLIDE = 0.2, 0.03
"""Speeds at which fingers are taken to travel where the file allows more (rad/s, m/s): drives are damped so
that fingers with much inertia close no faster than this at their effort limit."""
MAX_SPEED = 0.02
"""Largest speed at rest (rad/s or m/s)."""
DRIFT_SECONDS = 10.0
"""Duration of the drift test (s)."""
BASE_DRIFT, FLOATING_DRIFT = 1e-3, 5e-3
"""Largest motion of a fixed or holonomic base, and of one on its own wheels or legs (m)."""
JOINT_DRIFT = 5e-3
"""Largest motion of a joint (rad or m)."""


def self_collision_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Count the pairs of links that overlap in the reset posture."""
    robot = test_world.robot()
    pairs = [(a, b, depth) for a, b, depth in own_contacts(robot.world, robot.body) if depth > OVERLAP]
    return (
        Gate(
            name="self_collision",
            title="No self-collision at rest",
            figure=float(len(pairs)),
            threshold=0.0,
            unit="pairs",
            detail=f"contacts deeper than {OVERLAP * 1e3:g} mm in the reset posture",
            findings=[f"{a} and {b} overlap by {depth * 1e3:.2f} mm" for a, b, depth in pairs],
            advice="add the pairs to disabled_collision_pairs, links that need no contact to"
            " disabled_collision_link_names, or import them with coacd",
        ),
    )


def settle_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Measure the largest speed of joints and base after a few seconds of zero actions.

    It is the mean over a control step: feet that stand on hard floor tremble by 0.1 mrad within one.
    """
    robot = test_world.robot()
    action = zero_action(robot)
    seconds = _settle_seconds(robot)
    steps = round(seconds * robot.control_freq)
    times, joints, bases, fastest = np.zeros(steps), np.zeros(steps), np.zeros(steps), ""
    last = steps - round(MEASURED_SECONDS * robot.control_freq)
    worst = -1.0
    before, (place, turn) = robot.joint_positions, robot.pose
    for k in range(steps):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
        now, (position, quaternion) = robot.joint_positions, robot.pose
        v = np.abs(now - before) * robot.control_freq
        linear, angular = np.linalg.norm(position - place), _angle_between(turn, quaternion)
        times[k], joints[k] = (k + 1) / robot.control_freq, v.max(initial=0.0)
        bases[k] = max(linear, angular) * robot.control_freq
        before, place, turn = now, position, quaternion
        if k >= last and max(joints[k], bases[k]) > worst:
            worst = float(max(joints[k], bases[k]))
            fastest = robot.joint_names[int(v.argmax())] if len(v) and joints[k] >= bases[k] else "the base"
    return (
        Gate(
            name="settle",
            title="The robot comes to rest",
            figure=worst,
            threshold=MAX_SPEED,
            unit="rad/s or m/s",
            detail=f"largest mean speed in a control step, in the last {MEASURED_SECONDS:g} of "
            f"{seconds:g} s of zero actions: {fastest}",
            findings=[f"{fastest} still moves at {worst:.3g}{because_loose(robot, fastest)}"]
            if worst > MAX_SPEED
            else [],
            advice="overlapping collision shapes, implausible masses and inertias, damping and effort "
            "limits, and"
            " isaac_kp and isaac_kd of the joint's controller",
            curve=Curve(
                x=times,
                lines={"fastest joint": joints, "base": bases},
                x_label="time, s",
                y_label="speed, rad/s or m/s",
            ),
        ),
    )


def drift_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Measure the motion of base and joints in ten seconds of zero actions, once at rest."""
    robot = test_world.robot()
    action = zero_action(robot)
    for _ in range(round(_settle_seconds(robot) * robot.control_freq)):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
    start, start_rotation = robot.pose
    q0 = robot.joint_positions
    steps = round(DRIFT_SECONDS * robot.control_freq)
    times, moved, turns = np.zeros(steps), np.zeros(steps), np.zeros(steps)
    joints = np.zeros((steps, robot.n_dof))
    for k in range(steps):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
        position, quaternion = robot.pose
        times[k] = (k + 1) / robot.control_freq
        moved[k], turns[k] = np.linalg.norm(position - start), _angle_between(start_rotation, quaternion)
        joints[k] = np.abs(robot.joint_positions - q0)
    floating = not robot.body.is_fixed
    gates = [
        Gate(
            name="base_drift",
            title="The base does not drift",
            figure=float(moved.max()),
            threshold=FLOATING_DRIFT if floating else BASE_DRIFT,
            unit="m",
            detail=f"largest distance from the start in {DRIFT_SECONDS:g} s of zero actions;"
            f" rotation {turns.max():.2g} rad",
            advice="wheels (force_sphere_wheel_approximation, friction), other links that touch the floor, "
            "and the"
            " base controller",
            curve=Curve(
                x=times, lines={"moved, m": moved, "turned, rad": turns}, x_label="time, s", y_label="m, rad"
            ),
        )
    ]
    watched = _controlled(robot)
    worst = joints[:, watched].max(axis=0) if len(watched) else np.zeros(1)
    fastest = robot.joint_names[watched[int(worst.argmax())]] if len(watched) else "no joint"
    gates.append(
        Gate(
            name="joint_drift",
            title="Joints do not drift",
            figure=float(worst.max()),
            threshold=JOINT_DRIFT,
            unit="rad or m",
            detail=f"largest motion of a joint in the same time: {fastest}",
            findings=[f"{fastest} moved by {worst.max():.3g}{because_weak(robot, fastest)}"]
            if worst.max() > JOINT_DRIFT
            else [],
            advice="the joint's effort limit, use_gravity_compensation, isaac_kp and isaac_kd",
            curve=Curve(
                x=times,
                lines={fastest: joints[:, watched[int(worst.argmax())]]} if len(watched) else {},
                x_label="time, s",
                y_label="rad or m",
            ),
        )
    )
    return tuple(gates)


def _settle_seconds(robot: Robot) -> float:
    """Return how long a robot may take to come to rest (s): a zero action opens grippers, and the fingers of
    some hands have several turns to go.
    """
    travel = 0.0
    on_legs = "base" in robot.groups and robot.two_wheel is None and not robot.body.is_fixed
    least = LEGGED_SETTLE_SECONDS if on_legs else SETTLE_SECONDS
    for name, controller in robot.controllers.items():
        if name.startswith("gripper_"):
            limits = controller.limits
            slides = [robot.joint(joint).type == "prismatic" for joint in robot.groups[name].joints]
            speed = np.where(slides, FINGER_SLIDE, FINGER_TURN)
            with np.errstate(divide="ignore", invalid="ignore"):
                times = (limits.upper - limits.lower) / np.minimum(limits.velocity, speed)
            travel = max(travel, float(np.where(np.isfinite(times), times, 0.0).max(initial=0.0)))
    return min(max(least, math.ceil(travel) + MEASURED_SECONDS), LONGEST_SETTLE_SECONDS)


def _angle_between(a: Array, b: Array) -> float:
    """Return the angle (rad) between two (4,) quaternions x, y, z, w."""
    return float(np.linalg.norm(vector_of_matrix(matrix_from_quaternion(a).T @ matrix_from_quaternion(b))))


def _controlled(robot: Robot) -> list[int]:
    """Return the indices of joints with a controller, except those of the base."""
    controlled = {int(i) for group in robot.groups.values() if group.kind != "base" for i in group.indices}
    return sorted(controlled)
