"""Test that every controller moves its own joints, and no others.

Each number of each command is changed alone, up and then down, for half a second, and compared with the same
robot under the no-op action. A joint's response is the largest difference between the two. Other joints are
compared until links touch that did not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from roboyard.kinematics import jacobian
from roboyard.robots import Robot
from roboyard.robots.control.inverse_kinematics import DAMPING
from roboyard.robots.control.task import TaskController
from roboyard.robots.joint_arrays import Indices
from roboyard.transforms import Array
from roboyard.validation.gates.weak_joints import at_limit, because_full, because_weak
from roboyard.validation.report import Curve, Gate
from roboyard.validation.test_world import TestWorld, all_contacts

SECONDS = 0.5
"""Duration of each change (s)."""
CHANGE = 0.1
"""Change of a command's number, as a fraction of its range."""
MIN_RESPONSE = 2e-3
"""Smallest motion that counts as a response (rad or m)."""
MAX_LEAK = 0.1
"""Largest motion of other joints, as a fraction of the response."""
SPACE = 6
"""Number of coordinates of a pose, and so of joints that can move a tip every way."""
MAX_LED = 0.02
"""Largest part of a step of the tip that an arm takes in a direction which it cannot follow."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Response:
    """The effect of one number of an action."""

    label: str
    """Group and index of the number in its command."""
    moved: float
    """Largest motion of the group's own joints (rad or m)."""
    leak: float
    """Largest motion of other joints, as a fraction of `moved`."""
    other: str
    """The other joint that moved most."""
    cannot: str = ""
    """Why the joints of the group cannot follow the number in this posture; empty where they can."""
    weak: str = ""
    """Loads of the group's joints above their effort limits, as the end of a finding."""
    full: str = ""
    """Why the drive of the other joint gives way, as the end of a finding."""


def response_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Measure the smallest response of any command, and the largest motion of other joints."""
    robot = test_world.robot()
    if robot.action_dim == 0:
        return (
            Gate(
                name="response",
                title="Every command moves its joints",
                figure=0.0,
                threshold=MIN_RESPONSE,
                unit="rad or m",
                skipped="no controller takes commands",
            ),
        )
    responses = _measure_responses(robot)
    able = [response for response in responses if not response.cannot]
    moved = np.array([response.moved for response in responses])
    leaks = np.array([response.leak for response in responses])
    weakest = min(able, key=lambda response: response.moved, default=None)
    return (
        Gate(
            name="response",
            title="Every command moves its joints",
            figure=MIN_RESPONSE if weakest is None else weakest.moved,
            threshold=MIN_RESPONSE,
            unit="rad or m",
            sense="at least",
            detail=f"{len(moved)} numbers changed by {CHANGE:g} for {SECONDS:g} s; smallest response: "
            f"{'none' if weakest is None else weakest.label}",
            findings=[
                f"{response.label} moves its joints by only {response.moved:.2g}{response.weak}"
                for response in able
                if response.moved < MIN_RESPONSE
            ],
            warnings=[
                f"{response.label} moves its joints by only {response.moved:.2g}: {response.cannot}"
                for response in responses
                if response.cannot and response.moved < MIN_RESPONSE
            ],
            advice="the joint names of the group, effort and velocity limits, mimic joints, and"
            " command_output_limits",
            curve=Curve(
                x=np.arange(len(moved), dtype=float),
                lines={"own joints": moved, "others": moved * leaks},
                x_label="index in the action",
                y_label="rad or m",
            ),
        ),
        Gate(
            name="isolation",
            title="No command moves other joints",
            figure=float(leaks.max()),
            threshold=MAX_LEAK,
            unit="of its own motion",
            detail="largest motion of a joint outside the group",
            findings=[
                f"{response.label} also moves {response.other}, by {response.leak:.0%} of its own motion"
                + response.full
                for response in responses
                if response.leak > MAX_LEAK
            ],
            advice="collision shapes in contact, the stiffness of the other joints, and the joint names of "
            "both groups",
        ),
    )


def _measure_responses(robot: Robot) -> list[Response]:
    """Return the response to each number of an action; the robot rests for a second first."""
    idle = robot.no_op_action()
    robot.world.step(1)
    for _ in range(round(robot.control_freq)):
        robot.apply_action(idle)
        robot.world.step(robot.steps_per_control)
    start = robot.world.save_state()
    reference = _run(robot, start, idle)
    found = []
    for group, numbers in robot.controller_action_idx.items():
        own = robot.groups[group].indices
        others = np.setdiff1d(np.arange(robot.n_dof), _related(robot, group))
        for k in range(numbers.stop - numbers.start):
            best, action_of = Response(label=f"{group}[{k}]", moved=0.0, leak=0.0, other=""), idle
            for sign in (1.0, -1.0):
                action = idle.copy()
                number = numbers.start + k
                action[number] = _changed(robot, group, float(idle[number]), sign)
                difference = np.abs(_run(robot, start, action) - reference)
                moved = float(difference[:, own].max())
                if moved > best.moved:
                    worst = difference[:, others].max(axis=0, initial=0.0) if len(others) else np.zeros(1)
                    if worst.max() > MAX_LEAK * moved > MAX_LEAK * MIN_RESPONSE:
                        free = difference[: _free_steps(robot, start, action)]
                        worst = free[:, others].max(axis=0, initial=0.0)
                    action_of = action
                    best = Response(
                        label=best.label,
                        moved=moved,
                        leak=float(worst.max()) / moved if moved > MIN_RESPONSE else 0.0,
                        other=robot.joint_names[others[int(worst.argmax())]] if len(others) else "",
                    )
            if best.moved < MIN_RESPONSE:
                robot.world.restore_state(start)
                robot.loop.invalidate()
                weak = next(
                    (t for name in robot.groups[group].joints if (t := because_weak(robot, name))), ""
                )
                best = replace(best, cannot=_cannot(robot, group, k), weak=weak)
            if best.leak > MAX_LEAK:
                best = replace(best, full=_gives_way(robot, start, action_of, best.other))
            found.append(best)
    return found


def _gives_way(robot: Robot, start: object, action: Array, joint: str) -> str:
    """Return why a joint's drive cannot hold it under an action: its load at rest, or its effort limit."""
    robot.world.restore_state(start)  # type: ignore[arg-type]
    robot.loop.invalidate()
    if weak := because_weak(robot, joint):
        return weak
    place = robot.joint_arrays.index[joint]
    robot.apply_action(action)
    for _ in range(round(SECONDS * robot.control_freq) * robot.steps_per_control):
        robot.world.step(1)
        if at_limit(robot)[place]:
            return because_full(robot, joint)
    return ""


