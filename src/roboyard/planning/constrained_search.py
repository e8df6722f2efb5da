"""Paths on which a link stays inside a region: RRT-Connect whose steps are projected into it.

Source: constrained bidirectional RRT, Berenson et al., Manipulation planning on constraint manifolds, 2009.
"""

from __future__ import annotations

import time

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.planning.constraints import BoundConstraint
from roboyard.planning.path_search import SearchSpace
from roboyard.planning.trajectory import path_length
from roboyard.transforms import Array

_checker = lazy_module("roboyard.planning.kernels.checker")
_motion = lazy_module("roboyard.planning.kernels.motion")

STEP = 0.15
"""Motion between projections (rad)."""
ROUNDS = 80
"""Attempts to shorten a path."""


class ConstrainedSearch:
    """Searches a path of one robot among obstacles inside a region."""

    def __init__(self, space: SearchSpace, region: BoundConstraint, seed: int) -> None:
        """Create a search; `seed` is that of the samples."""
        self.space, self.region = space, region
        self.random = np.random.default_rng(seed)

    def is_free(self, q: Array) -> bool:
        """Return whether a configuration (n,) touches nothing."""
        space = self.space
        return bool(_checker().is_free(space.robot, space.world, q, 0.0, space.work))

    def is_straight(self, a: Array, b: Array) -> bool:
        """Return whether the straight motion between configurations (n,) is free and inside the region."""
        count = max(2, int(np.ceil(np.linalg.norm(b - a) / 0.03)) + 1)
        if not self.region.inside(a + np.linspace(0, 1, count)[:, None] * (b - a), 0.95).all():
            return False
        space = self.space
        return bool(_motion().motion_free(space.robot, space.world, a, b, 0.0, space.work, space.sweep))

    def walk(self, a: Array, b: Array, most: int = 400) -> list[Array]:
        """Return configurations from a towards b (n,) inside the region, as far as it goes."""
        found = [a]
        while len(found) < most:
            here = found[-1]
            gap = float(np.linalg.norm(b - here))
            if gap < 1e-9:
                break
            if gap <= STEP and self.is_straight(here, b):
                found.append(b)
                break
            share = min(1.0, STEP / gap)
            following = self.region.project(here + share * (b - here))
            if following is None or np.linalg.norm(b - following) > gap - 0.1 * STEP * share:
                break  # projecting led away from b, or back
            if not self.is_free(following) or not self.is_straight(here, following):
                break
            found.append(following)
        return found

    def path(self, start: Array, goals: Array, deadline: float) -> Array | None:
        """Return (w, n) way points from start (n,) to one of goals (g, n); None if the time is over."""
        trees: list[tuple[list[Array], list[int]]] = [([start], [-1]), (list(goals), [-1] * len(goals))]
        lower, upper = self.space.robot.lower, self.space.robot.upper
        side = 0
        target = goals[0]
        while time.perf_counter() < deadline:
            new = self._grow(trees[side], target)
            if new is not None:
                other = trees[1 - side]
                to = trees[side][0][new]
                reached = self._grow(other, to)
                if reached is not None and np.abs(other[0][reached] - to).max() < 1e-9:
                    ends = (new, reached) if side == 0 else (reached, new)
                    first, second = _branch(trees[0], ends[0]), _branch(trees[1], ends[1])
                    return np.array([*reversed(first), *second[1:]])
            target = self.random.uniform(lower, upper)
            side = 1 - side
        return None

    def _grow(self, tree: tuple[list[Array], list[int]], target: Array) -> int | None:
        nodes, parents = tree
        near = int(np.argmin(((np.array(nodes) - target) ** 2).sum(axis=1)))
        if np.abs(nodes[near] - target).max() < 1e-9:
            return near
        walked = self.walk(nodes[near], target)
        if len(walked) < 2:
            return None
        for q in walked[1:]:
            nodes.append(q)
            parents.append(near)
            near = len(nodes) - 1
        return near

    def shorten(self, path: Array, deadline: float) -> Array:
        """Return a path (m, n) shorter than `path` (k, n) inside the region (rad or m), by shortcuts."""
        for _ in range(ROUNDS):
            if len(path) < 3 or time.perf_counter() > deadline:
                break
            i, k = sorted(self.random.choice(len(path), size=2, replace=False))
            if k - i < 2:
                continue
            walked = self.walk(path[i], path[k])
            if walked[-1] is path[k] and path_length(np.array(walked)) < 0.99 * path_length(path[i : k + 1]):
                path = np.concatenate([path[:i], np.array(walked), path[k + 1 :]])
        return self.thinned(path)

    def thinned(self, path: Array) -> Array:
        """Return the path (k, n) without the way points that straight motions can do without (rad or m)."""
        kept, i = [0], 0
        while i < len(path) - 1:
            k = i + 1
            while k + 1 < len(path) and self.is_straight(path[i], path[k + 1]):
                k += 1
            kept.append(k)
            i = k
        return path[kept]


def _branch(tree: tuple[list[Array], list[int]], node: int) -> list[Array]:
    found = []
    while node >= 0:
        found.append(tree[0][node])
        node = tree[1][node]
    return found
