"""Gaps up to which Bullet keeps the points of a pair.

A pair keeps the points whose gap is below 0.02 of the smaller shape's reach from its inertial frame: half the
diagonal of its box and the distance of the box's centre.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from math import sqrt
from typing import Any

import numpy as np

from roboyard.pybullet.bullet_rules.shape_bounds import LinkBounds

SHARE = 0.02
"""Bullet's contact threshold, as a share of a shape's reach."""


def contact_reaches(model: Any, bodies: Iterable[tuple[np.ndarray, Sequence[float]]]) -> np.ndarray:
    """Return the (ngeom,) largest gaps of contact points (m), infinite for planes.

    Args:
        model: MjModel.
        bodies: rows (n,) of each body's links among MuJoCo's bodies, and what `reaches_of` returns of them.
    """
    by_row = np.full(model.nbody, np.inf)
    for rows, reaches in bodies:
        by_row[rows] = reaches
    return by_row[model.geom_bodyid]


def reaches_of(bounds: Iterable[tuple[LinkBounds, float]]) -> list[float]:
    """Return the largest gap of contact points (m) of links with these bounds and margins (m)."""
    return [np.inf if box.kind == "plane" else _reach(box, margin) for box, margin in bounds]


@lru_cache(maxsize=512)
def _reach(box: LinkBounds, margin: float) -> float:
    """Return the largest gap of the points of a link with these bounds and this margin (m)."""
    (a, b, c), (x, y, z) = box.grown(margin).tolist()
    size = sqrt((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2)
    place = sqrt((x + a) ** 2 + (y + b) ** 2 + (z + c) ** 2)
    return SHARE * (size / 2 + place / 2)
