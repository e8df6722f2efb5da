"""Calls of the kernels that find a path, shorten it and time it."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.planning.kernels.arrays import Array, RobotArrays, Work, WorldArrays, work_for
from roboyard.planning.trajectory import Trajectory

_checker = lazy_module("roboyard.planning.kernels.checker")
_sampling = lazy_module("roboyard.planning.kernels.sampling")
_shortcuts = lazy_module("roboyard.planning.kernels.shortcuts")
_motion = lazy_module("roboyard.planning.kernels.motion")
_timing = lazy_module("roboyard.planning.kernels.timing")

NODES = 800
"""Nodes of a tree for which there is room at first; small enough that the allocator reuses the memory."""
CHUNK = 50
"""Samples between looks at the clock."""
MOST_SAMPLES = 1 << 62
"""No bound on samples but the time."""
STEP = 1.0
"""Longest motion of one extension (rad)."""
WAY_POINTS = 400
INSTANT = 1e-12
"""Time between two knots that count as one (s)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SearchSpace:
    """Arrays and work space of one search."""

    robot: RobotArrays
    world: WorldArrays
    work: Work
    sweep: object

    @staticmethod
    def of(robot: RobotArrays, world: WorldArrays) -> SearchSpace:
        """Return a search space with new work space."""
        return SearchSpace(
            robot=robot, world=world, work=work_for(robot, world), sweep=_motion().sweep_for(robot)
        )

    def within(self, lower: Array, upper: Array) -> SearchSpace:
        """Return the space with samples drawn between (n,) limits only (rad or m)."""
        low, high = np.maximum(self.robot.lower, lower), np.minimum(self.robot.upper, upper)
        return replace(self, robot=self.robot._replace(lower=low, upper=np.maximum(low, high)))


def shorter_box(start: Array, goals: Array, length: float) -> tuple[Array, Array]:
    """Return (n,) lower and upper ends of a box that contains every path from start (n,) to one of goals
    (g, n) that is shorter than `length` (rad or m).
    """
    lower = ((start + goals - length) / 2).min(axis=0)
    return lower, ((start + goals + length) / 2).max(axis=0)


def find_path(
    space: SearchSpace,
    start: Array,
    goals: Array,
    *,
    deadline: float,
    seed: int,
    margin: float = 0.0,
    most: int = MOST_SAMPLES,
) -> tuple[Array | None, int]:
    """Return (w, n) way points from start (n,) to one of goals (g, n), pruned, and how many samples it took,
    rounded up to `CHUNK`; no way points if the time is over or more samples than `most` would be needed.

    `deadline` is a time of `time.perf_counter` (s), `margin` an additional padding (m).
    """
    n = len(start)
    sampling = _sampling()
    robot, world, work, sweep = space.robot, space.world, space.work, space.sweep
    trees = sampling.trees_for(n, max(NODES, 2 * len(goals)), seed)
    path, ends = np.empty((WAY_POINTS, n)), np.empty(2, dtype=np.int64)
    roots = np.array([1, len(goals)], dtype=np.int64)
    trees.q[0, 0], trees.q[1, : len(goals)] = start, goals
    trees.parent[:, : len(goals)] = -1
    trees.counts[:] = roots
    spent = 0
    while spent < most:
        count = sampling.search(robot, world, trees, roots, ends, CHUNK, STEP, margin, work, sweep, path)
        spent += CHUNK
        if count:
            count = _shortcuts().prune(robot, world, path, count, margin, work, sweep)
            return path[:count].copy(), spent
        if time.perf_counter() > deadline:
            break
        if trees.counts.max() > trees.q.shape[1] // 2:
            trees = _larger(trees)
    return None, spent


def _larger(trees):
    q = np.concatenate([trees.q, np.zeros_like(trees.q)], axis=1)
    parent = np.concatenate([trees.parent, np.zeros_like(trees.parent)], axis=1)
    return trees._replace(q=q, parent=parent)


def shorten(space: SearchSpace, path: Array, *, rounds: int, seed: int, margin: float = 0.0) -> Array:
    """Return (w, n) way points of a shorter path by `rounds` shortcuts, then by pulling corners."""
    count, n = path.shape
    rows = np.zeros((max(WAY_POINTS, 2 * count + 8), n))
    rows[:count] = path
    points, random = np.zeros((2, n)), _sampling().trees_for(n, 1, seed).random
    robot, world, work, sweep = space.robot, space.world, space.work, space.sweep
    count = _shortcuts().cut(robot, world, rows, count, rounds, margin, random, points, work, sweep)
    count = _shortcuts().pull(robot, world, rows, count, 30, margin, points, work, sweep)
    return rows[:count].copy()


def is_free_path(space: SearchSpace, path: Array) -> bool:
    """Whether the straight motions between (w, n) way points, and those themselves, are free."""
    checker, motion = _checker(), _motion()
    robot, world, work = space.robot, space.world, space.work
    return all(checker.is_free(robot, world, q, 0.0, work) for q in path) and all(
        motion.motion_free(robot, world, a, b, 0.0, work, space.sweep) for a, b in pairwise(path)
    )


def time_path(
    space: SearchSpace, path: Array, limits: Array, names: tuple[str, ...], *, corners: float = 1.0
) -> Trajectory:
    """Return the trajectory along (w, n) way points within (3, n) limits of velocity, acceleration and jerk.

    Args:
        space: robot and obstacles; the path must be free in it.
        path: way points (rad or m).
        limits: rad/s, rad/s² and rad/s³, or m.
        names: joints in the order of the path.
        corners: how much of a corner may be cut, 0 (the motion stops at each way point) to 1.
    """
    keep = np.concatenate([[True], np.abs(np.diff(path, axis=0)).max(axis=1) > 1e-9])
    path = np.ascontiguousarray(path[keep])
    count, n = path.shape
    if count < 2:
        zero = np.zeros((1, n))
        return Trajectory(joint_names=names, t=np.zeros(1), q=path[:1].copy(), v=zero, a=zero, jerk=zero)
    timing = _timing()
    segments = timing.segments_for(count, limits, np.full(count, float(corners)))
    done = timing.time_path(space.robot, space.world, path, segments, 0.0, space.work, space.sweep)
    out = np.zeros((4, 8 * count + 2, n))
    number = timing.integrate(path, segments, done, out)
    t = segments.knots[:number]
    kept = np.append(np.diff(t) > INSTANT, True)  # two changes at once may be an instant apart
    q, v, a, jerk = (out[k, :number][kept] for k in range(4))
    return Trajectory(joint_names=names, t=t[kept], q=q, v=v, a=a, jerk=jerk)
