"""Following a goal that moves, among obstacles that move: model-predictive control by samples.

At every step some joint velocities are drawn, towards the next way point and around it. Each is rolled out:
it is reached within the acceleration limits, kept for a while, and then the robot brakes to a stop. Rollouts
that touch anything are dropped, so that a robot that moves like this can always stop before what it sees.
Where an obstacle comes too close for any of them, the one that leads away from it farthest is followed.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._lazy import lazy_module
from roboyard.kinematics import solve_ik
from roboyard.planning.goals import Goal, PoseGoal, PosesGoal, pose_task
from roboyard.planning.path_search import SearchSpace
from roboyard.planning.planner import Planner
from roboyard.transforms import Array

_motion = lazy_module("roboyard.planning.kernels.motion")

SAMPLES = 40
"""Velocities drawn at each step."""
KEPT = 0.10
"""Time for which a rollout keeps its velocity (s)."""
SPACING = 0.02
"""Time between the checked configurations of a rollout (s)."""
ROOM = 0.01
"""Distance from obstacles that is preferred (m)."""
CLOSE = 1.1
"""Factor of the cost of rollouts that come closer than that."""
RATE = 6.0
"""Rate at which the distance from a way point decreases (1/s)."""
REACHED = 0.01
"""Distance at which a way point is passed (rad)."""
REPLAN = 0.2
"""Time between searches for a way around (s)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Reaction:
    """The outcome of one step."""

    q: Array
    """(n,) joint positions to be at after the step (rad or m)."""
    v: Array
    """(n,) joint velocities then (rad/s or m/s)."""
    state: str
    """following, going around, waiting (every way is blocked) or escaping (an obstacle came too close)."""
    seconds: float
    """Time that the step took (s)."""


