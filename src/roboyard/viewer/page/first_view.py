"""The first picture of a page: all bodies in the frame, for the size that the page has."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from roboyard.rendering import Camera, fitted_viewpoint
from roboyard.sim.queries.default_view import FILL, FOVY, VIEW_FROM
from roboyard.transforms import Array

ASPECT = 1.5
"""Ratio of width to height that is assumed until a page is open."""
SAME = 0.02
"""Largest motion that leaves a camera where it was aimed, and largest change of the ratio of width to height
that leaves its distance (m per m of distance; fraction)."""
SMALL = 0.3
"""Share of the frame below which bodies count as too small after one was added or removed."""

ViewOf = Callable[[float], tuple[Array, Array]]
"""Ratio of width to height to the position and target of a camera, each (3,) in the world frame (m)."""


class FirstView:
    """Aims the camera of each page when it opens, and again when the page's shape changes.

    A camera that a user or a script moved stays where it is. `release` leaves all cameras to others.
    """

    def __init__(self, server: Any, points: Callable[[], Array]) -> None:
        """Aim the pages of a `viser.ViserServer` at points.

        Args:
            server: the server.
            points: returns (n, 3) points in the world frame (m); called from the simulation thread only.
        """
        self._server, self._find_points = server, points
        self._points = points()
        self._view_of: ViewOf = self._fitted
        self._is_fitted = True
        self._released = False
        self._aimed: dict[int, tuple[Array, Array, float]] = {}
        """Client to the position, target and ratio of width to height of its last aimed view."""
        self._before: dict[int, tuple[Array, Array, float]] = {}
        """Client to the aimed view before that one, at first the view with which the page opened."""
        self._lock = threading.RLock()
        server.initial_camera.fov = FOVY
        server.initial_camera.position, server.initial_camera.look_at = self.viewpoint(ASPECT)
        server.on_client_connect(self._on_connect)
        server.on_client_disconnect(self._on_disconnect)

    def viewpoint(self, aspect: float) -> tuple[Array, Array]:
        """Return position and target, each (3,) m, for a page of this ratio of width to height."""
        return self._view_of(aspect)

    def _fitted(self, aspect: float) -> tuple[Array, Array]:
        return fitted_viewpoint(self._points, VIEW_FROM, aspect=aspect, fovy=FOVY, fill=FILL)

    def aim(self, points: Array | None = None) -> None:
        """Fit the bodies as they are now into all pages; call it from the simulation thread.

        Args:
            points: (n, 3) points in the world frame (m) to fit instead.
        """
        self._points = points if points is not None and len(points) else self._find_points()
        self._is_fitted = True
        self._aim_all(self._fitted)

    def aim_with(self, view_of: ViewOf, client: Any = None) -> None:
        """Aim all pages, and those opened later, with another function of the page's shape.

        With a `viser.ClientHandle` only that page moves now.
        """
        self._is_fitted = False
        if client is None:
            self._aim_all(view_of)
        else:
            self._view_of = view_of
            self.home(client)

    def home(self, client: Any, points: Array | None = None) -> None:
        """Move the camera of one page back to the first view, also where the cameras were left to others.

        Args:
            client: the page's `viser.ClientHandle`.
            points: (n, 3) points in the world frame (m) to fit, where the first view fits points; by default
                those of the last fit.
        """
        with self._lock:
            if points is not None and len(points) and self._is_fitted:
                self._points = points
            aspect = _aspect(client) or ASPECT
            eye, target = self.viewpoint(aspect)
            with client.atomic():
                client.camera.up_direction = (0.0, 0.0, 1.0)
                client.camera.position, client.camera.look_at = eye, target
            self._aimed[client.client_id] = eye, target, aspect

    def _aim_all(self, view_of: ViewOf) -> None:
        if self._released:
            return
        self._view_of = view_of
        camera = self._server.initial_camera
        camera.position, camera.look_at = self.viewpoint(ASPECT)
        for client in self._server.get_clients().values():
            self._send(client)

    def refit(self) -> None:
        """Fit changed bodies into pages whose camera was not moved; call it from the simulation thread.

        Pages that show all bodies, and not too small, stay as they are.
        """
        if self._released or not self._is_fitted:
            return
        self._points = self._find_points()
        camera = self._server.initial_camera
        camera.position, camera.look_at = self.viewpoint(ASPECT)
        for client in self._server.get_clients().values():
            aimed = self._aimed.get(client.client_id)
            if aimed is not None and _is_at(client, aimed) and not self._shows_all(*aimed):
                self._send(client)

    def release(self) -> None:
        """Leave the cameras of pages to others from now on."""
        with self._lock:
            self._released = True

    async def _on_connect(self, client: Any) -> None:
        first = self._server.initial_camera  # with which a page begins
        self._before[client.client_id] = np.array(first.position), np.array(first.look_at), ASPECT
        self._send(client)

        @client.camera.on_update
        async def _(_: Any) -> None:
            self._on_camera(client)

    async def _on_disconnect(self, client: Any) -> None:
        self._aimed.pop(client.client_id, None)
        self._before.pop(client.client_id, None)

    def _on_camera(self, client: Any) -> None:
        """Fit again after the page's shape changed, unless its camera was moved.

        A page that is still opening may lose a view: it is sent again while the page reports the one before.
        """
        aspect, aimed = _aspect(client), self._aimed.get(client.client_id)
        if aspect is None:
            return
        if aimed is None:
            self._send(client)
        elif self._is_where_aimed(client):
            if abs(aspect / aimed[2] - 1.0) > SAME:
                self._send(client)
        elif _is_at(client, self._before.get(client.client_id)):
            self._send(client)

    def _is_where_aimed(self, client: Any) -> bool:
        return _is_at(client, self._aimed.get(client.client_id))

    def _shows_all(self, eye: Array, target: Array, aspect: float) -> bool:
        """Return whether all points are in the frame of a page that is aimed so, and not too small."""
        camera = Camera.look_at(eye, target, width=round(1000 * aspect), height=1000, fovy=FOVY)
        points = self._points
        clip = np.c_[points, np.ones(len(points))] @ (camera.projection @ camera.view).T
        if (clip[:, 3] <= 0.0).any():
            return False
        share = float(np.abs(clip[:, :2] / clip[:, 3:]).max())
        return SMALL < share < 1.0

    def _send(self, client: Any) -> None:
        camera, aspect = client.camera, _aspect(client)
        if aspect is None:
            return
        with self._lock:
            if self._released:
                return
            eye, target = self.viewpoint(aspect)
            now, number = (eye, target, aspect), client.client_id
            last = self._aimed.get(number)
            if last is not None and not (np.array_equal(last[0], eye) and np.array_equal(last[1], target)):
                self._before[number] = last
            self._aimed[number] = now
            with client.atomic():
                camera.position, camera.look_at = eye, target


def _is_at(client: Any, view: tuple[Array, Array, float] | None) -> bool:
    """Return whether a page's camera has an aimed view."""
    if view is None:
        return False
    eye, target, _ = view
    way = max(np.abs(client.camera.position - eye).max(), np.abs(client.camera.look_at - target).max())
    return bool(way <= SAME * float(np.linalg.norm(eye - target)))


def _aspect(client: Any) -> float | None:
    """Return a page's ratio of width to height; None: the page has no size yet, or a senseless one."""
    width, height = float(client.camera.image_width), float(client.camera.image_height)
    if not (np.isfinite([width, height]).all() and width > 0 and height > 0):
        return None
    return float(np.clip(width / height, 0.05, 20.0))
