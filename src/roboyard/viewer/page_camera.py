"""The camera of the pages: where the last one that someone moved is, and a way to move them all."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAME = 1e-4
"""m: a page that was told to look from somewhere and answers within this has not been moved"""
PATIENCE = 1.0
"""s: what a page says so soon after it was told to look from elsewhere may have been on its way before"""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class View:
    """Where a camera is and what it looks at."""

    eye: Array
    """(3,) m"""
    target: Array
    """(3,) m"""
    up: Array
    """(3,) unit"""
    width: int = 0
    """pixels; 0: not known"""
    height: int = 0


class PageCamera:
    """Reads and moves the cameras of all pages of a server."""

    def __init__(self, server: Any, fovy: float) -> None:
        """All pages of `server`, those that open later too, get a vertical opening angle `fovy`; rad."""
        self._server = server
        self._aimed: View | None = None
        self._fovy = fovy
        self._told: dict[int, tuple[View, float]] = {}
        """Client to where it was told to look from and when; until it answers."""
        self._opening: set[int] = set()
        """Clients whose first words come once more: viser hands them to whoever asks when a page opens."""
        self.moved: View | None = None
        """Where someone moved a page's camera since `aim`; None: nobody did."""
        self.size: tuple[int, int] | None = None
        """Width and height of the page that was looked at last; pixels. None: no page is open."""
        server.initial_camera.fov = fovy
        server.on_client_connect(self._on_connect)
        server.on_client_disconnect(self._on_disconnect)

    def aim(self, view: View) -> None:
        """Move the cameras of all pages."""
        self._aimed, self.moved = view, None
        first = self._server.initial_camera
        first.position, first.look_at, first.up = view.eye, view.target, view.up
        for client in self._server.get_clients().values():
            self._tell(client, view)

    def _tell(self, client: Any, view: View) -> None:
        self._told[client.client_id] = (view, time.monotonic())
        with client.atomic():
            client.camera.up_direction = view.up
            client.camera.position = view.eye
            client.camera.look_at = view.target

    async def _on_connect(self, client: Any) -> None:
        view = _view_of(client.camera)
        self.size = (view.width, view.height)
        if self._aimed is not None and _is_sane(view) and _is_elsewhere(view, self._aimed):
            # the others were moved while it was opening: it knows where to look from no longer
            self._tell(client, self._aimed)
            self._opening.add(client.client_id)
        client.camera.on_update(self._on_update)

    async def _on_disconnect(self, client: Any) -> None:
        self._told.pop(client.client_id, None)
        self._opening.discard(client.client_id)
        if not self._server.get_clients():
            self.size = None

    async def _on_update(self, camera: Any) -> None:
        # a coroutine runs in the event loop, in order
        view = _view_of(camera)
        if not _is_sane(view):
            return
        if 0 < view.width < 1 << 15 and 0 < view.height < 1 << 15:
            self.size = (view.width, view.height)
        if self._is_late(camera.client.client_id, view):
            return
        before = self.moved or self._aimed
        if before is not None and not _is_elsewhere(view, before):
            return
        self.moved = view

    def _is_late(self, client: int, view: View) -> bool:
        """Whether a page said this before it heard what it was told."""
        if client in self._opening:
            self._opening.discard(client)
            return True
        told, when = self._told.get(client, (view, 0.0))
        if _is_elsewhere(view, told) and time.monotonic() < when + PATIENCE:
            return True
        self._told.pop(client, None)
        return False


def _view_of(camera: Any) -> View:
    """Where a page looks from."""
    return View(
        eye=np.array(camera.position, dtype=float),
        target=np.array(camera.look_at, dtype=float),
        up=np.array(camera.up_direction, dtype=float),
        width=int(camera.image_width),
        height=int(camera.image_height),
    )


def _is_sane(view: View) -> bool:
    """Whether all numbers are finite; pages say what they like."""
    return all(bool(np.isfinite(part).all()) for part in (view.eye, view.target, view.up))


def _is_elsewhere(view: View, before: View) -> bool:
    way = max(np.abs(view.eye - before.eye).max(), np.abs(view.target - before.target).max())
    return bool(way > SAME * max(1.0, math.dist(before.eye, before.target)))