def _cannot(robot: Robot, group: str, number: int) -> str:
    """Return why an arm with fewer than six joints cannot follow a number; empty where it can.

    Such an arm moves its tip in some directions only by turning it as well. With J the Jacobian of its tip,
    the step J⁺ e that inverse kinematics takes towards the direction e leads the tip by eᵀ J J⁺ e along it.
    """
    controller = robot.controllers[group]
    if not isinstance(controller, TaskController) or controller.chain.size >= SPACE:
        return ""
    state = robot.loop.state_of(robot.groups[group])
    own = jacobian(controller.chain, state.q)[: controller.command_dim]
    direction = np.zeros(len(own))
    first = number // 3 * 3
    direction[first : first + 3] = state.mount[:3, :3].T[:, number % 3]
    square = own.T @ own + DAMPING**2 * np.eye(own.shape[1])
    led = float(direction @ own @ np.linalg.solve(square, own.T @ direction))
    if led > MAX_LED:
        return ""
    return (
        f"its {controller.chain.size} joints cannot move the tip this way alone at rest; use the mode "
        "position_compliant_ori, or another default_joint_pos"
    )


def _run(robot: Robot, start: object, action: Array) -> Array:
    """Return the (steps, n) joint positions (rad or m) under a repeated action from a saved state."""
    robot.world.restore_state(start)  # type: ignore[arg-type]
    robot.loop.invalidate()
    steps = round(SECONDS * robot.control_freq)
    out = np.zeros((steps, robot.n_dof))
    for k in range(steps):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
        out[k] = robot.joint_positions
    return out


def _free_steps(robot: Robot, start: object, action: Array) -> int:
    """Return the control steps under a repeated action until links touch that did not: an arm that a trunk
    leans on the body gives way there.
    """
    robot.world.restore_state(start)  # type: ignore[arg-type]
    robot.loop.invalidate()
    usual = all_contacts(robot)
    steps = round(SECONDS * robot.control_freq)
    for k in range(steps):
        robot.apply_action(action)
        for _ in range(robot.steps_per_control):
            robot.world.step(1)
            if all_contacts(robot) - usual:
                return k
    return steps


def _changed(robot: Robot, group: str, idle: float, sign: float) -> float:
    """Return a changed number of a command; for binary grippers one end of the range."""
    settings = robot.controllers[group].settings
    if getattr(settings, "mode", "") == "binary":
        return sign
    return idle + sign * CHANGE


def _related(robot: Robot, group: str) -> Indices:
    """Return the joints that may move with a group: its own, their mimic joints, and free or base joints."""
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
