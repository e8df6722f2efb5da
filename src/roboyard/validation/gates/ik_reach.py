"""Test that arms with inverse kinematics reach poses that are reachable.

Poses come from random postures of the arm, up to 1.5 rad from the reset posture. The straight joint-space
path from there is free of contacts, and gravity takes no more than 80 % of any joint's effort limit on it.
The arm's controller follows absolute poses along that path (controllers do not plan), and must come to rest
at the last. No further poses are tried once so many are missed that the gate cannot pass.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roboyard.robots import Robot
from roboyard.robots.control.rotations import vector_of_matrix
from roboyard.robots.control.task import TaskController
from roboyard.robots.joint_arrays import Indices
from roboyard.transforms import Array, matrix_from_quaternion
from roboyard.validation.gates.weak_joints import weakness
from roboyard.validation.report import Curve, Gate
from roboyard.validation.test_world import TestWorld, all_contacts

POSES = 20
"""Number of poses for each arm."""
SECONDS = 6.0
"""Time to reach the last pose of a path (s)."""
SECONDS_PER_POSE = 1.5
"""Time to reach each pose on the path (s)."""
NEAR = (0.02, 0.1)
"""Tolerances of a pose on the path (m, rad)."""
POSITION, ROTATION = 5e-3, 0.05
"""Tolerances of the last pose (m, rad)."""
MIN_REACHED = 0.9
"""Fraction of poses to reach: an arm that follows poses, not joints, may take another posture on the path and
collide."""
AT_REST = (5e-5, 5e-4)
"""Change of the errors within `REST_TIME` below which an arm is at rest (m, rad)."""
REST_TIME = 1.0
"""Time after which an arm at rest is left there (s)."""
INTERVAL = 0.05
"""Time between measurements of the errors (s)."""
WINDOW = 1.5
"""Largest joint distance from the reset posture (rad or m)."""
MAX_GRAVITY_EFFORT = 0.8
"""Largest effort against gravity, as a fraction of the effort limits."""
MOST_CAUSES = 3
"""Number of causes named where no path is free."""
AT_STOP = 0.01
"""Distance to a limit at which a joint is at its stop (rad or m)."""
STEP = 0.25
"""Joint distance between the checked postures of a path (rad or m)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Reached:
    """Errors, findings and hindrances of one arm."""

    errors: list[tuple[float, float]]
    """Of each pose (m, rad)."""
    findings: list[str]
    causes: Counter[str]
    """Why paths were not free, each with their number."""


def ik_reach_gates(test_world: TestWorld, poses: int = POSES) -> tuple[Gate, ...]:
    """Measure the fraction of poses reached, and the errors."""
    return summarize([reach_poses(test_world, arm, poses) for arm in task_arms(test_world)])


def task_arms(test_world: TestWorld) -> list[str]:
    """Return the groups that take poses."""
    return [
        group
        for group, name in test_world.definition.controller_names().items()
        if name in ("InverseKinematicsController", "OperationalSpaceController")
    ]


def reach_poses(test_world: TestWorld, arm: str, poses: int = POSES) -> Reached:
    """Lead one arm to poses, in a world of its own.

    Args:
        test_world: makes the world.
        arm: group that takes poses.
        poses: most poses.
    """
    absolute = {"mode": "absolute_pose", "command_output_limits": None, "command_input_limits": None}
    arms = task_arms(test_world)
    controllers = dict.fromkeys(arms, absolute)
    in_all = poses * len(arms)
    robot = test_world.robot(action_normalize=False, controllers=controllers)
    reached = Reached(errors=[], findings=[], causes=Counter())
    robot.world.step(1)
    usual = all_contacts(robot)
    for k, path in enumerate(sample_paths(robot, arm, poses, test_world.seed, reached.causes)):
        robot.reset()
        for pose in path[:-1]:
            reach(robot, arm, pose, SECONDS_PER_POSE, near=NEAR)
        error = reach(robot, arm, path[-1], SECONDS)
        reached.errors.append(error)
        if error[0] > POSITION or error[1] > ROTATION:
            reached.findings.append(
                f"{arm}, pose {k}: {error[0] * 1e3:.1f} mm and {error[1]:.3f} rad from the pose"
                + hindrance(robot, arm, usual)
            )
        if (in_all - len(reached.findings)) / in_all < MIN_REACHED:
            break
    return reached


