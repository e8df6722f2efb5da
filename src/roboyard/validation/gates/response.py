"""Does every controller move its own joints, and no others?

Each number of each command is nudged alone, up and then down, for half a second; beside it the same robot
does nothing. A joint's response is the largest difference between the two.
"""

from __future__ import annotations

import numpy as np

from roboyard.robots import Robot
from roboyard.robots.joint_arrays import Indices
from roboyard.transforms import Array
from roboyard.validation.report import Curve, Gate
from roboyard.validation.test_world import TestWorld

SECONDS = 0.5
NUDGE = 0.1
"""Of the command's range."""
MOVES = 2e-3
"""rad or m: what counts as a response"""
LEAK = 0.1
"""Share of the response that other joints may show"""


def response(bench: TestWorld) -> tuple[Gate, ...]:
    """Least response of any command, and largest motion of joints that were not meant."""
    robot = bench.robot()
    if robot.action_dim == 0:
        return (
            Gate(
                name="response",
                title="Every command moves its joints",
                figure=0.0,
                threshold=MOVES,
                unit="rad or m",
                skipped="no controller takes commands",
            ),
        )
    idle = robot.no_op_action()
    robot.world.step(1)
    start = robot.world.save_state()
    _settle(robot, idle)
    start = robot.world.save_state()
    still = _run(robot, start, idle)
    moved, leaks, findings, labels = [], [], [], []
    for name, numbers in robot.controller_action_idx.items():
        own = _own(robot, name)
        for k in range(numbers.stop - numbers.start):
            best, leak, culprit = 0.0, 0.0, ""
            for sign in (1.0, -1.0):
                action = idle.copy()
                action[numbers.start + k] = _nudged(robot, name, float(idle[numbers.start + k]), sign)
                apart = np.abs(_run(robot, start, action) - still)
                answer = float(apart[:, own].max())
                if answer > best:
                    others = np.setdiff1d(np.arange(robot.n_dof), _related(robot, name))
                    worst = apart[:, others].max(axis=0) if len(others) else np.zeros(1)
                    best, leak = answer, float(worst.max()) / answer
                    culprit = robot.joint_names[others[int(worst.argmax())]] if len(others) else ""
            moved.append(best)
            leaks.append(leak if best > MOVES else 0.0)
            labels.append(f"{name}[{k}]")
            if best < MOVES:
                findings.append(f"{name}[{k}] moves its joints by {best:.2g} only")
            if leaks[-1] > LEAK:
                findings.append(f"{name}[{k}] also moves {culprit}, by {leak:.0%} of its own motion")
    x = np.arange(len(moved), dtype=float)
    weakest = labels[int(np.argmin(moved))]
    return (
        Gate(
            name="response",
            title="Every command moves its joints",
            figure=float(min(moved)),
            threshold=MOVES,
            unit="rad or m",
            sense="at least",
            detail=f"{len(moved)} numbers nudged by {NUDGE:g} for {SECONDS:g} s; least response: {weakest}",
            findings=[line for line in findings if "only" in line],
            advice="look at the joint names of the group, at effort and velocity limits, at joints "
            "that mimic others,"
            " and at command_output_limits",
            curve=Curve(
                x=x,
                lines={"own joints": np.array(moved), "others": np.array(moved) * np.array(leaks)},
                x_label="number of the action",
                y_label="rad or m",
            ),
        ),
        Gate(
            name="isolation",
            title="No command moves other joints",
            figure=float(max(leaks)),
            threshold=LEAK,
            unit="of its own motion",
            detail="largest motion of a joint outside the group",
            findings=[line for line in findings if "also" in line],
            advice="look at collision shapes that touch, at stiffness of the joints that give way, "
            "and at the joint"
            " names of both groups",
        ),
    )


def _settle(robot: Robot, idle: Array) -> None:
    for _ in range(round(robot.control_freq)):
        robot.apply_action(idle)
        robot.world.step(robot.steps_per_control)


def _run(robot: Robot, start: object, action: Array) -> Array:
    """(steps, n) joint positions under a repeated action."""
    robot.world.restore_state(start)  # type: ignore[arg-type]
    robot.loop.invalidate()
    steps = round(SECONDS * robot.control_freq)
    out = np.zeros((steps, robot.n_dof))
    for k in range(steps):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
        out[k] = robot.joint_arrays.q
    return out


def _nudged(robot: Robot, group: str, idle: float, sign: float) -> float:
    """The command's number, moved; binary grippers are told the other way round."""
    settings = robot.controllers[group].settings
    if getattr(settings, "mode", "") == "binary":
        return sign
    return idle + sign * NUDGE


def _own(robot: Robot, group: str) -> Indices:
    return robot.groups[group].indices


def _related(robot: Robot, group: str) -> Indices:
    """Joints that may move with a group: its own, a base's virtual or free ones, and followers by mimic."""
    own = {robot.joint_names[i] for i in robot.groups[group].indices}
    related = set(own)
    for name in robot.joint_names:
        joint = robot.description.joint_by_name[name]
        if joint.mimic is not None and joint.mimic.joint in own:
            related.add(name)
        if name.startswith("base_footprint_") or joint.position_limits() is None:
            related.add(name)
    if not robot.body.is_fixed and robot.groups[group].kind == "base":
        related |= set(robot.joint_names)
    return robot.joint_arrays.indices_of(sorted(related))
