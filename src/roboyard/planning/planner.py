"""The planner of one group of joints: from a start to goals, timed and checked."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.errors import ConfigError
from roboyard.planning.checking import CollisionChecker
from roboyard.planning.constrained_search import ConstrainedSearch
from roboyard.planning.constraints import BoundConstraint, PathConstraint, why_outside
from roboyard.planning.exact_checker import JUDGED_STEP, ExactChecker
from roboyard.planning.goals import (
    Goal,
    PoseGoal,
    PosesGoal,
    PostureSolution,
    postures_for,
    why_unreachable,
)
from roboyard.planning.hull_judge import HullJudge
from roboyard.planning.hull_search import hull_path
from roboyard.planning.loops import compile_loops
from roboyard.planning.obstacles import Obstacle, Obstacles
from roboyard.planning.path_search import (
    MOST_SAMPLES,
    SearchSpace,
    find_path,
    is_free_path,
    shorten,
    shorter_box,
    time_path,
)
from roboyard.planning.relaxation import ROOM, raise_padding, relax
from roboyard.planning.spheres.sphere_model import SphereModel, SphereRobot, sphere_robot
from roboyard.planning.trajectory import Outcome, Plan, Trajectory, path_length
from roboyard.transforms import Array

VELOCITY, ACCELERATION, JERK = 2.0, 15.0, 500.0
"""Limits of joints without one (rad/s, rad/s², rad/s³ or m)."""
TRIES, ROUNDS = 4, 120
"""Searches of which the shortest path is kept, and attempts to shorten it."""
LONGER = 2
"""Times the samples of the quickest search after which another one is given up."""
REPAIRS = 6
"""Times that a path refused by the judge is planned again."""
SPHERES_FIRST, EXACT_NEXT = 0.06, 0.5
"""Shares of the time until which paths are sought among spheres, and then among exact shapes."""
HINT_SECONDS = 0.15
"""Time to find out whether moving one obstacle would help (s)."""
MOST_GOALS = 16
"""Postures of a pose that are tried at once."""


class Planner:
    """Plans motions of a group of joints; the other joints stay where they are held."""

    def __init__(
        self,
        model: SphereModel,
        joints: Sequence[str] | None = None,
        obstacles: Iterable[Obstacle] | Obstacles = (),
        *,
        held: Mapping[str, float] | None = None,
        velocity: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        jerk: ArrayLike | None = None,
        root: Array | None = None,
        judge: HullJudge | None = None,
        around: Mapping[str, float] | None = None,
    ) -> None:
        """Create a planner.

        Args:
            model: spheres and pairs of the robot.
            joints: names of the planned joints, in the order of all vectors; by default all that move.
            obstacles: the surroundings; `Obstacles` are shared, in their own root frame.
            held: joint name to position of joints that are not planned (rad or m).
            velocity: (n,) or one limit (rad/s or m/s); the description's by default.
            acceleration: (n,) or one limit (rad/s² or m/s²); the planner file's by default, else 15.
            jerk: (n,) or one limit (rad/s³ or m/s³); the planner file's by default, else 500.
            root: (4, 4) pose of the robot's root link in the world frame (m).
            judge: exact shapes; by default those of the description and the obstacles.
            around: middle of the range of joints without limits (rad or m); zero by default.

        Raises:
            ConfigError: a joint does not exist or cannot be planned, or a limit is not positive.
        """
        names = tuple(model.coordinate_names if joints is None else joints)
        self.joint_names = names
        """(n) planned joints, in the order of all vectors."""
        self.robot: SphereRobot = sphere_robot(model, names, held, around=around)
        """The group's arrays, in depth-first order of joints."""
        self.obstacles = obstacles if isinstance(obstacles, Obstacles) else Obstacles(obstacles, root)
        """The surroundings; `obstacles.move` moves one in place."""
        self.exact = ExactChecker(self.robot, self.obstacles, judge)
        """Decides where spheres leave it open."""
        self._order = np.array(self.robot.order)
        own = np.where(np.isfinite(self.robot.chain.velocity), self.robot.chain.velocity, VELOCITY)
        rows = (
            self._limit("velocity", velocity, own),
            self._limit("acceleration", acceleration, model.acceleration or ACCELERATION),
            self._limit("jerk", jerk, model.jerk or JERK),
        )
        self.limits = np.stack(rows)
        """(3, n) limits of velocity, acceleration and jerk, in depth-first order."""

    def _limit(self, name: str, given: ArrayLike | None, default: ArrayLike) -> Array:
        n = len(self.joint_names)
        if given is None:
            return np.broadcast_to(np.asarray(default, dtype=float), (n,)).copy()
        values = np.asarray(given, dtype=float)
        if values.shape not in ((), (n,)) or not (values > 0).all():
            raise ConfigError(f"limits: {name} is {given}; give one positive number or {n}")
        return np.broadcast_to(values, (n,))[self._order].copy()

    @property
    def bounds(self) -> tuple[Array, Array]:
        """(n,) lower and upper limits of search (rad or m), finite, in the order of `joint_names`."""
        return self._named(self.robot.arrays.lower), self._named(self.robot.arrays.upper)

    @property
    def named_limits(self) -> Array:
        """(3, n) limits of velocity, acceleration and jerk, in the order of `joint_names`."""
        return self._named(self.limits)

    @property
    def judge(self) -> HullJudge:
        """Exact shapes in MuJoCo, made at the first use and again where obstacles were moved."""
        return self.exact.judge

    def use_judge(self, judge: HullJudge) -> None:
        """Judge by other exact shapes than those of the description and the obstacles."""
        self.exact.use_judge(judge)

    @property
    def checker(self) -> CollisionChecker:
        """A collision checker of the group, in depth-first order of joints."""
        return CollisionChecker(self.robot, self.obstacles)

    def warm_up(self) -> None:
        """Load the kernels, or compile them on their first use on this machine, and build the judge."""
        compile_loops()
        q = (self.robot.arrays.lower + self.robot.arrays.upper) / 2
        space = SearchSpace.of(self.robot.arrays, self.obstacles.arrays)
        path = np.stack([q, q + 1e-3, q])
        find_path(space, q, q[None], deadline=time.perf_counter() - 1.0, seed=0)
        time_path(space, shorten(space, path, rounds=1, seed=0), self.limits, self.robot.joint_names)
        relax(self.robot.arrays, self.obstacles.arrays, q[None])
        self.judge.clashes(q)
        self.exact.clash(q)
        moved = next((link for link in self.robot.links if self._moves(link)), None)
        if moved is not None:
            postures_for(self.robot, PoseGoal(link=moved, position=(0.0, 0.0, 0.0)), np.eye(4), q, seeds=4)

    def _moves(self, link: str) -> bool:
        chain = self.robot.chain
        return bool(chain.link_node[chain.link(link)] >= 0)

    # ---------------------------------------------------------------------------------- planning

    def plan(
        self,
        start: ArrayLike,
        goal: Goal | Sequence[Goal],
        *,
        time_limit: float = 5.0,
        improve: float = 0.0,
        seed: int = 0,
        keep: PathConstraint | None = None,
    ) -> Plan:
        """Return a motion from `start` to the goal, or to one of several goals.

        Args:
            start: (n,) joint positions (rad or m).
            goal: (n,) joint positions, a `PoseGoal`, a `PosesGoal` of several links at once, or a sequence of
                these, of which any may be reached.
            time_limit: longest search (s).
            improve: time spent on shorter paths after the first (s); the path gets no longer with it.
            seed: seed of the random samples; the same gives the same path unless time is over.
            keep: poses that a link keeps to on the whole way, such as `keep_upright(link)`.

        Raises:
            ConfigError: a vector has the wrong length or is not finite, or a goal's link does not exist.
        """
        compile_loops()
        begin = time.perf_counter()
        q = self.vector(start, "start")
        failure, q = self._bounded("start", q)
        if failure:
            return self._failed("start outside limits", failure, begin)
        touching = self.exact.clash(q)
        if touching:
            reason = f"{touching}; move the robot or the obstacle apart before planning"
            return self._failed("start in collision", reason, begin)
        outcome, reason, goals, index = self._goal_postures(q, goal, seed)
        if not len(goals):
            return self._failed(outcome, reason, begin)
        deadline = begin + time_limit
        region = None
        if keep is not None:
            region = BoundConstraint(keep, self.robot, self.obstacles.root, q)
            outcome, reason, inside = why_outside(region, q, goals)
            if outcome != "solved":
                return self._failed(outcome, reason, begin)
            goals, index = goals[inside], [one for one, good in zip(index, inside, strict=True) if good]
        return self._planned(q, goals, index, begin, deadline, improve, seed, region)

    def ik(
        self, goal: PoseGoal | PosesGoal, near: ArrayLike, *, seeds: int = 64, seed: int = 0
    ) -> list[PostureSolution]:
        """Return all distinct postures found for a pose, or for poses of several links at once: free ones
        first, then by distance to `near` (n,).

        Each holds joint positions in the order of `joint_names` (rad or m) and its residuals.

        Raises:
            ConfigError: the link does not exist or no joint of the group moves it.
        """
        from_here = self.vector(near, "near")
        found = postures_for(self.robot, goal, self.obstacles.root, from_here, seeds=seeds, seed=seed)
        marked = [replace(s, q=self._named(s.q), is_free=not self.exact.clash(s.q)) for s in found]
        return sorted(marked, key=lambda solution: not solution.is_free)

    def _planned(
        self,
        start: Array,
        goals: Array,
        index: list[int],
        begin: float,
        deadline: float,
        improve: float,
        seed: int,
        region: BoundConstraint | None,
    ) -> Plan:
        postures = np.concatenate([start[None], goals])
        arrays, relaxed = relax(self.robot.search_arrays, self.obstacles.arrays, postures)
        allows = self.robot.search_arrays is not self.robot.arrays
        judged = relaxed or allows or not self.exact.spheres_suffice
        timing = 0.0
        touching = ""
        exact, until = False, begin + SPHERES_FIRST * (deadline - begin)
        for attempt in range(REPAIRS + 2):
            space = SearchSpace.of(arrays, self.obstacles.arrays)
            exact = exact or (attempt >= REPAIRS and region is None)  # padding closed the way
            if region is not None:
                path = self._kept_path(space, region, start, goals, deadline, improve, seed + 1000 * attempt)
            elif exact:
                lower, upper = arrays.lower, arrays.upper
                end = begin + EXACT_NEXT * (deadline - begin) if until < deadline else deadline
                path = hull_path(self.judge, lower, upper, start, goals, deadline=end, seed=seed)
            else:
                path = self._best_path(space, start, goals, until, improve, seed + 1000 * attempt)
            if path is None:
                if region is not None or time.perf_counter() > deadline:
                    break
                if exact:  # the rest of the time for spheres
                    exact, until = False, deadline
                else:  # spheres may be too coarse here
                    exact = True
                continue
            middle = time.perf_counter()
            sure = not (judged or exact)
            if allows and not relaxed and not exact and self.exact.spheres_suffice:
                whole = SearchSpace.of(self.robot.arrays, self.obstacles.arrays)
                if is_free_path(whole, path):  # without the overlaps that the search allowed
                    space, sure = whole, True
            corners = 0.0 if exact or attempt > 2 else 1.0
            trajectory = time_path(space, path, self.limits, self.robot.joint_names, corners=corners)
            if region is not None and not region.inside(trajectory.dense(JUDGED_STEP), 1.0 + 1e-6).all():
                trajectory = time_path(space, path, self.limits, self.robot.joint_names, corners=0.0)
            refused = None if sure else self.exact.first_clash(trajectory, None if exact else arrays)
            timing += time.perf_counter() - middle
            if refused is None:
                reached = int(np.argmin(np.linalg.norm(goals - path[-1], axis=1)))
                return Plan(
                    outcome="solved",
                    reason="",
                    joint_names=self.joint_names,
                    path=self._named(path),
                    trajectory=self._named_trajectory(trajectory),
                    planning_seconds=time.perf_counter() - begin - timing,
                    timing_seconds=timing,
                    goal=index[reached],
                )
            touching = f'; link "{refused[1][0].link}" and "{refused[1][0].other}" kept touching'
            arrays = raise_padding(arrays, self.robot, refused[1], self.obstacles.arrays, start, goals)
        spent = time.perf_counter() - begin
        hint = self._blocking(start, goals) if region is None else f'; widen what "{region.link}" keeps to'
        reason = f"no path in {spent:.2f} s{touching}{hint}; give more time, or choose another goal"
        return self._failed("time over", reason, begin)

    def _blocking(self, start: Array, goals: Array) -> str:
        """Return which obstacle closes the way, where moving one alone opens it; else advice to move some."""
        touched = self.checker.blocking(start, goals)
        for name in touched:
            others = [one for one in self.obstacles.items if one.name != name]
            space = SearchSpace.of(self.robot.arrays, Obstacles(others, self.obstacles.root).arrays)
            found, _ = find_path(space, start, goals, deadline=time.perf_counter() + HINT_SECONDS, seed=0)
            if found is not None:
                return f'; without obstacle "{name}" there is one: move it'
        return "; move obstacles"

    def _kept_path(
        self,
        space: SearchSpace,
        region: BoundConstraint,
        start: Array,
        goals: Array,
        deadline: float,
        improve: float,
        seed: int,
    ) -> Array | None:
        search = ConstrainedSearch(space, region, seed)
        best, until = None, deadline
        while best is None or time.perf_counter() < until:
            found = search.path(start, goals, until)
            if found is None:
                break
            found = search.shorten(found, deadline)
            if best is None:
                until = time.perf_counter() + improve
            if best is None or path_length(found) < path_length(best):
                best = found
        return best

    def _best_path(
        self, space: SearchSpace, start: Array, goals: Array, deadline: float, improve: float, seed: int
    ) -> Array | None:
        best: Array | None = None
        least, until, k = np.inf, 0.0, 0
        whole = space
        while best is None or time.perf_counter() < until:
            if best is not None:  # no shorter path leaves this box
                space = whole.within(*shorter_box(start, goals, least))
            found: list[Array] = []
            most = MOST_SAMPLES
            for _ in range(TRIES):
                one, samples = find_path(space, start, goals, deadline=deadline, seed=seed + k, most=most)
                k += 1
                if one is None:
                    if found and time.perf_counter() < deadline:
                        continue
                    break
                found.append(one)
                most = min(most, LONGER * samples)
                if len(one) == 2 and len(goals) == 1:  # straight: no path is shorter
                    return one
            if not found:
                break
            path = shorten(space, min(found, key=path_length), rounds=ROUNDS, seed=seed + k)
            if best is None:
                until = time.perf_counter() + improve
            if path_length(path) < least:
                best, least = path, path_length(path)
        return best

    # ------------------------------------------------------------------------------------- goals

    def _goal_postures(
        self, start: Array, goal: Goal | Sequence[Goal], seed: int
    ) -> tuple[Outcome, str, Array, list[int]]:
        """Return why no goal is usable, the (g, n) free postures and which goal each belongs to."""
        given = _listed(goal)
        outcome: Outcome = "goal unreachable"
        reason = "no goal was given; give at least one"
        rows: list[Array] = []
        index: list[int] = []
        for k, one in enumerate(given):
            if isinstance(one, PoseGoal | PosesGoal):
                found = postures_for(self.robot, one, self.obstacles.root, start, seed=seed)
                if not found:
                    reason = why_unreachable(self.robot, one, self.obstacles.root, start, seed=seed)
                    continue
                candidates = [solution.q for solution in found]
                roomy = self.checker.free(np.array(candidates), ROOM)
                if roomy.any():  # postures that need no smaller paddings
                    candidates = [q for q, good in zip(candidates, roomy, strict=True) if good]
            else:
                failure, q = self._bounded("goal", self.vector(cast(ArrayLike, one), "goal"))
                if failure:
                    outcome, reason = "goal outside limits", failure
                    continue
                candidates = [q]
            kept = 0
            for q in candidates:
                touching = self.exact.clash(q)
                if touching:
                    if outcome != "goal in collision":
                        outcome = "goal in collision"
                        reason = f"{touching}; move the goal or the obstacle"
                    continue
                rows.append(q)
                index.append(k)
                kept += 1
                if kept == MOST_GOALS:
                    break
        return outcome, reason, np.array(rows).reshape(-1, len(start)), index

    # ----------------------------------------------------------------------------------- vectors

    def vector(self, values: ArrayLike, name: str = "q") -> Array:
        """Return (n,) values given in the order of `joint_names` in depth-first order.

        Raises:
            ConfigError: the length is wrong or a value is not finite; `name` is used in the message.
        """
        q = np.asarray(values, dtype=float)
        if q.shape != (len(self.joint_names),) or not np.isfinite(q).all():
            raise ConfigError(
                f"{name}: {values} must be {len(self.joint_names)} finite numbers, for the joints "
                f"{', '.join(self.joint_names)}"
            )
        return q[self._order]

    def _bounded(self, name: str, q: Array) -> tuple[str, Array]:
        """Return a violation of the limits as text, and q clipped to them."""
        lower, upper = self.robot.chain.lower, self.robot.chain.upper
        beyond = np.maximum(lower - q, q - upper)
        worst = int(np.argmax(beyond))
        if beyond[worst] > 1e-6:
            return (
                f'{name}: joint "{self.robot.joint_names[worst]}" is at {q[worst]:.4f}, outside '
                f"{lower[worst]:.4f} to {upper[worst]:.4f}; choose a position inside",
                q,
            )
        return "", np.clip(q, lower, upper)

    def _named(self, rows: Array) -> Array:
        """Return (..., n) rows in the order of `joint_names`."""
        out = np.empty_like(rows)
        out[..., self._order] = rows
        return out

    def _named_trajectory(self, trajectory: Trajectory) -> Trajectory:
        parts = {key: self._named(getattr(trajectory, key)) for key in ("q", "v", "a", "jerk")}
        return replace(trajectory, joint_names=self.joint_names, **parts)

    def _failed(self, outcome: Outcome, reason: str, begin: float) -> Plan:
        return Plan(
            outcome=outcome,
            reason=reason,
            joint_names=self.joint_names,
            path=np.zeros((0, len(self.joint_names))),
            trajectory=None,
            planning_seconds=time.perf_counter() - begin,
            timing_seconds=0.0,
        )


def _listed(goal: Goal | Sequence[Goal]) -> list[Goal]:
    """Return one goal or several as a list."""
    if isinstance(goal, PoseGoal | PosesGoal):
        return [goal]
    if isinstance(goal, Sequence) and any(isinstance(one, PoseGoal | PosesGoal) for one in goal):
        return list(cast(Sequence[Goal], goal))
    values = np.asarray(cast(ArrayLike, goal), dtype=float)
    return [values] if values.ndim < 2 else list(values)
