"""Cameras of the pages: read the one that a user moved last, and move all of them."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from roboyard._arrays import NDArray

Array = NDArray[np.float64]

SAME = 1e-4
"""Largest distance between a requested and a reported view that counts as equal (m, per m of distance)."""
PATIENCE, TRIES = 0.5, 6
"""Period (s) and largest number of repetitions of a request that a page does not confirm: a page that is
still opening may lose messages."""
NUDGE = 1e-2
"""Distance of an intermediate position (m): viser sends no message for an unchanged value."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class View:
    """Position and direction of a camera, and the size of its picture."""

    eye: Array
    """(3,) position in the world frame (m)."""
    target: Array
    """(3,) point in the world frame at the centre of the picture (m)."""
    up: Array
    """(3,) unit vector in the world frame that points up in the picture."""
    width: int = 0
    """Width (pixels); 0: unknown."""
    height: int = 0
    """Height (pixels); 0: unknown."""


class PageCamera:
    """Reads and moves the cameras of all pages of a server."""

    def __init__(self, server: Any, fovy: float) -> None:
        """Set the vertical opening angle `fovy` (rad) of all pages, including pages opened later."""
        self._server = server
        self._aimed: View | None = None
        self._fovy = fovy
        self._requested: dict[int, _ViewRequest] = {}
        """Client number to the view requested from its page, until the page confirms it."""
        self.moved: View | None = None
        """Last view set by a user in any page since `aim`; None: unchanged."""
        self._lock = threading.Lock()
        """Held while views change: a script moves the cameras while pages report their own."""
        self.size: tuple[int, int] | None = None
        """Width and height of the page updated last (pixels); None: no page is open."""
        server.initial_camera.fov = fovy
        server.on_client_connect(self._on_connect)
        server.on_client_disconnect(self._on_disconnect)

    def aim(self, view: View) -> None:
        """Move the cameras of all pages."""
        with self._lock:
            self._aimed, self.moved = view, None
            first = self._server.initial_camera
            first.position, first.look_at, first.up = view.eye, view.target, view.up
            moved = {
                number: client
                for number, client in self._server.get_clients().items()
                if number in self._requested or _is_elsewhere(_view_of(client.camera), view)
            }
            for number in moved:
                self._requested[number] = _ViewRequest(view=view, when=time.monotonic())
        for client in moved.values():
            _send_view(client, view)

    def take_moved(self) -> View | None:
        """Return `moved`, once."""
        with self._lock:
            moved, self.moved = self.moved, None
        return moved

    def insist(self) -> None:
        """Repeat unconfirmed requests; call it a few times per second."""
        clients, now = self._server.get_clients() if self._requested else {}, time.monotonic()
        for number, request in tuple(self._requested.items()):
            if now < request.when + PATIENCE:
                continue
            if number not in clients or request.tries == TRIES:
                self._requested.pop(number, None)
                continue
            request.when, request.tries = now, request.tries + 1
            _send_view(clients[number], request.view)

    async def _on_connect(self, client: Any) -> None:
        camera = client.camera
        self.size = (int(camera.image_width), int(camera.image_height))
        with self._lock:
            if self._aimed is not None:
                # the page may have opened while the others were moved; `insist` repeats the request
                self._requested[client.client_id] = _ViewRequest(view=self._aimed, when=time.monotonic())
        camera.on_update(self._on_update)

    async def _on_disconnect(self, client: Any) -> None:
        self._requested.pop(client.client_id, None)
        if not self._server.get_clients():
            self.size = None

    async def _on_update(self, camera: Any) -> None:
        # a coroutine runs in the event loop, in order
        view = _view_of(camera)
        if not _is_sane(view):
            return
        if 0 < view.width < 1 << 15 and 0 < view.height < 1 << 15:
            self.size = (view.width, view.height)
        with self._lock:
            request = self._requested.get(camera.client.client_id)
            if request is not None:
                if not _is_elsewhere(view, request.view):
                    self._requested.pop(camera.client.client_id, None)
                return
            before = self.moved or self._aimed
            if before is not None and not _is_elsewhere(view, before):
                return
            self.moved = view


@dataclass(kw_only=True, slots=True)
class _ViewRequest:
    """A view requested from one page."""

    view: View
    when: float
    """Time of the last message on the monotonic clock (s)."""
    tries: int = 0
    """Repetitions so far."""


def _send_view(client: Any, view: View) -> None:
    camera = client.camera
    with client.atomic():
        camera.up_direction = view.up
        camera.position = view.eye + NUDGE
        camera.position = view.eye
        camera.look_at = view.target + NUDGE
        camera.look_at = view.target


def _view_of(camera: Any) -> View:
    """Return the view of a page's camera."""
    return View(
        eye=np.array(camera.position, dtype=float),
        target=np.array(camera.look_at, dtype=float),
        up=np.array(camera.up_direction, dtype=float),
        width=int(camera.image_width),
        height=int(camera.image_height),
    )


def _is_sane(view: View) -> bool:
    """Return whether all numbers are finite; pages are untrusted."""
    return all(bool(np.isfinite(part).all()) for part in (view.eye, view.target, view.up))


def _is_elsewhere(view: View, before: View) -> bool:
    way = max(np.abs(view.eye - before.eye).max(), np.abs(view.target - before.target).max())
    return bool(way > SAME * max(1.0, math.dist(before.eye, before.target)))
