"""Velocities that are reached under load, and places that are held at rest.

    u = w* + i, with i ← clip(i + k (w* - w) dt, ±0.2 w_max)

A drive that is as soft as the joint's inertia allows leaves an error of load / kd; the integral takes it
away. Once all wanted velocities are zero and the joints rest, they are held where they are.
"""

from __future__ import annotations

import numpy as np

from roboyard.robots.control.controller import Control, GroupState
from roboyard.transforms import Array

INTEGRAL_RATE = 5.0
"""1/s"""
LARGEST_SHARE = 0.2
"""Of the velocity limit."""
REST_SPEED = 0.01
"""rad/s or m/s: below this a joint whose wanted velocity is zero counts as resting."""


class VelocityTracking:
    """n joints that follow velocities."""

    def __init__(self, fastest: Array, *, hold_position: bool = True) -> None:
        """Start with no load known; `fastest` are the (n,) velocity limits."""
        self._bound = LARGEST_SHARE * fastest
        self._holds = hold_position
        self.reset()

    def reset(self) -> None:
        """Forget the load and the place."""
        self._sum = np.zeros(len(self._bound))
        self._rest: Array | None = None

    def control(self, wanted: Array, state: GroupState) -> Control:
        """What to ask of the drives; `wanted` (n,) in rad/s or m/s."""
        if not self._holds or wanted.any():
            self._rest = None
            return self._moving(wanted, state)
        if self._rest is None:
            if np.abs(state.v).max(initial=0.0) > REST_SPEED:
                return self._moving(wanted, state)
            self._rest = state.q.copy()
        return Control(kind="position", value=self._rest)

    def _moving(self, wanted: Array, state: GroupState) -> Control:
        change = INTEGRAL_RATE * state.dt * (wanted - state.v)
        self._sum = np.clip(self._sum + change, -self._bound, self._bound)
        return Control(kind="velocity", value=wanted + self._sum, led=wanted)
