"""Inertia that Bullet computes from collision shapes, ignoring the file's.

One shape at the inertial frame has its exact formula; anything else is treated as the solid box around it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

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
    if mass == 0.0 or bounds.kind == "triangles":  # Bullet has no moments of these
        return 0.0, 0.0, 0.0
    if bounds.kind == "sphere":
        moment = 0.4 * mass * bounds.margin**2
        return moment, moment, moment
    margin = bounds.margin if margin is None else margin
    lower, upper = bounds.grown(margin).tolist()
    if bounds.kind == "cylinder":
        radius, length = upper[0], upper[2] - lower[2]
        across = mass * (3 * radius**2 + length**2) / 12
        return across, across, mass * radius**2 / 2
    if max(upper) >= PLANE_HALF_SIZE:
        return solid_box(mass, (margin, margin, margin))
    more = margin if bounds.kind == "hull" else 0.0
    return solid_box(mass, [(high - low) / 2 + more for low, high in zip(lower, upper, strict=True)])


def solid_box(mass: float, half: Sequence[float] | Array) -> Moments:
    """Return the moments (kg m²) of a solid box of (3,) half extents (m)."""
    x, y, z = (4.0 * float(h) ** 2 for h in half)
    k = mass / 12.0
    return k * (y + z), k * (x + z), k * (x + y)


_AXES_THRESHOLD, _AXES_ROUNDS, _EPSILON = 1e-6, 30, 2.220446049250313e-16
"""Bullet's accuracy of principal axes, relative to the moments, and the most rotations to reach it."""


def principal_moments(inertia: Sequence[float]) -> tuple[Moments, Array]:
    """Return the moments of a tensor about its principal axes, in Bullet's order, and the (3, 3) axes.

    Bullet turns the axes in pairs, each time by the least angle that removes the largest product of inertia,
    so that the axes stay near those of the file, unlike those of a sorted eigenvalue problem.

    Args:
        inertia: ixx, ixy, ixz, iyy, iyz, izz.
    """
    xx, xy, xz, yy, yz, zz = inertia
    m, axes = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], np.eye(3)
    for _ in range(_AXES_ROUNDS):
        p, q, r = max(((0, 1, 2), (0, 2, 1), (1, 2, 0)), key=lambda place: abs(m[place[0]][place[1]]))
        largest, limit = abs(m[p][q]), _AXES_THRESHOLD * (abs(m[0][0]) + abs(m[1][1]) + abs(m[2][2]))
        if largest <= _EPSILON * limit:
            break
        product = m[p][q]
        theta = (m[q][q] - m[p][p]) / (2.0 * product)
        if theta**4 < 10.0 / _EPSILON:
            root = sqrt(1.0 + theta * theta)
            t = 1.0 / (theta + root if theta >= 0.0 else theta - root)
            cosine = 1.0 / sqrt(1.0 + t * t)
        else:
            t = 1.0 / (theta * (2.0 + 0.5 / (theta * theta)))
            cosine = 1.0 - 0.5 * t * t
        sine = cosine * t
        m[p][q] = m[q][p] = 0.0
        m[p][p] -= t * product
        m[q][q] += t * product
        first, second = m[r][p], m[r][q]
        m[r][p] = m[p][r] = cosine * first - sine * second
        m[r][q] = m[q][r] = cosine * second + sine * first
        axes[:, p], axes[:, q] = (
            cosine * axes[:, p] - sine * axes[:, q],
            cosine * axes[:, q] + sine * axes[:, p],
        )
        if largest <= limit:
            break
    return (m[0][0], m[1][1], m[2][2]), axes
