"""The first picture of a page: all bodies in the frame, for the size that the page has."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from roboyard.rendering import fitted_viewpoint
from roboyard.sim.queries.default_view import FILL, FOVY, VIEW_FROM
from roboyard.transforms import Array

ASPECT = 1.5
"""Ratio of width to height that is assumed until a page is open."""


class FirstView:
    """Aims the camera of each page when it opens, until `release` leaves the camera to others."""

    def __init__(self, server: Any, points: Callable[[], Array]) -> None:
        """Aim the pages of a `viser.ViserServer` at points.

        Args:
            server: the server.
            points: returns (n, 3) points in the world frame (m); called from the simulation thread only.
        """
        self._server, self._find_points = server, points
        self._points = points()
        self._released = False
        self._lock = threading.Lock()
        server.initial_camera.fov = FOVY
        camera = server.initial_camera
        camera.position, camera.look_at = self.viewpoint(ASPECT)
        server.on_client_connect(self._on_connect)

    def viewpoint(self, aspect: float) -> tuple[Array, Array]:
        """Return position and target, each (3,) m, for a page of this ratio of width to height."""
        return fitted_viewpoint(self._points, VIEW_FROM, aspect=aspect, fovy=FOVY, fill=FILL)

    def aim(self) -> None:
        """Fit the bodies as they are now into all pages; call it from the simulation thread."""
        self._points = self._find_points()
        camera = self._server.initial_camera
        camera.position, camera.look_at = self.viewpoint(ASPECT)
        for client in self._server.get_clients().values():
            self._send(client)

    def release(self) -> None:
        """Leave the cameras of pages to others from now on."""
        with self._lock:
            self._released = True

    async def _on_connect(self, client: Any) -> None:
        self._send(client)

    def _send(self, client: Any) -> None:
        camera = client.camera
        width, height = float(camera.image_width), float(camera.image_height)
        if not (np.isfinite([width, height]).all() and width > 0 and height > 0):
            return
        with self._lock:
            if self._released:
                return
            eye, target = self.viewpoint(width / height)
            with client.atomic():
                camera.position, camera.look_at = eye, target
