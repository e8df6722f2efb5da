"""The demo's pictures: a video of the motion and four views of the robot at rest."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from roboyard.demo.demo_world import DemoWorld
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.rendering import Camera, Image

VIEWS: dict[str, tuple[float, float]] = {
    "front": (0.0, 10.0),
    "side": (90.0, 10.0),
    "top": (0.0, 90.0),
    "three_quarter": (38.0, 24.0),
}
"""Direction from robot to camera: azimuth (from +x to +y) and elevation (degrees); robots face +x."""
VIDEO_VIEW = "three_quarter"
SUN = (0.9, -0.2, 1.2)
"""Direction to the sun: from the front, so that the visible sides are lit."""
FPS = 12.5
"""Pictures a second of the video."""


def view_camera(points: Array, view: str, width: int, height: int) -> Camera:
    """Return the nearest camera of a view that has all (k, 3) points (m) well inside its picture."""
    from roboyard.rendering import Camera

    azimuth, elevation = (math.radians(angle) for angle in VIEWS[view])
    direction = (
        math.cos(elevation) * math.cos(azimuth),
        math.cos(elevation) * math.sin(azimuth),
        math.sin(elevation),
    )
    up = (1.0, 0.0, 0.0) if elevation > 1.5 else (0.0, 0.0, 1.0)
    return Camera.fitted(points, direction, up, width=width, height=height)


def render_scene(scene: DemoWorld, camera: Camera) -> Image:
    """Return a picture of the world by a camera of `view_camera`; the floor fades out with distance."""
    from roboyard.rendering import Backdrop, Light
    from roboyard.rendering.camera import FITTED_FAR

    distance = camera.far / FITTED_FAR
    backdrop = Backdrop(fade=(1.5 * distance, 9.0 * distance))
    return scene.world.render(camera, shadow=True, light=Light(direction=SUN), background=backdrop, samples=4)


def still_views(scene: DemoWorld, width: int, height: int) -> dict[str, Image]:
    """Return view name to a picture of the robot and the obstacle in their present state."""
    points = np.concatenate([scene.robot_points(), _corners(scene.obstacle.bounds)])
    shadows = points * (1.0, 1.0, 0.0)
    return {
        view: render_scene(scene, view_camera(np.concatenate([points, shadows]), view, width, height))
        for view in VIEWS
    }


class DemoVideo:
    """The video of the motion; its camera follows a robot that drives."""

    def __init__(
        self, path: Path, scene: DemoWorld, *, size: tuple[int, int], frames: int, seconds: float
    ) -> None:
        """Begin a video.

        Args:
            path: the .gif file to write.
            scene: the world to show.
            size: width and height of its pictures (pixels).
            frames: number of pictures, about.
            seconds: expected simulated time (s), which sets the time between two pictures.
        """
        from roboyard.recording.video import VideoWriter

        self.scene = scene
        self.size = size
        self.interval = max(1.0 / FPS, seconds / frames)
        """Simulated time between two pictures (s)."""
        self._writer = VideoWriter(path, fps=FPS)
        self._due = 0.0
        self._points = _reachable_points(scene)
        self._start = scene.robot.position[:2].copy()

    @property
    def count(self) -> int:
        """Number of pictures so far."""
        return self._writer.count

    @property
    def speed(self) -> float:
        """Simulated time per time of the video."""
        return self.interval * FPS

    def tick(self) -> None:
        """Add a picture if one is due."""
        if self.scene.world.time < self._due:
            return
        self._due += self.interval
        points = self._points
        robot = self.scene.robot
        if not robot.is_fixed:
            points = points + np.array([*(robot.position[:2] - self._start), 0.0])
        self._writer.add(render_scene(self.scene, view_camera(points, VIDEO_VIEW, *self.size)))

    def close(self) -> None:
        """Write the file."""
        self._writer.close()


def _reachable_points(scene: DemoWorld) -> Array:
    """Return (k, 3) points (m) around all that the robot reaches in the demo, and around the obstacle."""
    plan = scene.plan
    base = -plan.support.lowest
    heights = {"free": [base], "mounted": [base + plan.stand], "supported": [base, base + plan.stand]}
    places = [plan.reach + np.array([0.0, 0.0, height]) for height in heights[plan.support.kind]]
    return np.concatenate([*places, _corners(scene.obstacle.bounds), np.zeros((1, 3))])


def _corners(box: Array) -> Array:
    """Return the (8, 3) corners of a (2, 3) box."""
    return np.array([[box[i, 0], box[j, 1], box[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
