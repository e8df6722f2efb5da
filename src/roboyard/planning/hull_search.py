"""RRT-Connect with exact shapes as the only check: slow, for what spheres are too coarse for."""

from __future__ import annotations

import time
from itertools import pairwise

import numpy as np

from roboyard.planning.hull_judge import HullJudge
from roboyard.transforms import Array

CHECKED_STEP = 0.01
"""Distance between configurations that are checked (rad)."""
EXTENSION = 0.4
"""Longest motion of one extension (rad)."""
NEAR_ROOTS = 0.25
"""Share of samples near the start and the goals."""


class _Tree:
    def __init__(self, roots: Array) -> None:
        self.q = [np.asarray(root, dtype=float) for root in roots]
        self.parent = [-1] * len(self.q)

    def nearest(self, q: Array) -> int:
        return int(np.argmin(((np.array(self.q) - q) ** 2).sum(axis=1)))

    def add(self, q: Array, parent: int) -> int:
        self.q.append(q)
        self.parent.append(parent)
        return len(self.q) - 1

    def branch(self, i: int) -> list[Array]:
        found = []
        while i >= 0:
            found.append(self.q[i])
            i = self.parent[i]
        return found


def hull_path(
    judge: HullJudge, lower: Array, upper: Array, start: Array, goals: Array, *, deadline: float, seed: int
) -> Array | None:
    """Return (w, n) way points from start (n,) to one of goals (g, n), shortened; None if the time is over.

    Args:
        judge: exact shapes.
        lower: (n,) lower limits (rad or m).
        upper: (n,) upper limits (rad or m).
        start: first configuration.
        goals: last configurations.
        deadline: time of `time.perf_counter` at which the search ends (s).
        seed: seed of the samples.
    """
    random = np.random.default_rng(seed)
    trees = (_Tree(start[None]), _Tree(goals))
    roots = np.concatenate([start[None], goals])
    side = 0
    while time.perf_counter() < deadline:
        sample = random.uniform(lower, upper)
        if random.random() < NEAR_ROOTS:
            root = roots[random.integers(len(roots))]
            sample = np.clip(root + random.normal(size=len(start)) * 0.3 * random.random(), lower, upper)
        new = _extend(judge, trees[side], sample, EXTENSION)
        if new >= 0:
            target = trees[side].q[new]
            reached = _extend(judge, trees[1 - side], target, np.inf)
            if reached >= 0 and np.array_equal(trees[1 - side].q[reached], target):
                ends = (new, reached) if side == 0 else (reached, new)
                path = [*reversed(trees[0].branch(ends[0])), *trees[1].branch(ends[1])[1:]]
                return _shorter(judge, np.array(path), random, deadline)
        side = 1 - side
    return None


def _extend(judge: HullJudge, tree: _Tree, to: Array, longest: float) -> int:
    """Grow a tree from its nearest node towards `to`, as far as that is free; return the last node or -1."""
    i = tree.nearest(to)
    begin = tree.q[i]
    length = float(np.linalg.norm(to - begin))
    if length == 0.0:
        return i
    reach = min(length, longest)
    steps = max(1, int(np.ceil(reach / CHECKED_STEP)))
    good, done = begin, 0
    for k in range(1, steps + 1):
        q = to if k == steps and reach == length else begin + (to - begin) * (reach * k / steps / length)
        if judge.clashes(q):
            break
        good, done = q, k
    if done * CHECKED_STEP < 2 * CHECKED_STEP and done < steps:
        return -1
    return tree.add(good, i)


def is_straight_free(judge: HullJudge, a: Array, b: Array) -> bool:
    """Whether the straight motion between two configurations (n,) is free, every 0.01 rad."""
    steps = max(1, int(np.ceil(np.linalg.norm(b - a) / CHECKED_STEP)))
    return judge.first_clash(a + np.linspace(0, 1, steps + 1)[:, None] * (b - a)) is None


def _shorter(judge: HullJudge, path: Array, random: np.random.Generator, deadline: float) -> Array:
    """Return a path with random shortcuts between way points and points of segments."""
    for _ in range(60):
        if len(path) < 3 or time.perf_counter() > deadline:
            break
        i, k = sorted(random.integers(len(path) - 1, size=2))
        if k == i:
            continue
        a = path[i] + random.random() * (path[i + 1] - path[i])
        b = path[k] + random.random() * (path[k + 1] - path[k])
        piece = np.concatenate([a[None], path[i + 1 : k + 1], b[None]])
        old = sum(float(np.linalg.norm(y - x)) for x, y in pairwise(piece))
        if np.linalg.norm(b - a) < 0.99 * old and is_straight_free(judge, a, b):
            path = np.concatenate([path[: i + 1], [a, b], path[k + 1 :]])
    return path
