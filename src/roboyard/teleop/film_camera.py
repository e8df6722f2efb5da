"""A film's camera that moves along when the robot leaves the middle of the picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.rendering import Camera

MIDDLE = 0.7
"""Share of the picture's width and height in which the robot stays."""


def keep_in_view(camera: Camera, point: ArrayLike) -> Camera:
    """Return a camera, moved without turning, that has a point in the middle part of its picture.

    Args:
        camera: a perspective camera.
        point: (3,) in the world frame (m).

    Returns:
        `camera` itself where the point is in the middle part already, or behind the camera.
    """
    inside = camera.view @ np.append(np.asarray(point, dtype=float), 1.0)
    depth = -inside[2]
    if depth <= 0.0:
        return camera
    limits = MIDDLE * depth / np.array([camera.projection[0, 0], camera.projection[1, 1]])
    excess = inside[:2] - np.clip(inside[:2], -limits, limits)
    if not excess.any():
        return camera
    view = camera.view.copy()
    view[:2, 3] -= excess
    return replace(camera, view=view)
