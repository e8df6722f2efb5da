"""Velocities that are reached under load: u = w* + i, with i ← clip(i + k (w* - w) dt, ±0.2 w_max).

A drive that is as soft as the joint's inertia allows leaves an error of load / kd; the integral takes it
away.
"""

from __future__ import annotations

import numpy as np

from roboyard.poses import Array

INTEGRAL_RATE = 5.0
"""1/s"""
LARGEST_SHARE = 0.2
"""Of the velocity limit."""


class VelocityIntegral:
    """The integral of n joints."""

    def __init__(self, fastest: Array) -> None:
        self._bound = LARGEST_SHARE * fastest
        self._sum = np.zeros(len(fastest))

    def reset(self) -> None:
        """Forget the load."""
        self._sum = np.zeros(len(self._sum))

    def corrected(self, wanted: Array, measured: Array, dt: float) -> Array:
        """(n,) what to ask of the drives; rad/s or m/s."""
        self._sum = np.clip(self._sum + INTEGRAL_RATE * dt * (wanted - measured), -self._bound, self._bound)
        return wanted + self._sum
