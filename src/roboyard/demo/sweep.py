"""A smooth motion of one joint through its range: from home to the upper end, the lower end and home."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.model import Joint
from roboyard.morphology.joint_ranges import full_range
from roboyard.transforms import Array

PEAK_SPEED = {"revolute": 2.5, "continuous": 2.5, "prismatic": 0.5}
"""Largest speed by type of joint (rad/s or m/s)."""
PEAK_ACCELERATION = {"revolute": 6.0, "continuous": 6.0, "prismatic": 1.5}
"""Largest acceleration by type of joint (rad/s² or m/s²)."""
SHARE_OF_EFFORT = 0.2
"""Share of the effort limit that acceleration may use."""
SHARE_OF_LIMIT = 0.8
"""Share of the velocity limit that a sweep may reach."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Sweep:
    """Motion of one joint over a phase from 0 to 1."""

    joint: str
    """Name of the joint."""
    home: float
    """Position at which the sweep starts and ends (rad or m)."""
    lower: float
    """Lower end of the sweep (rad or m)."""
    upper: float
    """Upper end of the sweep (rad or m)."""
    full: tuple[float, float]
    """Full range of the joint (rad or m)."""
    speed: float
    """Largest speed (rad/s or m/s)."""
    acceleration: float
    """Largest acceleration (rad/s² or m/s²)."""
    reasons: tuple[str, ...] = ()
    """Why the sweep is shorter than the full range."""

    @property
    def share(self) -> float:
        """Share of the full range that the sweep covers, 0 to 1."""
        whole = self.full[1] - self.full[0]
        return 1.0 if whole <= 0 else (self.upper - self.lower) / whole

    @property
    def stretches(self) -> tuple[tuple[float, float], ...]:
        """Start and end (rad or m) of each move (to upper end, lower end, home) of more than zero length."""
        points = [self.home, self.upper, self.lower, self.home]
        return tuple((a, b) for a, b in pairwise(points) if a != b)

    @property
    def duration(self) -> float:
        """Shortest duration (s) within the largest speed and acceleration.

        A move of length d in time t follows a half cosine, with the peak speed π d / 2 t and the peak
        acceleration π² d / 2 t². The moves share the duration in proportion to the square roots of their
        lengths, so that all have the same peak acceleration.
        """
        roots = [math.sqrt(abs(b - a)) for a, b in self.stretches]
        if not roots:
            return 0.0
        by_speed = 0.5 * math.pi * max(roots) / self.speed
        by_acceleration = math.pi / math.sqrt(2.0 * self.acceleration)
        return sum(roots) * max(by_speed, by_acceleration)

    def at(self, phase: ArrayLike) -> tuple[Array, Array]:
        """Return the position and its derivative by the phase.

        Args:
            phase: (n,) phases, or one; clipped to 0 to 1.

        Returns:
            (n,) positions (rad or m) and (n,) their derivatives (rad or m).
        """
        s = np.clip(np.asarray(phase, dtype=float), 0.0, 1.0)
        position, slope = np.full_like(s, self.home), np.zeros_like(s)
        roots = [math.sqrt(abs(b - a)) for a, b in self.stretches]
        start = 0.0
        for (a, b), root in zip(self.stretches, roots, strict=True):
            share = root / sum(roots)
            inside = (s >= start) & (s <= start + share)
            u = (s[inside] - start) / share
            position[inside] = a + (b - a) * 0.5 * (1.0 - np.cos(np.pi * u))
            slope[inside] = (b - a) * 0.5 * np.pi * np.sin(np.pi * u) / share
            start += share
        return position, slope


def first_sweep(joint: Joint, home: float, inertia: float) -> Sweep:
    """Return the sweep of a joint through its full range, at a speed within its limits.

    Args:
        joint: a revolute, continuous or prismatic joint.
        home: its home position (rad or m).
        inertia: inertia of all that it moves (kg m² or kg).
    """
    lower, upper = full_range(joint, home)
    speed, acceleration = PEAK_SPEED[joint.type], PEAK_ACCELERATION[joint.type]
    limit = joint.limit
    if limit is not None and limit.velocity is not None and limit.velocity > 0:
        speed = min(speed, SHARE_OF_LIMIT * limit.velocity)
    if limit is not None and limit.effort is not None and limit.effort > 0 and inertia > 0:
        acceleration = min(acceleration, SHARE_OF_EFFORT * limit.effort / inertia)
    return Sweep(
        joint=joint.name,
        home=home,
        lower=lower,
        upper=upper,
        full=(lower, upper),
        speed=speed,
        acceleration=acceleration,
    )
