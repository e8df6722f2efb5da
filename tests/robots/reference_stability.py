"""Reference implementation of `roboyard.robots.stability.kernels` in NumPy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from roboyard.robots.stability.zmp import TINY, BalanceMargins
from roboyard.transforms import Array


def hull_edges(points: Array) -> tuple[Array, Array, Array] | None:
    """Edges of the convex hull of points in the plane (Andrew's monotone chain).

    Args:
        points: (n, 2) m.

    Returns:
        (e, 2) outward normals, (e,) m of each edge along its normal, (2,) mean of the corners; None where the
        hull has no area.
    """
    order = sorted({(float(x), float(y)) for x, y in points})
    if len(order) < 3:
        return None
    corners = np.array(_half(order)[:-1] + _half(order[::-1])[:-1])
    along = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(along, axis=1)
    area = 0.5 * abs(float(np.sum(corners[:, 0] * along[:, 1] - corners[:, 1] * along[:, 0])))
    if len(corners) < 3 or area < 1e-9 + 1e-3 * float(length.max()) ** 2:
        return None
    normals = np.stack([along[:, 1], -along[:, 0]], axis=1) / length[:, None]
    return normals, np.sum(normals * corners, axis=1), corners.mean(axis=0)


def _half(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """One side of the hull of sorted points, counter-clockwise."""
    kept: list[tuple[float, float]] = []
    for x, y in points:
        while len(kept) > 1:
            (ax, ay), (bx, by) = kept[-2], kept[-1]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                break
            kept.pop()
        kept.append((x, y))
    return kept


def share(com_margin: Array, push: Array) -> float:
    """The largest share of pushes that stays within the room on every side; 0 to 1."""
    out = push > TINY
    return float(np.clip(np.min(com_margin[out] / push[out], initial=1.0), 0.0, 1.0))


def together(balance: BalanceMargins, acceleration: Array) -> float:
    """Share of (k,) accelerations that joints may take at once."""
    parts = balance.zmp_shift * acceleration
    push = 0.5 * (np.abs(parts.sum(axis=1)) + np.abs(parts).sum(axis=1))
    return float(np.min(balance.zmp_margin / np.maximum(push, balance.zmp_margin), initial=1.0))


def allows(balance: BalanceMargins, shift: Array, direction: Array) -> NDArray[np.bool_]:
    """(k,) whether joints may go on that way, `shift` being the way to where they come to rest."""
    left = balance.com_margin - balance.com_shift @ shift
    worse = (left[:, None] < 0.0) & (balance.com_shift * direction > TINY)
    return np.logical_not(np.any(worse, axis=0))


def follow(
    reference: Array,
    speed: Array,
    q: Array,
    goal: Array,
    rise: Array,
    fastest: Array,
    dt: float,
    balance: BalanceMargins,
) -> tuple[Array, Array]:
    """Reference and speed one step later."""
    gap = goal - reference
    calm = share(balance.zmp_margin, balance.swing) ** 0.5
    if calm < 1.0:
        fastest = np.minimum(fastest, np.abs(speed) * calm)
    rise = np.minimum(
        rise, (balance.zmp_margin[:, None] / np.maximum(np.abs(balance.zmp_shift), TINY)).min(axis=0)
    )
    rise = rise * together(balance, rise * np.sign(np.where(gap == 0.0, speed, gap)))
    stop = reference - q + speed * np.abs(speed) / (2.0 * rise)
    gap = np.where(allows(balance, stop, np.sign(gap)), gap, 0.0)
    goal = np.where(gap == 0.0, reference, goal)
    half = 0.5 * rise * dt
    braking = np.sqrt(half * half + 2.0 * rise * np.abs(gap)) - half
    wanted = np.sign(gap) * np.minimum(np.minimum(fastest, braking), np.abs(gap) / dt)
    change = rise * dt
    speed = np.minimum(np.maximum(wanted, speed - change), speed + change)
    move = speed * dt
    arrives = (np.sign(move) == np.sign(gap)) & (np.abs(move) >= np.abs(gap))
    return np.where(arrives, goal, reference + move), np.where(arrives, 0.0, speed)
