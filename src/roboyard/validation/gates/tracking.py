"""Test that joints of arms, trunk and head reach a target under gravity, and do not overshoot it.

The base is held, above the floor where the robot has legs, which joints of its trunk may move; a holonomic
one stands on its wheels, and joints whose motion would tip it over are omitted. Each joint in turn moves a
step of up to 0.2 rad (or 5 cm) from the rest posture, in the direction that is free of contacts, all others
held. Its overshoot is measured beyond the target, its error as the mean of the last quarter of a second, both
as shares of the step. Joints whose gravity exceeds their effort limit cannot hold the target with any gains:
they are named with both numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from roboyard.robots import Robot
from roboyard.robots.control.joint import JointController
from roboyard.transforms import Array
from roboyard.validation.gates.weak_joints import text_of
from roboyard.validation.report import Curve, Gate
from roboyard.validation.test_world import TestWorld, all_contacts

TURN, SLIDE = 0.2, 0.05
"""Step of a revolute and of a prismatic joint (rad, m)."""
LEAST = 0.25
"""Smallest step, as a share of those, for joints with little room."""
MARGIN = 0.1
"""Part of a joint's range that stays free at each end."""
CHECKS = 4
"""Postures of the way that are checked for contacts."""
SETTLE, LONGEST = 2.0, 8.0
"""Time after the reference has arrived, and of a step in all (s)."""
MEASURED = 0.25
"""Last part of a step, in which the error is measured (s)."""
ABOVE = 1.0
"""Height above the floor at which robots on legs are held (m)."""
MAX_OVERSHOOT, MAX_ERROR = 0.05, 0.01
"""Largest overshoot and error, as shares of the step."""
KINDS = ("arm", "trunk", "camera")


@dataclass(frozen=True, kw_only=True, slots=True)
class Step:
    """The response of one joint to a step."""

    joint: str
    overshoot: float
    """Share of the step."""
    error: float
    """Share of the step."""
    cause: str
    """Why no gains could do better; empty where some could."""


