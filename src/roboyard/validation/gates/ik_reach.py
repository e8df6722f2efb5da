"""Do arms under inverse kinematics reach poses that they can reach?

Poses come from random postures of the arm, up to 1.5 rad from the reset posture, whose straight way from
there, joint by joint, touches nothing and asks no drive for more than 80 % of its effort against gravity.
The arm's own controller is led along that way by absolute poses (controllers do not plan), and then has to
come to rest at the last.
"""

from __future__ import annotations

import numpy as np

from roboyard.robots import Robot
from roboyard.robots.control.rotations import vector_of_matrix
from roboyard.robots.control.task import TaskController
from roboyard.robots.joint_arrays import Indices
from roboyard.transforms import Array, matrix_from_quaternion
from roboyard.validation.report import Curve, Gate
from roboyard.validation.test_world import TestWorld, all_contacts

POSES = 20
"""For each arm."""
SECONDS = 6.0
SECONDS_A_LEG = 1.5
NEAR = (0.02, 0.1)
"""m and rad: near enough to a pose on the way"""
POSITION, ROTATION = 5e-3, 0.05
"""m and rad"""
SHARE = 0.9
"""Of the poses: an arm that follows poses, not joints, may fold the other way on the way and touch "
"something."""
WINDOW = 1.5
"""rad or m from the reset posture"""
HOLDABLE = 0.8
"""Of the effort limits"""
STEP = 0.25
"""rad or m between the postures looked at between reset and pose."""


def ik_reach(bench: TestWorld, poses: int = POSES) -> tuple[Gate, ...]:
    """Share of poses reached, and the errors."""
    arms = [
        group
        for group, name in bench.definition.controller_names().items()
        if name in ("InverseKinematicsController", "OperationalSpaceController")
    ]
    if not arms:
        return (
            Gate(
                name="ik_reach",
                title="Arms reach poses",
                figure=0.0,
                threshold=SHARE,
                unit="of the poses",
                skipped="no group has inverse kinematics",
            ),
        )
    absolute = {"mode": "absolute_pose", "command_output_limits": None, "command_input_limits": None}
    robot = bench.robot(action_normalize=False, controllers=dict.fromkeys(arms, absolute))
    errors, labels, findings = [], [], []
    for arm in arms:
        for k, way in enumerate(sample_ways(robot, arm, poses, bench.seed)):
            robot.reset()
            for pose in way[:-1]:
                reach(robot, arm, pose, SECONDS_A_LEG, near=NEAR)
            error = reach(robot, arm, way[-1], SECONDS)
            errors.append(error)
            labels.append(f"{arm} {k}")
            if error[0] > POSITION or error[1] > ROTATION:
                findings.append(f"{arm}, pose {k}: {error[0] * 1e3:.1f} mm and {error[1]:.3f} rad short")
    found = np.array(errors).reshape(-1, 2)
    if len(found) == 0:
        return (
            Gate(
                name="ik_reach",
                title="Arms reach poses",
                figure=0.0,
                threshold=SHARE,
                unit="of the poses",
                sense="at least",
                detail="no posture free of self-collision was found",
                advice="look at self-collision: disabled_collision_pairs, self_collisions",
            ),
        )
    good = (found[:, 0] <= POSITION) & (found[:, 1] <= ROTATION)
    return (
        Gate(
            name="ik_reach",
            title="Arms reach poses",
            figure=float(good.mean()),
            threshold=SHARE,
            unit="of the poses",
            sense="at least",
            detail=f"{len(found)} poses, within {POSITION * 1e3:g} mm and {ROTATION:g} rad; median error"
            f" {np.median(found[:, 0]) * 1e3:.2f} mm, {np.median(found[:, 1]):.4f} rad",
            findings=findings,
            advice="look at arm_joint_names and eef_link_names, at effort and joint limits, at "
            "default_joint_pos, and"
            " at what the arm touches on its way",
            curve=Curve(
                x=np.arange(len(found), dtype=float),
                lines={"position, cm": found[:, 0] * 100, "orientation, rad": found[:, 1]},
                x_label="pose",
                y_label="error",
            ),
        ),
    )


def sample_ways(robot: Robot, group: str, count: int, seed: int) -> list[list[Array]]:
    """Up to `count` ways, each of (4, 4) poses of a group's tip in the robot's base frame; leaves "
    "the robot reset.
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
        way = _free_way(robot, group, resting, places, rng.uniform(lower, upper), usual)
        if way:
            found.append(way)
    robot.reset()
    return found


def _free_way(
    robot: Robot, group: str, resting: Array, places: Indices, wanted: Array, usual: set[tuple[str, str]]
) -> list[Array]:
    """Poses of the tip on the straight way to a posture; empty where something touches on it."""
    controller = robot.controllers[group]
    assert isinstance(controller, TaskController)
    poses = []
    count = max(1, int(np.ceil(np.abs(wanted - resting[places]).max() / STEP)))
    for share in np.linspace(1.0 / count, 1.0, count):
        q = resting.copy()
        q[places] += share * (wanted - resting[places])
        robot.joint_arrays.q = q
        if all_contacts(robot) - usual:
            return []
        robot.joint_arrays.refresh()
        if (np.abs(robot.joint_arrays.bias[places]) > HOLDABLE * robot.limits.effort[places]).any():
            return []
        poses.append(controller.tip(robot.loop.state_of(robot.groups[group])))
    return poses


def command(robot: Robot, group: str, pose: Array) -> None:
    """Give a group a (4, 4) pose in the base frame."""
    robot.apply_action({group: np.concatenate([pose[:3, 3], vector_of_matrix(pose[:3, :3])])})


def reach(
    robot: Robot,
    group: str,
    pose: Array,
    seconds: float,
    *,
    near: tuple[float, float] = (POSITION / 5, ROTATION / 5),
) -> tuple[float, float]:
    """Send an arm to a (4, 4) pose in the base frame; distance left in m and rad when it is near, "
    "or time is up.
    """
    command(robot, group, pose)
    link = robot.body.link(_tip_link(robot, group))
    error = (np.inf, np.inf)
    for _ in range(round(seconds * 20)):
        robot.world.step(round(0.05 / robot.world.timestep))
        error = _error(robot, link.pose, pose)
        if error[0] < near[0] and error[1] < near[1]:
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
