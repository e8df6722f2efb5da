"""Gaps up to which Bullet keeps the contact points of a pair.

A pair keeps the points whose gap is below 0.02 of the smaller shape's reach from its inertial frame: half the
diagonal of its box and the distance of the box's centre.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from roboyard.pybullet.bullet_rules.shape_bounds import LinkBounds

SHARE = 0.02
"""Bullet's contact threshold, as a share of a shape's reach."""


def contact_reaches(model: Any, bounds: Iterable[tuple[int, LinkBounds, float]]) -> np.ndarray:
    """Return the (ngeom,) largest gaps of contact points (m), infinite for planes.

    Args:
        model: MjModel.
        bounds: row of the MuJoCo body, bounds and margin (m) of each link.
    """
    by_row = np.full(model.nbody, np.inf)
    for row, box, margin in bounds:
        if box.kind != "plane":
            lower, upper = box.grown(margin)
            reach = np.linalg.norm(upper - lower) / 2 + np.linalg.norm(upper + lower) / 2
            by_row[row] = SHARE * reach
    return by_row[model.geom_bodyid]
