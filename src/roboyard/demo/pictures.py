"""The demo's pictures: a film of the story and four views of the robot at rest."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from roboyard.demo.demo_world import DemoWorld
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.rendering import Camera, Image

FOVY = math.radians(30.0)
MARGIN = 0.90
"""Part of the picture that the robot may fill."""
VIEWS: dict[str, tuple[float, float]] = {
    "front": (0.0, 10.0),
    "side": (90.0, 10.0),
    "top": (0.0, 90.0),
    "three_quarter": (38.0, 24.0),
}
"""Direction of the camera as azimuth (from +x towards +y) and elevation, in degrees; robots look along +x."""
FILM_VIEW = "three_quarter"
SUN = (0.9, -0.2, 1.2)
"""Towards the sun: from the front, so that the sides the pictures show are lit."""
FPS = 12.5
FAR = 60.0
"""The far plane's distance over that of what is looked at."""


def fitted_camera(points: Array, view: str, width: int, height: int) -> Camera:
    """The nearest camera of a view that has all (k, 3) points well inside its picture."""
    from roboyard.rendering import Camera

    azimuth, elevation = (math.radians(angle) for angle in VIEWS[view])
    backward = np.array(
        [
            math.cos(elevation) * math.cos(azimuth),
            math.cos(elevation) * math.sin(azimuth),
            math.sin(elevation),
        ]
    )
    up = np.array([1.0, 0.0, 0.0]) if elevation > 1.5 else np.array([0.0, 0.0, 1.0])
    right = np.cross(up, backward)
    right /= np.linalg.norm(right)
    above = np.cross(backward, right)
    turned = points @ np.column_stack([right, above, backward])
    middle = 0.5 * (turned.min(axis=0) + turned.max(axis=0))
    centre = middle @ np.stack([right, above, backward])
    x, y, z = (turned - middle).T
    half_height = MARGIN * math.tan(0.5 * FOVY)
    half_width = half_height * width / height
    distance = float(max((np.abs(x) / half_width + z).max(), (np.abs(y) / half_height + z).max(), 1e-3))
    return Camera.look_at(
        centre + distance * backward,
        centre,
        up,
        width=width,
        height=height,
        fovy=FOVY,
        near=0.02 * distance,
        far=FAR * distance,
    )


def picture(stage: DemoWorld, camera: Camera) -> Image:
    """One picture of the stage, the floor fading out with distance."""
    from roboyard.rendering import Backdrop, Light

    distance = camera.far / FAR
    backdrop = Backdrop(fade=(1.5 * distance, 9.0 * distance))
    light = Light(direction=SUN)
    return stage.world.render(camera, shadow=True, light=light, background=backdrop, samples=4)


def still_views(stage: DemoWorld, width: int, height: int) -> dict[str, Image]:
    """View name to a picture of the robot and the obstacle as they are now."""
    points = np.concatenate([stage.robot_points(), _corners(stage.obstacle.bounds)])
    shadows = points * (1.0, 1.0, 0.0)
    return {
        view: picture(stage, fitted_camera(np.concatenate([points, shadows]), view, width, height))
        for view in VIEWS
    }


def _corners(box: Array) -> Array:
    """(8, 3) of a (2, 3) box."""
    return np.array([[box[i, 0], box[j, 1], box[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


class DemoVideo:
    """Takes a frame whenever one is due; the camera goes along with a robot that drives."""

    def __init__(self, stage: DemoWorld, *, width: int, height: int, frames: int, seconds: float) -> None:
        self.stage = stage
        self.size = (width, height)
        self.interval = max(1.0 / FPS, seconds / frames)
        """Simulated s between frames."""
        self.frames: list[np.ndarray] = []
        self._due = 0.0
        self._points = film_points(stage)
        self._start = stage.robot.position[:2].copy()

    @property
    def speed(self) -> float:
        """How much faster than real time the film runs."""
        return self.interval * FPS

    def tick(self) -> None:
        """Take a frame if it is time."""
        if self.stage.world.time < self._due:
            return
        self._due += self.interval
        points = self._points
        robot = self.stage.robot
        if not robot.is_fixed:
            points = points + np.array([*(robot.position[:2] - self._start), 0.0])
        camera = fitted_camera(points, FILM_VIEW, *self.size)
        self.frames.append(picture(self.stage, camera).rgba[..., :3].copy())


def film_points(stage: DemoWorld) -> Array:
    """(k, 3) points around everywhere the robot gets, on the floor and on its stand, and the obstacle."""
    plan = stage.plan
    base = -plan.stance.lowest
    heights = {"standing": [base], "mounted": [base + plan.stand], "held": [base, base + plan.stand]}
    places = [plan.reach + np.array([0.0, 0.0, height]) for height in heights[plan.stance.kind]]
    return np.concatenate([*places, _corners(stage.obstacle.bounds), np.zeros((1, 3))])
