"""The initial camera of a page that drives a robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboyard.transforms import matrix_from_quaternion

if TYPE_CHECKING:
    from roboyard.robots import Robot
    from roboyard.viewer.viewer import Viewer

BEHIND, ABOVE = 2.6, 1.9
"""Camera distance behind and height above the robot, in robot heights; above the walls of the home scene."""
MIN_HEIGHT = 0.5
"""Robots that are lower count as this high (m)."""


def look_from_behind(viewer: Viewer, robot: Robot) -> None:
    """Place the cameras of all pages behind and above the robot; pages opened later start there too."""
    position, quaternion = robot.base_link.pose
    forward = matrix_from_quaternion(quaternion)[:, 0]
    heading = np.array([forward[0], forward[1], 0.0]) / max(float(np.hypot(forward[0], forward[1])), 1e-9)
    height = max(float(np.ptp(robot.body.bounds[:, 2])), MIN_HEIGHT)
    target = np.array([position[0], position[1], position[2] + 0.5 * height])
    eye = target + height * (-BEHIND * heading + [0.0, 0.0, ABOVE - 0.5])
    viewer.server.initial_camera.position, viewer.server.initial_camera.look_at = eye, target
    for client in viewer.server.get_clients().values():
        client.camera.position, client.camera.look_at = eye, target
