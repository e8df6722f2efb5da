"""Velocity tracking without steady error under load, and holding of positions at rest.

    u = w* + i, with i ← clip(i + k (w* - w) dt, ±0.2 w_max)

A drive with a gain limited by the joint's inertia has a steady error of load / kd; the integral removes it.
Once all target velocities are zero and the joints rest, their positions are held.
"""

from __future__ import annotations

import numpy as np

from roboyard.robots.control.controller import Control, GroupState
from roboyard.transforms import Array

INTEGRAL_RATE = 5.0
"""Rate k of the integral (1/s)."""
MAX_INTEGRAL = 0.2
"""Bound of the integral, as a fraction of the velocity limit."""
REST_SPEED = 0.01
"""Joints slower than this are at rest (rad/s or m/s)."""


class VelocityTracking:
    """n joints that follow target velocities."""

    def __init__(self, fastest: Array, *, hold_position: bool = True) -> None:
        """Create the tracking of joints with (n,) velocity limits `fastest` (rad/s or m/s)."""
        self._bound = MAX_INTEGRAL * fastest
        self._holds = hold_position
        self.reset()

    def reset(self) -> None:
        """Reset the integral and the held positions."""
        self._sum = np.zeros(len(self._bound))
        self._rest: Array | None = None

    def control(self, target: Array, state: GroupState) -> Control:
        """Return the drive targets for (n,) target velocities (rad/s or m/s)."""
        if not self._holds or target.any():
            self._rest = None
            return self._moving(target, state)
        if self._rest is None:
            if np.abs(state.v).max(initial=0.0) > REST_SPEED:
                return self._moving(target, state)
            self._rest = state.q.copy()
        return Control(kind="position", value=self._rest)

    def _moving(self, target: Array, state: GroupState) -> Control:
        change = INTEGRAL_RATE * state.dt * (target - state.v)
        self._sum = np.clip(self._sum + change, -self._bound, self._bound)
        return Control(kind="velocity", value=target + self._sum, led=target)
