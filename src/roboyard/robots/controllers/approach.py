"""A reference that comes to its goal with limited speeds and accelerations, and keeps a robot upright.

    q̈ ≤ min(v_max / 0.2 s, 0.4 E / M)   so that the drives can follow
    q̈ ≤ what the footing bears          joints that move at once share it

A joint stops where going on would lead the centre of mass off the wheels, see `roboyard.robots.balance`.
"""

from __future__ import annotations

import numpy as np

from roboyard.poses import Array
from roboyard.robots.controllers.base import GroupLimits, GroupState, acceleration


class Approach:
    """n joints' reference on its way."""

    def __init__(self, limits: GroupLimits) -> None:
        """Start nowhere."""
        self._limits = limits
        self.reset()

    def reset(self) -> None:
        """Forget the reference."""
        self.reference: Array | None = None
        """(n,) rad or m; None before the first step."""
        self._speed = np.zeros(self._limits.size)

    def follow(self, goal: Array, state: GroupState) -> Array:
        """(n,) the reference, one step of `state.dt` nearer to a goal; starts where the joints are."""
        if self.reference is None:
            self.reference, self._speed = state.q.copy(), np.zeros(self._limits.size)
        gap, fastest, dt = goal - self.reference, self._limits.velocity, state.dt
        if not gap.any() and not self._speed.any():
            return self.reference
        rise = acceleration(self._limits, state.inertia)
        balance = state.balance() if state.balance is not None else None
        if balance is not None:
            calm = balance.calm()
            if calm < 1.0:
                fastest = np.minimum(fastest, np.abs(self._speed) * calm)
            rise = np.minimum(rise, balance.acceleration())
            rise = rise * balance.together(rise * np.sign(np.where(gap == 0.0, self._speed, gap)))
            stop = self.reference - state.q + self._speed * np.abs(self._speed) / (2.0 * rise)
            gap = np.where(balance.allows(stop, np.sign(gap)), gap, 0.0)
            goal = np.where(gap == 0.0, self.reference, goal)
        braking = np.sqrt(2.0 * rise * np.abs(gap))
        wanted = np.sign(gap) * np.minimum(np.minimum(fastest, braking), np.abs(gap) / dt)
        change = rise * dt
        self._speed = np.minimum(np.maximum(wanted, self._speed - change), self._speed + change)
        move = self._speed * dt
        arrives = (np.sign(move) == np.sign(gap)) & (np.abs(move) >= np.abs(gap))
        self.reference = np.where(arrives, goal, self.reference + move)
        self._speed[arrives] = 0.0
        return self.reference
