"""A reference that comes to its goal with limited speeds and accelerations, and keeps a robot upright.

    q̈ ≤ min(v_max / 0.2 s, 0.4 E / M)   so that the drives can follow
    q̈ ≤ what the footing bears          joints that move at once share it

A joint stops where going on would lead the centre of mass off the wheels, see
`roboyard.robots.stability.zmp`.
"""

from __future__ import annotations

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.robots.control.controller import GroupLimits, GroupState, acceleration
from roboyard.transforms import Array

_kernels = lazy_module("roboyard.robots.stability.kernels")


class RateLimiter:
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
        way = goal - self.reference
        if not way.any() and not self._speed.any():
            return self.reference
        rise, fastest = acceleration(self._limits, state.inertia).copy(), self._limits.velocity.copy()
        allowed = np.ones(len(rise), dtype=bool)
        balance = state.balance() if state.balance is not None else None
        if balance is not None:
            _kernels().limit_acceleration(
                *(
                    rise,
                    fastest,
                    self._speed,
                    way,
                    state.q,
                    self.reference,
                    balance.com_shift,
                    balance.zmp_shift,
                ),
                *(balance.com_margin, balance.zmp_margin, balance.swing, allowed),
            )
        self.reference, self._speed = self.reference.copy(), self._speed.copy()
        _kernels().advance(self.reference, self._speed, goal, way, allowed, rise, fastest, state.dt)
        return self.reference