def summarize(arms: Sequence[Reached]) -> tuple[Gate, ...]:
    """Return the gate of what all arms reached."""
    if not arms:
        return (
            Gate(
                name="ik_reach",
                title="Arms reach poses",
                figure=0.0,
                threshold=MIN_REACHED,
                unit="of the poses",
                skipped="no group has inverse kinematics",
            ),
        )
    findings = [finding for arm in arms for finding in arm.findings]
    found = np.array([error for arm in arms for error in arm.errors]).reshape(-1, 2)
    if len(found) == 0:
        causes = sum((arm.causes for arm in arms), Counter())
        return (
            Gate(
                name="ik_reach",
                title="Arms reach poses",
                figure=0.0,
                threshold=MIN_REACHED,
                unit="of the poses",
                sense="at least",
                detail="no path to a posture is free of contacts and within the effort limits",
                findings=[f"{cause}, on {count} paths" for cause, count in causes.most_common(MOST_CAUSES)],
                advice="self-collision: disabled_collision_pairs, self_collisions; effort limits",
            ),
        )
    good = (found[:, 0] <= POSITION) & (found[:, 1] <= ROTATION)
    return (
        Gate(
            name="ik_reach",
            title="Arms reach poses",
            figure=float(good.mean()),
            threshold=MIN_REACHED,
            unit="of the poses",
            sense="at least",
            detail=f"{len(found)} poses, within {POSITION * 1e3:g} mm and {ROTATION:g} rad; median error"
            f" {np.median(found[:, 0]) * 1e3:.2f} mm, {np.median(found[:, 1]):.4f} rad",
            findings=findings,
            advice="arm_joint_names and eef_link_names, effort and joint limits, default_joint_pos, and "
            "contacts of"
            " the arm on its path",
            curve=Curve(
                x=np.arange(len(found), dtype=float),
                lines={"position, cm": found[:, 0] * 100, "orientation, rad": found[:, 1]},
                x_label="pose",
                y_label="error",
            ),
        ),
    )


def sample_paths(
    robot: Robot, group: str, count: int, seed: int, causes: Counter[str] | None = None
) -> list[list[Array]]:
    """Return up to `count` contact-free paths of a group's tip; the robot is reset afterwards.

    Args:
        robot: in the world of the test.
        group: of an arm with a task-space controller.
        count: of paths.
        seed: of the random postures.
        causes: counts why paths were not free.

    Returns:
        Paths of (4, 4) poses in the robot's base frame.
    """
    controller, places = robot.controllers[group], robot.groups[group].indices
    assert isinstance(controller, TaskController)
    chain = controller.chain
    rng = np.random.default_rng(seed)
    robot.reset()
    robot.world.step(1)
    resting = robot.joint_arrays.q
    lower = np.maximum(chain.lower, resting[places] - WINDOW)
    upper = np.minimum(chain.upper, resting[places] + WINDOW)
    usual = all_contacts(robot)
    found: list[list[Array]] = []
    for _ in range(count * 20):
        if len(found) == count:
            break
        path, cause = _free_path(robot, group, resting, places, rng.uniform(lower, upper), usual)
        if path:
            found.append(path)
        elif causes is not None:
            causes[cause] += 1
    robot.reset()
    return found


def _free_path(
    robot: Robot, group: str, resting: Array, places: Indices, target: Array, usual: set[tuple[str, str]]
) -> tuple[list[Array], str]:
    """Return the poses of the tip on the straight joint path to a posture; none, and why, where it is not
    free.
    """
    controller = robot.controllers[group]
    assert isinstance(controller, TaskController)
    poses = []
    count = max(1, int(np.ceil(np.abs(target - resting[places]).max() / STEP)))
    for fraction in np.linspace(1.0 / count, 1.0, count):
        q = resting.copy()
        q[places] += fraction * (target - resting[places])
        robot.joint_arrays.q = q
        if new := all_contacts(robot) - usual:
            return [], "{} and {} touch".format(*min(new))
        robot.joint_arrays.refresh()
        loads = np.abs(robot.joint_arrays.bias[places]) / robot.limits.effort[places]
        if loads.max() > MAX_GRAVITY_EFFORT:
            worst = places[int(loads.argmax())]
            limit = robot.limits.effort[worst]
            return [], (
                f"gravity needs more than {MAX_GRAVITY_EFFORT:.0%} of the effort limit {limit:.3g} of joint "
                f"{robot.joint_names[worst]!r}"
            )
        poses.append(controller.tip(robot.loop.state_of(robot.groups[group])))
    return poses, ""


