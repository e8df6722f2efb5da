"""Left alone with zero actions: does the robot overlap itself, come to rest, and stay where it is?"""

from __future__ import annotations

import numpy as np

from roboyard.robots import Robot
from roboyard.robots.control.rotations import vector_of_matrix
from roboyard.transforms import Array, matrix_from_quaternion
from roboyard.validation.report import Curve, Gate
from roboyard.validation.test_world import TestWorld, own_contacts, zero_action

OVERLAP = 2e-4
"""m: contacts this deep push."""
SETTLE_SECONDS, LOOK_SECONDS = 2.0, 0.25
SPEED = 0.02
"""rad/s or m/s at the end"""
DRIFT_SECONDS = 10.0
BASE_DRIFT, FLOATING_DRIFT = 1e-3, 5e-3
"""m: of a base that is bolted or on virtual joints, and of one that stands on its own wheels or legs"""
BASE_TURN = 5e-3
"""rad"""
JOINT_DRIFT = 5e-3
"""rad or m"""


def self_collision(bench: TestWorld) -> tuple[Gate, ...]:
    """Count pairs of links that overlap in the reset posture."""
    robot = bench.robot()
    pairs = [(a, b, depth) for a, b, depth in own_contacts(robot) if depth > OVERLAP]
    return (
        Gate(
            name="self_collision",
            title="No link overlaps another at rest",
            figure=float(len(pairs)),
            threshold=0.0,
            unit="pairs",
            detail=f"contacts deeper than {OVERLAP * 1e3:g} mm in the reset posture",
            findings=[f"{a} and {b} overlap by {depth * 1e3:.2f} mm" for a, b, depth in pairs],
            advice="add the pairs to disabled_collision_pairs, links that need no contact to"
            " disabled_collision_link_names, or import them with coacd",
        ),
    )


def settle(bench: TestWorld) -> tuple[Gate, ...]:
    """Fastest joint and base speed after two seconds of zero actions."""
    robot = bench.robot()
    action = zero_action(robot)
    steps = round(SETTLE_SECONDS * robot.control_freq)
    times, joints, bases, who = np.zeros(steps), np.zeros(steps), np.zeros(steps), ""
    last = steps - round(LOOK_SECONDS * robot.control_freq)
    worst = -1.0
    for k in range(steps):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
        v = np.abs(robot.joint_arrays.v)
        linear, angular = robot.base_link.velocity
        times[k], joints[k] = (k + 1) / robot.control_freq, v.max(initial=0.0)
        bases[k] = max(np.linalg.norm(linear), np.linalg.norm(angular))
        if k >= last and max(joints[k], bases[k]) > worst:
            worst = float(max(joints[k], bases[k]))
            who = robot.joint_names[int(v.argmax())] if len(v) and joints[k] >= bases[k] else "the base"
    return (
        Gate(
            name="settle",
            title="The robot comes to rest",
            figure=worst,
            threshold=SPEED,
            unit="rad/s or m/s",
            detail=f"largest speed in the last {LOOK_SECONDS:g} s of {SETTLE_SECONDS:g} s of zero "
            f"actions: {who}",
            findings=[f"{who} still moves at {worst:.3g}"] if worst > SPEED else [],
            advice="look at collision shapes that overlap, at inertias and masses off their scale, "
            "at damping and"
            " effort limits, and at isaac_kp and isaac_kd of the controller that drives the joint",
            curve=Curve(
                x=times,
                lines={"fastest joint": joints, "base": bases},
                x_label="time, s",
                y_label="speed, rad/s or m/s",
            ),
        ),
    )


def drift(bench: TestWorld) -> tuple[Gate, ...]:
    """How far base and joints are, after ten seconds of zero actions, from where they came to rest."""
    robot = bench.robot()
    action = zero_action(robot)
    for _ in range(round(SETTLE_SECONDS * robot.control_freq)):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
    start, turned = robot.pose
    q0 = robot.joint_arrays.q
    steps = round(DRIFT_SECONDS * robot.control_freq)
    times, moved, turns = np.zeros(steps), np.zeros(steps), np.zeros(steps)
    joints = np.zeros((steps, robot.n_dof))
    for k in range(steps):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
        position, quaternion = robot.pose
        times[k] = (k + 1) / robot.control_freq
        moved[k], turns[k] = np.linalg.norm(position - start), _turn(turned, quaternion)
        joints[k] = np.abs(robot.joint_arrays.q - q0)
    floating = not robot.body.is_fixed
    gates = [
        Gate(
            name="base_drift",
            title="The base stays where it is",
            figure=float(moved.max()),
            threshold=FLOATING_DRIFT if floating else BASE_DRIFT,
            unit="m",
            detail=f"largest distance from its place in {DRIFT_SECONDS:g} s of zero actions;"
            f" it turned by {turns.max():.2g} rad",
            advice="look at wheels (force_sphere_wheel_approximation, friction), at links that touch "
            "the floor"
            " besides them, and at the base controller",
            curve=Curve(
                x=times, lines={"moved, m": moved, "turned, rad": turns}, x_label="time, s", y_label="m, rad"
            ),
        )
    ]
    watched = _held(robot)
    worst = joints[:, watched].max(axis=0) if len(watched) else np.zeros(1)
    who = robot.joint_names[watched[int(worst.argmax())]] if len(watched) else "no joint"
    gates.append(
        Gate(
            name="joint_drift",
            title="Joints stay where they are",
            figure=float(worst.max()),
            threshold=JOINT_DRIFT,
            unit="rad or m",
            detail=f"largest way of a joint in the same time: {who}",
            findings=[f"{who} moved by {worst.max():.3g}"] if worst.max() > JOINT_DRIFT else [],
            advice="look at the joint's effort limit, at use_gravity_compensation, isaac_kp and isaac_kd",
            curve=Curve(
                x=times,
                lines={who: joints[:, watched[int(worst.argmax())]]} if len(watched) else {},
                x_label="time, s",
                y_label="rad or m",
            ),
        )
    )
    return tuple(gates)


def _turn(a: Array, b: Array) -> float:
    return float(np.linalg.norm(vector_of_matrix(matrix_from_quaternion(a).T @ matrix_from_quaternion(b))))


def _held(robot: Robot) -> list[int]:
    """Joints that drives hold; wheels that roll freely and virtual joints may do as they like."""
    held = {int(i) for group in robot.groups.values() if group.kind != "base" for i in group.indices}
    return sorted(held)
