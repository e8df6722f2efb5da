"""A camera position from which all bodies of a world are in the picture."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from roboyard.sim.body import Body
from roboyard.transforms import Array

FOVY = math.radians(45.0)
"""Vertical opening angle (rad) of the camera that `viewpoint` assumes."""
VIEW_FROM = (1.0, -0.75, 0.5)
"""Direction from the target to the camera; robots face +x."""
LEAST_EXTENT, MOST_EXTENT = 0.2, 12.0
"""Smallest and largest diagonal (m) of the box that `viewpoint` fits into the picture."""


def viewpoint(bodies: Iterable[Body]) -> tuple[Array, Array]:
    """Return the camera's position and target, each (3,) in the world frame (m).

    A camera there with a vertical opening angle of `FOVY` shows all bodies; infinite planes are ignored.
    """
    lower, upper = extent(bodies)
    centre = 0.5 * (lower + upper)
    radius = 0.5 * float(np.clip(np.linalg.norm(upper - lower), LEAST_EXTENT, MOST_EXTENT))
    direction = np.array(VIEW_FROM) / np.linalg.norm(VIEW_FROM)
    return centre + direction * 0.9 * radius / math.sin(0.5 * FOVY), centre


def extent(bodies: Iterable[Body]) -> Array:
    """Return the (2, 3) bounding box of all bodies of finite size, in the world frame (m)."""
    boxes = [body.bounds for body in bodies]
    boxes = [box for box in boxes if np.isfinite(box).all() and np.ptp(box, axis=0).max() > 0]
    if not boxes:
        return np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]])
    return np.stack([np.min([b[0] for b in boxes], axis=0), np.max([b[1] for b in boxes], axis=0)])