class Follower:
    """Leads a group of joints after goals, one step at a time."""

    def __init__(self, planner: Planner, start: ArrayLike, *, share: float = 0.8, seed: int = 0) -> None:
        """Create a follower.

        Args:
            planner: of the group; `planner.obstacles.move` moves an obstacle between steps.
            start: (n,) present joint positions (rad or m), in the order of `planner.joint_names`.
            share: of the velocity limits that is used.
            seed: seed of the samples.
        """
        self.planner = planner
        self._order = np.array(planner.robot.order)
        self._q = planner.vector(start)
        self._v = np.zeros_like(self._q)
        self._speed, self._rise = share * planner.limits[0], planner.limits[1]
        self._random = np.random.default_rng(seed)
        self._way: list[Array] = []
        self._posture: Array | None = None
        self._searched = -np.inf
        self._time = 0.0

    @property
    def q(self) -> Array:
        """(n,) joint positions now (rad or m)."""
        return self._named(self._q)

    def step(self, goal: Goal, dt: float = 0.02) -> Reaction:
        """Return where to be after `dt` (s) on the way to a goal, which may differ from the last one.

        Raises:
            ConfigError: a vector has the wrong length or is not finite, or the goal's link does not exist.
        """
        begin = time.perf_counter()
        self._time += dt
        target, state = self._target(goal)
        velocities = self._draw(target)
        paths, firsts = self._roll(velocities, dt)
        count, steps, n = paths.shape
        checker = self.planner.checker
        flat = paths.reshape(-1, n)
        free = checker.free(flat).reshape(count, steps).all(axis=1)
        if free.any():
            roomy = checker.free(flat, ROOM).reshape(count, steps).all(axis=1)
            ends = np.linalg.norm(paths[:, -1] - target, axis=1)
            cost = ends * np.where(roomy, 1.0, CLOSE) + 1e3 * ~free
            best = int(np.argmin(cost))
            if best == count - 1 and np.linalg.norm(target - self._q) > 0.02:
                state = "waiting"
        else:  # something moved into the way: away from it
            state = "escaping"
            distance = checker.distance(paths[:, steps // 2])[0]
            best = int(np.argmax(distance))
        self._v = firsts[best]
        lower, upper = self.planner.robot.arrays.lower, self.planner.robot.arrays.upper
        self._q = np.clip(self._q + dt * self._v, lower, upper)
        return Reaction(q=self.q, v=self._named(self._v), state=state, seconds=time.perf_counter() - begin)

    # ----------------------------------------------------------------------------------------- target

    def _target(self, goal: Goal) -> tuple[Array, str]:
        """Return the next configuration (n,) to go for, and the state."""
        posture = self._goal_posture(goal)
        if posture is None:
            return self._q, "waiting"
        space = SearchSpace.of(self.planner.robot.arrays, self.planner.obstacles.arrays)

        def is_straight(to: Array) -> bool:
            return bool(
                _motion().motion_free(space.robot, space.world, self._q, to, 0.0, space.work, space.sweep)
            )

        if is_straight(posture):
            self._way = []
            return posture, "following"
        for k in range(len(self._way) - 1, -1, -1):
            near = np.linalg.norm(self._way[k] - self._q) < REACHED and k + 1 < len(self._way)
            if not near and is_straight(self._way[k]):
                self._way = self._way[k:]
                return self._way[0], "going around"
        if self._time - self._searched >= REPLAN:
            self._searched = self._time
            plan = self.planner.plan(self.q, self._named(posture), time_limit=0.05)
            if plan.solved:
                self._way = [row[self._order] for row in plan.path[1:]]
                return self._way[0], "going around"
        return (self._way[0], "going around") if self._way else (posture, "following")

    def _goal_posture(self, goal: Goal) -> Array | None:
        """Return a posture (n,) of the goal: near the last one where that is free, else the nearest."""
        if not isinstance(goal, PoseGoal | PosesGoal):
            return self.planner.vector(goal)
        chain, target, weights = pose_task(self.planner.robot, goal, self.planner.obstacles.root)
        near = self._q if self._posture is None else self._posture
        found = solve_ik(chain, target, near, restarts=0, iterations=30, orientation_weights=weights)
        if found.converged and self.planner.checker.free(found.q):
            self._posture = found.q
        elif self._time - self._searched >= REPLAN:
            self._searched = self._time
            others = [one for one in self.planner.ik(goal, self.q, seeds=24) if one.is_free]
            self._posture = others[0].q[self._order] if others else None
        return self._posture

    # ---------------------------------------------------------------------------------------- rollouts

    def _draw(self, target: Array) -> Array:
        """Return (s, n) velocities: towards the target, around that, and zero as the last one."""
        way = target - self._q
        towards = np.clip(RATE * way, -self._speed, self._speed)
        scale = np.abs(RATE * way) / self._speed
        if scale.max() > 1.0:  # straight, as fast as the slowest joint allows
            towards = RATE * way / scale.max()
        shares = np.array([1.0, 0.6, 0.3, 0.1])
        spread = self._random.normal(size=(SAMPLES, len(way))) * 0.5 * self._speed
        around = np.clip(towards + spread, -self._speed, self._speed)
        return np.concatenate([shares[:, None] * towards, around, np.zeros((1, len(way)))])

    def _roll(self, velocities: Array, dt: float) -> tuple[Array, Array]:
        """Return (s, k, n) configurations until a stop, and (s, n) velocities after the first `dt` (s)."""
        count, n = velocities.shape
        firsts = self._v + np.clip(velocities - self._v, -self._rise * dt, self._rise * dt)
        stop = float((self._speed / self._rise).max())
        steps = int(np.ceil((dt + KEPT + stop) / SPACING)) + 1
        q, v = self._q + dt * firsts, firsts.copy()
        rows = np.empty((count, steps, n))
        reach = self._rise * SPACING
        for k in range(steps):
            rows[:, k] = q
            wanted = velocities if k * SPACING < KEPT else np.zeros_like(v)
            v = v + np.clip(wanted - v, -reach, reach)
            q = q + SPACING * v
        limits = self.planner.robot.arrays
        return np.clip(rows, limits.lower, limits.upper), firsts

    def _named(self, q: Array) -> Array:
        out = np.empty_like(q)
        out[self._order] = q
        return out
