"""Where a page that drives looks from."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboyard.transforms import matrix_from_quaternion

if TYPE_CHECKING:
    from roboyard.robots import Robot
    from roboyard.viewer.viewer import Viewer

BEHIND, ABOVE = 2.6, 1.9
"""Of the robot's height: where a page looks from, which is over the walls of a flat."""
LEAST_HEIGHT = 0.5
"""m: smaller robots are looked at as if they were as tall"""


def look_from_behind(viewer: Viewer, robot: Robot) -> None:
    """Let all pages look over the robot's shoulder, those that open later too."""
    place, quaternion = robot.base_link.pose
    forward = matrix_from_quaternion(quaternion)[:, 0]
    heading = np.array([forward[0], forward[1], 0.0]) / max(float(np.hypot(forward[0], forward[1])), 1e-9)
    height = max(float(np.ptp(robot.body.bounds[:, 2])), LEAST_HEIGHT)
    target = np.array([place[0], place[1], place[2] + 0.5 * height])
    eye = target + height * (-BEHIND * heading + [0.0, 0.0, ABOVE - 0.5])
    viewer.server.initial_camera.position, viewer.server.initial_camera.look_at = eye, target
    for client in viewer.server.get_clients().values():
        client.camera.position, client.camera.look_at = eye, target
