"""Inertia that Bullet computes from collision shapes, ignoring the file's.

One shape at the inertial frame has its exact formula; anything else is treated as the solid box around it.
"""

from __future__ import annotations

import numpy as np

from roboyard.pybullet.bullet_rules.shape_bounds import PLANE_HALF_SIZE, LinkBounds
from roboyard.transforms import Array

Moments = tuple[float, float, float]


def shape_moments(mass: float, bounds: LinkBounds, margin: float | None = None) -> Moments:
    """Return the moments (kg m²) about the inertial frame's axes for a mass (kg) and bounds of shapes.

    Args:
        mass: mass (kg).
        bounds: box around the shapes.
        margin: margin that replaces that of the bounds (m).
    """
    if mass == 0.0:
        return 0.0, 0.0, 0.0
    if bounds.kind == "sphere":
        moment = 0.4 * mass * bounds.margin**2
        return moment, moment, moment
    margin = bounds.margin if margin is None else margin
    lower, upper = bounds.grown(margin)
    if bounds.kind == "cylinder":
        radius, length = float(upper[0]), float(upper[2] - lower[2])
        across = mass * (3 * radius**2 + length**2) / 12
        return across, across, mass * radius**2 / 2
    if upper.max() >= PLANE_HALF_SIZE:
        return solid_box(mass, np.full(3, margin))
    return solid_box(mass, (upper - lower) / 2 + (margin if bounds.kind == "hull" else 0.0))


def solid_box(mass: float, half: Array) -> Moments:
    """Return the moments (kg m²) of a solid box of (3,) half extents (m)."""
    x, y, z = (4.0 * float(h) ** 2 for h in half)
    k = mass / 12.0
    return k * (y + z), k * (x + z), k * (x + y)
