"""The visualizer's camera and those of the pages, each following the other."""

from __future__ import annotations

from math import asin, atan2, degrees, radians
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.api.math.camera_matrices import orbit
from roboyard.pybullet.state.visualizer_camera import FIELD_OF_VIEW, VisualizerCamera
from roboyard.viewer.page.page_camera import PageCamera, View

if TYPE_CHECKING:
    from roboyard.pybullet.window.options import WindowOptions


class WindowCamera:
    """Moves the pages' cameras when a script moves the visualizer's, and the other way round."""

    def __init__(self, server: Any, options: WindowOptions, camera: VisualizerCamera) -> None:
        self._pages = PageCamera(server, radians(FIELD_OF_VIEW))
        self._size = (options.width, options.height)
        self._known: Any = None
        self.push(camera)

    def push(self, camera: VisualizerCamera) -> None:
        """Aim the pages where the script moved the camera, if it did."""
        where = _place(camera)
        if where != self._known:
            self._known = where
            self._pages.aim(view_of(camera))
        self._pages.insist()

    def pull(self, camera: VisualizerCamera) -> None:
        """Put the visualizer's camera where someone moved a page's, if one did since the script did."""
        camera.width, camera.height = self._pages.size or self._size
        view = self._pages.moved
        if view is None or _place(camera) != self._known:
            return
        self._pages.moved = None
        put(camera, view)
        self._known = _place(camera)


def _place(camera: VisualizerCamera) -> tuple[Any, ...]:
    return (camera.distance, camera.yaw, camera.pitch, camera.target, camera.up_axis)


def view_of(camera: VisualizerCamera) -> View:
    """Eye and target of the visualizer's camera; straight up and down are off by a hair, as pages want."""
    pitch = float(np.clip(camera.pitch, -89.9, 89.9))
    eye, _ = orbit(camera.target, camera.distance, camera.yaw, pitch, 0.0, camera.up_axis)
    up = (0.0, 1.0, 0.0) if camera.up_axis == 1 else (0.0, 0.0, 1.0)
    return View(eye=np.array(eye), target=np.array(camera.target, dtype=float), up=np.array(up))


def put(camera: VisualizerCamera, view: View) -> None:
    """Distance, yaw, pitch and target of a page's camera."""
    way = view.target - view.eye
    distance = float(np.linalg.norm(way))
    if not distance > 0:
        return
    x, y, z = (way / distance).tolist()
    if camera.up_axis == 1:
        pitch, yaw = asin(max(-1.0, min(1.0, y))), atan2(x, z)
    else:
        pitch, yaw = asin(max(-1.0, min(1.0, z))), atan2(-x, y)
    camera.distance, camera.yaw, camera.pitch = distance, degrees(yaw), degrees(pitch)
    tx, ty, tz = view.target.tolist()
    camera.target = (tx, ty, tz)