def tracking_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Measure the largest overshoot and error of the joints of arms, trunk and head."""
    groups = [name for name in test_world.definition.controller_names() if name.split("_", 1)[0] in KINDS]
    if not groups:
        return summarize([], "no arm, trunk or head")
    keys = {
        "name": "JointController",
        "motor_type": "position",
        "use_delta_commands": False,
        "command_input_limits": None,
        "command_output_limits": None,
    }
    options: dict[str, Any] = {} if test_world.definition.holonomic_base is not None else {"fixed_base": True}
    if test_world.understood.get("base") == "legged":
        options["position"] = (0.0, 0.0, ABOVE)
    robot = test_world.robot(action_normalize=False, controllers=dict.fromkeys(groups, keys), **options)
    robot.world.step(round(SETTLE / robot.world.timestep))
    start = robot.world.save_state()
    usual = all_contacts(robot)
    steps = []
    for name in groups:
        if name not in robot.groups:
            continue
        for number in range(len(robot.groups[name].joints)):
            robot.world.restore_state(start)
            robot.loop.invalidate()
            target = _target(robot, name, number, usual)
            robot.world.restore_state(start)
            robot.loop.invalidate()
            if target is not None:
                step = _step(robot, name, number, target)
                steps += [] if step is None else [step]
    return summarize(steps, "" if steps else "no joint has room for a step")


def _target(robot: Robot, group: str, number: int, usual: set[tuple[str, str]]) -> float | None:
    """Return a free target of a joint (rad or m), None without room for a step; the posture is changed."""
    index = int(robot.groups[group].indices[number])
    here = robot.joint_arrays.q.copy()
    size = SLIDE if robot.joint_arrays.joints[index].type == "prismatic" else TURN
    low, high = robot.limits.lower[index], robot.limits.upper[index]
    room = MARGIN * (high - low) if np.isfinite(high - low) else 0.0
    for share in (1.0, 0.5, LEAST):
        for sign in (1.0, -1.0):
            target = float(here[index] + sign * share * size)
            if not low + room <= target <= high - room:
                continue
            if all(_free(robot, here, index, way, usual) for way in np.linspace(here[index], target, CHECKS)):
                return target
    return None


def _free(robot: Robot, here: Array, index: int, value: float, usual: set[tuple[str, str]]) -> bool:
    """Return whether a joint at a value causes no new contact."""
    q = here.copy()
    q[index] = value
    robot.joint_arrays.q = q
    return not all_contacts(robot) - usual


def _step(robot: Robot, group: str, number: int, target: float) -> Step | None:
    """Return the response of a joint to a step to its target; None where its balance stops it before."""
    index = int(robot.groups[group].indices[number])
    controller = robot.controllers[group]
    assert isinstance(controller, JointController)
    goal = robot.joint_positions[robot.groups[group].indices].copy()
    first = float(goal[number])
    goal[number] = target
    size = target - first
    robot.apply_action({group: goal})
    least, beyond, last = round(SETTLE * robot.control_freq), 0.0, []
    load, limit = abs(float(robot.joint_arrays.bias[index])), float(robot.limits.effort[index])
    arrived = None
    for k in range(round(LONGEST * robot.control_freq)):
        for _ in range(robot.steps_per_control):
            robot.world.step(1)
            beyond = max(beyond, (float(robot.joint_arrays.q[index]) - target) / size)
        last.append(float(robot.joint_arrays.q[index]))
        load = max(load, abs(float(robot.joint_arrays.bias[index])))
        reference = controller.reference
        if arrived is None and reference is not None and abs(reference[number] - target) < 1e-6:
            arrived = k
        if arrived is not None and k - arrived >= least:
            break
    if arrived is None and robot.definition.holonomic_base is not None:
        return None
    mean = float(np.mean(last[-round(MEASURED * robot.control_freq) :]))
    cause = text_of(load, limit) or blocked_by(robot, robot.joint_names[index])
    return Step(
        joint=robot.joint_names[index],
        overshoot=beyond,
        error=abs(mean - target) / abs(size),
        cause=cause,
    )


def blocked_by(robot: Robot, joint: str) -> str:
    """Return which link that a joint moves touches another body, as text; empty where none does."""
    for pair in sorted(all_contacts(robot)):
        other = next((name for name in pair if name.endswith("/")), None)
        own = next((name for name in pair if name != other), None)
        if other is not None and own is not None and _moves(robot, joint, own):
            return f"its link {own!r} touches {other.rstrip('/')!r}; mount the robot higher"
    return ""


def _moves(robot: Robot, joint: str, link: str) -> bool:
    """Return whether a joint is between a link and the root."""
    while (above := robot.description.parent_joint.get(link)) is not None:
        if above.name == joint:
            return True
        link = above.parent
    return False


def summarize(steps: list[Step], skipped: str) -> tuple[Gate, ...]:
    """Return the gates of overshoot and error.

    Args:
        steps: of all joints that were measured.
        skipped: why none was; empty otherwise.
    """
    order = np.arange(len(steps), dtype=float)
    figures = {
        "overshoot": np.array([step.overshoot for step in steps]),
        "error": np.array([step.error for step in steps]),
    }
    texts = {
        "overshoot": ("Joints do not overshoot", MAX_OVERSHOOT, "overshoots its target by"),
        "error": ("Joints reach their targets", MAX_ERROR, "stays off its target by"),
    }
    gates = []
    for name, (title, threshold, fault) in texts.items():
        values = figures[name]
        worst = [k for k in np.argsort(-values) if values[k] > threshold]
        gates.append(
            Gate(
                name=name,
                title=title,
                figure=float(values.max(initial=0.0)),
                threshold=threshold,
                unit="of the step",
                detail=f"{len(steps)} joints of arms, trunk and head, one step each from rest",
                findings=[
                    f"joint {steps[k].joint!r} {fault} {values[k]:.1%} of its step"
                    + (f"; {steps[k].cause}" if steps[k].cause else "")
                    for k in worst
                ],
                advice="effort limits and masses, isaac_kp and isaac_kd, use_gravity_compensation",
                curve=Curve(x=order, lines={name: values}, x_label="joint", y_label="share of the step")
                if steps
                else None,
                skipped=skipped,
            )
        )
    return tuple(gates)
