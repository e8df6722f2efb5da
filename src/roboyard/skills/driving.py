"""Driving to places, and moving arms into postures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard.planning.body_points import body_points
from roboyard.planning.checking import CollisionChecker
from roboyard.sim.body import Body
from roboyard.skills.motion import go
from roboyard.skills.outcome import SkillError
from roboyard.skills.tracks import CLEAR, stage_robot
from roboyard.skills.worker import Worker
from roboyard.transforms import Array

STAND_OFF = (0.5, 1.1)
"""Distances from a body at which the robot stands before it (m)."""
ARRIVED = 0.05
"""Distance from its goal at which the base has arrived (m)."""


def drive(worker: Worker, goals: Sequence[Array]) -> None:
    """Drive to one of several bases (3,), in base joints (m, m, rad).

    Raises:
        SkillError: the robot has no base, or no way was found, or it was blocked.
    """
    if not worker.base_joints:
        raise SkillError("the robot has no holonomic base; place it within reach")
    now = worker.base
    if min(float(np.abs(goal - now).max()) for goal in goals) < 0.01:
        return
    go(worker, [np.asarray(goal) for goal in goals], None, base=True, time_limit=4.0)
    gap = min(float(np.linalg.norm((goal - worker.base)[:2])) for goal in goals)
    if gap > ARRIVED:
        raise SkillError(f"the base stopped {100 * gap:.0f} cm before its goal; clear the way")


def spots_before(worker: Worker, body: Body, random: np.random.Generator, count: int = 200) -> list[Array]:
    """Return bases (3,) in base joints that face a body from near by, nearest first; not checked."""
    points = body_points(body, 500)
    low, high = points.min(axis=0)[:2], points.max(axis=0)[:2]
    found = []
    for _ in range(count):
        on = random.uniform(low, high)
        angle, far = random.uniform(-np.pi, np.pi), random.uniform(*STAND_OFF)
        x, y = on - far * np.array([np.cos(angle), np.sin(angle)])
        found.append(worker.base_at(float(x), float(y), float(angle)))
    now = worker.base
    return sorted(found, key=lambda base: float(np.linalg.norm((base - now)[:2])))


def spots_in(worker: Worker, at: tuple[float, float], random: np.random.Generator) -> list[Array]:
    """Return bases (3,) near a point of the floor (m), in base joints: first at it, with the present turn."""
    x, y, yaw = world_base(worker)
    found = [worker.base_at(*at, yaw), worker.base_at(*at, float(np.arctan2(at[1] - y, at[0] - x)))]
    for _ in range(40):
        dx, dy = random.normal(size=2) * 0.25
        found.append(worker.base_at(at[0] + dx, at[1] + dy, random.uniform(-np.pi, np.pi)))
    return found


def world_base(worker: Worker) -> tuple[float, float, float]:
    """Return the robot's pose in the world frame: x, y (m), yaw (rad)."""
    position, (x, y, z, w) = worker.robot.pose
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return float(position[0]), float(position[1]), float(yaw)


def free_bases(worker: Worker, goals: Sequence[Array], keep: int) -> list[Array]:
    """Return the first free ones of bases (3,) with the arms as they are now.

    Raises:
        SkillError: none is free.
    """
    planner = worker.planner(None, base=True).planner()
    robot = stage_robot(worker, planner, None)
    checker = CollisionChecker(robot, planner.obstacles)
    order = [worker.base_joints.index(name) for name in robot.joint_names]
    free = checker.free(np.array(goals)[:, order], CLEAR)
    if not free.any():
        nearest = checker.nearest(np.asarray(goals[0])[order])
        raise SkillError(f'there is no room: "{nearest.link}" would touch "{nearest.other}"; clear the place')
    return [goal for goal, good in zip(goals, free, strict=True) if good][:keep]


def to_ready(worker: Worker, arms: Sequence[str]) -> None:
    """Move arms to the reset posture, with the trunk as it is.

    Raises:
        SkillError: no motion was found, or it was blocked.
    """
    names = worker.robot.joint_names
    rest = dict(zip(names, worker.robot.reset_joint_pos.tolist(), strict=True))
    for arm in arms:
        go(worker, np.array([rest[name] for name in worker.arm_joints(arm)]), arm)


def withdraw(worker: Worker, random: np.random.Generator) -> None:
    """Bring the arms that hold nothing to the reset posture, further away where there is no room here.

    Where that is not possible they stay.
    """
    arms = [arm for arm in worker.arm_names if arm not in worker.held]
    try:
        to_ready(worker, arms)
        return
    except SkillError:
        if not worker.base_joints:
            return
    x, y, yaw = world_base(worker)
    goals = []
    for far in (0.2, 0.35, 0.5, 0.7):
        for turn in random.normal(size=12) * 0.8:
            angle = yaw + np.pi + turn
            goals.append(worker.base_at(x + far * np.cos(angle), y + far * np.sin(angle), yaw))
    try:
        drive(worker, free_bases(worker, goals, 6))
        to_ready(worker, arms)
    except SkillError:
        return
