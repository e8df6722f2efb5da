"""Trajectories of piecewise constant jerk, and the outcome of planning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.transforms import Array

Outcome = Literal[
    "solved",
    "start in collision",
    "start outside limits",
    "start outside constraint",
    "goal in collision",
    "goal outside limits",
    "goal outside constraint",
    "goal unreachable",
    "time over",
]


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory:
    """Joint motion whose third derivative is constant between knots; at rest at both ends."""

    joint_names: tuple[str, ...]
    """(n) joints in the order of all rows."""
    t: Array
    """(k,) times of the knots (s)."""
    q: Array
    """(k, n) positions at the knots (rad or m)."""
    v: Array
    """(k, n) velocities at the knots (rad/s or m/s)."""
    a: Array
    """(k, n) accelerations at the knots (rad/s² or m/s²)."""
    jerk: Array
    """(k, n) third derivatives from each knot to the next, zero in the last row (rad/s³ or m/s³)."""

    @property
    def duration(self) -> float:
        """Time from start to goal (s)."""
        return float(self.t[-1])

    def at(self, times: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Return positions, velocities, accelerations and jerks, each (..., n), at times (...) (s).

        Times before the start and after the end give the ends.
        """
        given = np.clip(np.asarray(times, dtype=float), 0.0, self.t[-1])
        k = np.clip(np.searchsorted(self.t, given, side="right") - 1, 0, len(self.t) - 1)
        dt = (given - self.t[k])[..., None]
        q, v, a, j = self.q[k], self.v[k], self.a[k], self.jerk[k]
        return (
            q + dt * (v + dt * (a / 2 + dt * j / 6)),
            v + dt * (a + dt * j / 2),
            a + dt * j,
            j,
        )

    def dense(self, step: float = 0.01) -> Array:
        """Return (k, n) positions at most `step` (rad or m) apart, both ends included."""
        if len(self.t) < 2:
            return self.q.copy()
        q, v, a, j = self.q[:-1], self.v[:-1], self.a[:-1], self.jerk[:-1]
        spans = np.diff(self.t)
        half = spans[:, None] / 2
        ends = np.square(np.maximum(np.abs(v), np.abs(self.v[1:]))).sum(axis=1)
        middle = np.square(v + half * (a + half * j / 2)).sum(axis=1)
        length = 1.1 * np.sqrt(np.maximum(ends, middle)) * spans
        counts = np.maximum(np.ceil(length / step), 1).astype(np.int64)
        last = np.cumsum(counts)
        k = np.repeat(np.arange(len(counts)), counts)
        share = (np.arange(last[-1]) - (last - counts)[k] + 1) / counts[k]
        dt = (share * spans[k])[:, None]
        rows = np.empty((last[-1] + 1, q.shape[1]))
        rows[0] = self.q[0]
        rows[1:] = q[k] + dt * (v[k] + dt * (a[k] / 2 + dt * (j[k] / 6)))
        rows[last] = self.q[1:]
        return rows


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """Outcome of planning one motion."""

    outcome: Outcome
    reason: str
    """Cause and remedy in one line; "" where the motion was planned."""
    joint_names: tuple[str, ...]
    """(n) joints in the order of all rows."""
    path: Array
    """(w, n) way points (rad or m); empty without a solution."""
    trajectory: Trajectory | None
    """Timing of the path, with corners cut inside its hull; None without a solution."""
    planning_seconds: float
    """Time to find and shorten the path (s)."""
    timing_seconds: float
    """Time to compute the trajectory and to check it (s)."""
    goal: int | None = None
    """Which of several goals was reached."""

    @property
    def solved(self) -> bool:
        """Whether there is a trajectory."""
        return self.outcome == "solved"

    @property
    def length(self) -> float:
        """Length of the path (rad)."""
        return path_length(self.path)


def path_length(path: Array) -> float:
    """Return the length of (w, n) way points (rad)."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
