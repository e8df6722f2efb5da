"""A reference that moves to its goal with limited velocity and acceleration, and keeps a robot from tipping
over.

    q̈ ≤ min(v_max / 0.2 s, 0.4 E / M)   so that the drives can follow
    q̈ ≤ limit of the support polygon    shared by joints that move at once

A joint stops where further motion would shift the centre of mass out of the support polygon, see
`roboyard.robots.stability.zmp`.
"""

from __future__ import annotations

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.robots.control.controller import GroupLimits, GroupState, acceleration
from roboyard.transforms import Array

_kernels = lazy_module("roboyard.robots.stability.kernels")


class RateLimiter:
    """The reference of n joints, limited in velocity and acceleration."""

    def __init__(self, limits: GroupLimits) -> None:
        """Create a limiter without reference."""
        self._limits = limits
        self.reset()

    def reset(self) -> None:
        """Discard the reference."""
        self.reference: Array | None = None
        """(n,) reference (rad or m); None before the first step."""
        self._speed = np.zeros(self._limits.size)

    def follow(self, goal: Array, state: GroupState) -> Array:
        """Return the reference, moved one step towards a goal; it starts at the joints' positions.

        Args:
            goal: (n,) rad or m.
            state: of the joints; the step is `state.dt`.

        Returns:
            (n,) reference (rad or m).
        """
        if self.reference is None:
            self.reference, self._speed = state.q.copy(), np.zeros(self._limits.size)
        way = goal - self.reference
        if not way.any() and not self._speed.any():
            return self.reference
        rise, fastest = (
            acceleration(self._limits, state.inertia, state.bias).copy(),
            self._limits.velocity.copy(),
        )
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
