"""Axes of joints as files give them: any vectors but zero."""

from __future__ import annotations

import math
from collections.abc import Sequence

_ROUNDING = 1e-15


def unit_axis(vector: Sequence[float]) -> tuple[tuple[float, float, float], float]:
    """Return a unit vector (3,) and the length that the given vector (3,) has.

    A length that differs from 1 by rounding alone is 1, and the vector then stays as it is. Zero has no
    direction: (1, 0, 0) and 1.
    """
    x, y, z = map(float, vector)
    length = math.hypot(x, y, z)
    if length == 0.0:
        return (1.0, 0.0, 0.0), 1.0
    if abs(length - 1.0) <= _ROUNDING:
        return (x, y, z), 1.0
    return (x / length, y / length, z / length), length
