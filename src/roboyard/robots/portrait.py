"""A picture of a robot in its world."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from roboyard.robots.robot_body import RobotBody

if TYPE_CHECKING:
    from roboyard.rendering import Image

WIDTH, HEIGHT = 480, 360
"""Default size (pixels)."""
FOVY = math.radians(30.0)
"""Vertical field of view (rad)."""
VIEW_FROM = (0.80, -0.48, 0.36)
"""Direction from the robot to the camera: robots face +x."""
RADIUS_PER_DIAGONAL = 0.52
"""Radius of the sphere that is shown, per diagonal of the robot's bounding box."""


def render_portrait(robot: RobotBody, *, width: int = WIDTH, height: int = HEIGHT) -> Image:
    """Return a picture of a robot in its world, from the front and its right.

    Args:
        robot: in the middle of the picture.
        width: pixels.
        height: pixels.
    """
    from roboyard.rendering import Camera

    low, high = robot.body.bounds
    target = (low + high) / 2
    reach = RADIUS_PER_DIAGONAL * max(float(np.linalg.norm(high - low)), 0.05)
    across = 2.0 * math.atan(math.tan(FOVY / 2) * width / height)
    direction = np.asarray(VIEW_FROM) / np.linalg.norm(VIEW_FROM)
    eye = target + direction * reach / math.sin(min(FOVY, across) / 2)
    return robot.world.render(Camera.look_at(eye, target, width=width, height=height, fovy=FOVY))
