"""One joint's way through its range: from home to one end, to the other, and home again, smoothly."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from roboyard.description.model import Joint
from roboyard.transforms import Array

FREE_SLIDE = 0.1
"""m that a prismatic joint without limits moves each way."""
TURN = 2 * math.pi
PEAK_SPEED = {"revolute": 2.5, "continuous": 2.5, "prismatic": 0.5}
"""rad/s or m/s at most."""
PEAK_ACCELERATION = {"revolute": 6.0, "continuous": 6.0, "prismatic": 1.5}
"""rad/s² or m/s² at most."""
SHARE_OF_EFFORT = 0.2
"""Of the file's effort limit that may go into acceleration."""
SHARE_OF_LIMIT = 0.8
"""Of the file's velocity limit at most."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Sweep:
    """A joint's motion over a phase that runs from 0 to 1; rad or m."""

    joint: str
    home: float
    lower: float
    upper: float
    full: tuple[float, float]
    """What the joint could do; `lower` and `upper` are what it is made to do."""
    speed: float
    """Largest that is asked of it; rad/s or m/s."""
    acceleration: float
    """Largest that is asked of it; rad/s² or m/s²."""
    reasons: tuple[str, ...] = ()
    """Why it does not go all the way."""

    @property
    def share(self) -> float:
        """Part of the full range that is moved, 0 to 1."""
        whole = self.full[1] - self.full[0]
        return 1.0 if whole <= 0 else (self.upper - self.lower) / whole

    @property
    def stretches(self) -> tuple[tuple[float, float], ...]:
        """From home to the upper end, to the lower end, and home, without those of no length; rad or m."""
        points = [self.home, self.upper, self.lower, self.home]
        return tuple((a, b) for a, b in pairwise(points) if a != b)

    @property
    def duration(self) -> float:
        """s, for the largest speed and acceleration.

        A stretch of length d in time t follows a half cosine, which peaks at the speed π d / 2 t and the
        acceleration π² d / 2 t²; the stretches share the time as the square roots of their lengths, so that
        the acceleration is the same in all.
        """
        roots = [math.sqrt(abs(b - a)) for a, b in self.stretches]
        if not roots:
            return 0.0
        by_speed = 0.5 * math.pi * max(roots) / self.speed
        by_acceleration = math.pi / math.sqrt(2.0 * self.acceleration)
        return sum(roots) * max(by_speed, by_acceleration)

    def at(self, phase: ArrayLike) -> tuple[Array, Array]:
        """(...) position, and (...) its derivative by the phase."""
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


def full_range(joint: Joint, home: float) -> tuple[float, float]:
    """What "through its range" means: the limits, but never more than a turn; rad or m.

    A continuous joint makes one turn; a revolute one of more than a turn makes half a turn each way; a slide
    without limits moves a little.
    """
    limits = joint.position_limits()
    if joint.type == "prismatic":
        lower, upper = limits or (home - FREE_SLIDE, home + FREE_SLIDE)
        return max(lower, home - 100.0), min(upper, home + 100.0)
    if limits is None:
        return home, home + TURN
    if limits[1] - limits[0] > TURN:
        return max(limits[0], home - math.pi), min(limits[1], home + math.pi)
    return limits


def first_sweep(joint: Joint, home: float, inertia: float) -> Sweep:
    """The joint's whole range at a fitting speed; `inertia` is that of what it moves, kg m² or kg."""
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
