"""Limits, states and margins for tests of controllers without a world."""

from __future__ import annotations

import numpy as np

from roboyard.robots.control import REGISTERED_CONTROLLERS, Controller, GroupLimits, GroupState
from roboyard.robots.stability.zmp import BalanceMargins

DT = 1 / 30


def limits(n: int = 1, **changed) -> GroupLimits:
    values = {"lower": -2.0, "upper": 2.0, "velocity": 3.0, "effort": 10.0, **changed}
    arrays = {key: np.array(np.broadcast_to(np.asarray(value, float), (n,))) for key, value in values.items()}
    return GroupLimits(**arrays)


def make(name: str, bounds: GroupLimits, **keys) -> Controller:
    cls = REGISTERED_CONTROLLERS[name]
    return cls(bounds, cls.Settings(**keys))


def state(q, v=None, dt: float = DT, **more) -> GroupState:
    positions = np.array(q, float)
    return GroupState(
        q=positions, v=np.zeros(len(positions)) if v is None else np.array(v, float), dt=dt, **more
    )


def square_margins(half: float, height: float, gravity: float, **changed) -> BalanceMargins:
    """Return the margins of a point mass above the middle of a square of wheels, without joints."""
    normals = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    values = {
        "com_shift": np.zeros((4, 1)),
        "zmp_shift": np.zeros((4, 1)),
        "com_margin": np.full(4, half),
        "zmp_margin": np.full(4, half),
        "edge": np.full(4, half),
        "lost": np.zeros(4),
        "reserve": np.zeros(4),
        "swing": np.zeros(4),
        "outwards": normals,
        "height": height / gravity,
        "moment": np.zeros(2),
    }
    return BalanceMargins(**{**values, **changed})