def hindrance(robot: Robot, group: str, usual: set[tuple[str, str]]) -> str:
    """Return what holds an arm where it is, as the end of a finding: weak joints, new contacts, stops.

    Args:
        robot: in the posture in which its arm stopped.
        group: of the arm.
        usual: contacts at rest.
    """
    found = [f"{name}: {text}" for name in robot.joint_names if (text := weakness(robot, name))][:MOST_CAUSES]
    found += [_touching(robot, *pair) for pair in sorted(all_contacts(robot) - usual)[:MOST_CAUSES]]
    q, limits = robot.joint_positions, robot.limits
    for place in robot.groups[group].indices:
        for stop in (limits.lower[place], limits.upper[place]):
            if abs(q[place] - stop) < AT_STOP:
                found.append(f"joint {robot.joint_names[place]!r} is at its limit of {stop:.3g}")
    return "; " + "; ".join(found) if found else ""


def _touching(robot: Robot, a: str, b: str) -> str:
    """Return that two links touch, with the kinds of their collision shapes in the file."""
    links = robot.description.link_by_name
    kinds = [
        "/".join(sorted({type(shape.geometry).__name__.lower() for shape in links[name].collisions}))
        for name in (a, b)
        if name in links
    ]
    shapes = " and ".join(kind for kind in kinds if kind)
    return f"{a} and {b} touch" + (f" (collision shapes: {shapes})" if shapes else "")


def command(robot: Robot, group: str, pose: Array) -> None:
    """Set a group's goal to a (4, 4) pose in the base frame."""
    robot.apply_action({group: np.concatenate([pose[:3, 3], vector_of_matrix(pose[:3, :3])])})


def reach(
    robot: Robot,
    group: str,
    pose: Array,
    seconds: float,
    *,
    near: tuple[float, float] = (POSITION / 5, ROTATION / 5),
) -> tuple[float, float]:
    """Command an arm to a (4, 4) pose in the base frame, until it is near, at rest or the time is up.

    Args:
        robot: in the world of the test.
        group: of the arm.
        pose: (4, 4) in the base frame.
        seconds: at most (s).
        near: tolerances (m, rad).

    Returns:
        Remaining errors of position (m) and rotation (rad).
    """
    command(robot, group, pose)
    link = robot.body.link(_tip_link(robot, group))
    error = (np.inf, np.inf)
    lately: deque[tuple[float, float]] = deque(maxlen=1 + round(REST_TIME / INTERVAL))
    for _ in range(round(seconds / INTERVAL)):
        robot.world.step(round(INTERVAL / robot.world.timestep))
        error = _error(robot, link.pose, pose)
        if error[0] < near[0] and error[1] < near[1]:
            break
        lately.append(error)
        if len(lately) == lately.maxlen and (np.ptp(lately, axis=0) < AT_REST).all():
            break
    return error


def _tip_link(robot: Robot, group: str) -> str:
    controller = robot.controllers[group]
    assert isinstance(controller, TaskController)
    return controller.chain.tip_names[0]


def _error(robot: Robot, tip: tuple[Array, Array], pose: Array) -> tuple[float, float]:
    position, quaternion = robot.base_link.pose
    turn = matrix_from_quaternion(quaternion)
    here = turn.T @ (tip[0] - position)
    rotation = turn.T @ matrix_from_quaternion(tip[1])
    return (
        float(np.linalg.norm(here - pose[:3, 3])),
        float(np.linalg.norm(vector_of_matrix(pose[:3, :3] @ rotation.T))),
    )
