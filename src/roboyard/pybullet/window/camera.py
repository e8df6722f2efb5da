"""Synchronisation of the visualizer's camera with the cameras of the pages."""

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
    """Moves the pages' cameras when a script moves the visualizer's, and vice versa."""

    def __init__(self, server: Any, options: WindowOptions, camera: VisualizerCamera) -> None:
        """Connect the pages of a server to a camera."""
        self._pages = PageCamera(server, radians(FIELD_OF_VIEW))
        self._size = (options.width, options.height)
        self._known: Any = None
        self.push(camera)

    def push(self, camera: VisualizerCamera) -> None:
        """Move the pages' cameras, if the script moved the visualizer's."""
        where = _place(camera)
        if where != self._known:
            self._known = where
            self._pages.aim(view_of(camera))
        self._pages.insist()

    def pull(self, camera: VisualizerCamera) -> None:
        """Move the visualizer's camera, if a page's camera moved after the script's last change."""
        camera.width, camera.height = self._pages.size or self._size
        view = self._pages.take_moved() if _place(camera) == self._known else None
        if view is None:
            return
        put(camera, view)
        self._known = _place(camera)


def _place(camera: VisualizerCamera) -> tuple[Any, ...]:
    return (camera.distance, camera.yaw, camera.pitch, camera.target, camera.up_axis)


def view_of(camera: VisualizerCamera) -> View:
    """Return eye, target (m) and up vector; the pitch is limited to ±89.9°, which pages require."""
    pitch = float(np.clip(camera.pitch, -89.9, 89.9))
    eye, _ = orbit(camera.target, camera.distance, camera.yaw, pitch, 0.0, camera.up_axis)
    up = (0.0, 1.0, 0.0) if camera.up_axis == 1 else (0.0, 0.0, 1.0)
    return View(eye=np.array(eye), target=np.array(camera.target, dtype=float), up=np.array(up))


def put(camera: VisualizerCamera, view: View) -> None:
    """Set distance, yaw, pitch and target from a page's camera."""
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
