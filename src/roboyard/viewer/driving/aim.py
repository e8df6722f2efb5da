"""The initial camera of a page that drives a robot."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.sim.queries import rays
from roboyard.sim.queries.default_view import FILL, FOVY
from roboyard.transforms import Array, matrix_from_quaternion

if TYPE_CHECKING:
    from roboyard.robots import Robot
    from roboyard.viewer.viewer import Viewer

DISTANCES = (2.9, 2.2, 1.7)
"""Distances from the robot's middle that are tried (robot heights)."""
SEEN = (0.1, 0.5, 0.95)
"""Heights of the points that must be visible (robot heights)."""
SHOWN_THROUGH = (0.02, 0.5, 0.95)
"""Heights of the points that walls must not hide later (robot heights)."""
ELEVATIONS = (28.0, 40.0, 50.0)
"""Angles above the horizon that are tried (degrees)."""
TURNS = (0.0, 30.0, -30.0, 60.0, -60.0, 100.0, -100.0, 140.0, -140.0, 180.0)
"""Angles from behind the robot that are tried (degrees)."""
MARGIN = 0.15
"""Distance that the camera keeps from walls (m)."""
MIN_HEIGHT = 0.5
"""Robots that are lower count as this high (m)."""


def look_from_behind(viewer: Viewer, robot: Robot, client: Any = None) -> None:
    """Place the cameras of all pages behind and above the robot; pages opened later start there too.

    Pages that are narrower than high look from farther away, so that the robot is as wide as they are. With
    a `viser.ClientHandle` only the camera of that page moves.
    """
    eye, target = clear_viewpoint(robot)
    radius = 0.5 * float(np.linalg.norm(np.ptp(robot.body.bounds, axis=0)))
    distance = float(np.linalg.norm(eye - target))

    def view_of(aspect: float) -> tuple[Array, Array]:
        needed = radius / (math.tan(0.5 * FOVY) * min(aspect, 1.0) * FILL)
        return target + max(needed / distance, 1.0) * (eye - target), target

    viewer.first_view.aim_with(view_of, client)


def clear_viewpoint(robot: Robot) -> tuple[Array, Array]:
    """Return position and target of a camera, each (3,) m, from which nothing hides the robot.

    It is in the robot's room where a view from there is free, behind and above the robot if possible, else
    nearer or at another angle; otherwise it looks over a wall. Where no view is free, it is behind and above.
    """
    position, quaternion = robot.base_link.pose
    forward = matrix_from_quaternion(quaternion)[:, 0]
    behind = math.atan2(float(forward[1]), float(forward[0])) + math.pi
    lower, upper = robot.body.bounds
    height = max(float(upper[2] - lower[2]), MIN_HEIGHT)
    target = np.array([position[0], position[1], lower[2] + 0.5 * height])
    points = [np.array([position[0], position[1], lower[2] + share * height]) for share in SEEN]
    for is_inside in (True, False):
        for elevation, distance, turn in itertools.product(ELEVATIONS, DISTANCES, TURNS):
            eye = target + distance * height * _direction(behind + math.radians(turn), elevation)
            wall_free = not is_inside or _is_free(robot, target, np.array([eye[0], eye[1], target[2]]))
            if wall_free and all(_is_free(robot, point, eye) for point in points):
                return eye, target
    return target + DISTANCES[0] * height * _direction(behind, ELEVATIONS[-1]), target


def seen_heights(robot: Robot) -> list[float]:
    """Return the heights above the base link (m) of the points of a robot that walls must not hide."""
    lower, upper = robot.body.bounds[:, 2]
    height = max(float(upper - lower), MIN_HEIGHT)
    return [float(lower) + share * height - float(robot.base_link.pose[0][2]) for share in SHOWN_THROUGH]


def _direction(azimuth: float, elevation: float) -> Array:
    rise = math.radians(elevation)
    return np.array([math.cos(azimuth) * math.cos(rise), math.sin(azimuth) * math.cos(rise), math.sin(rise)])


def _is_free(robot: Robot, start: Array, eye: Array) -> bool:
    """Whether nothing but the robot itself is between a point and a little beyond the eye, each (3,) m."""
    length = float(np.linalg.norm(eye - start))
    direction = (eye - start) / length
    at = 0.0
    while True:
        hit = rays.cast_one(robot.world, start + at * direction, eye + MARGIN * direction, visual=True)
        if hit is None:
            return True
        if hit.link.body is not robot.body:
            return False
        at += hit.distance + 1e-3
