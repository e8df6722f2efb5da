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
PATIENCE, TRIES = 0.5, 6
"""s between tellings, and how often a page is told where to look from that does not answer: one that is just
opening may lose a part of what it is told"""
NUDGE = 1e-2
"""m: viser sends a camera nothing that it believes it has; so far away it is put for no moment"""


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
        self._told: dict[int, _Told] = {}
        """By client, until it answers."""
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
        for number, client in self._server.get_clients().items():
            if number in self._told or _is_elsewhere(_view_of(client.camera), view):
                self._told[number] = _Told(view=view, when=time.monotonic())
                _tell(client, view)

    def insist(self) -> None:
        """Tell pages once more that were told where to look from and did not answer; call it now and then."""
        clients, now = self._server.get_clients() if self._told else {}, time.monotonic()
        for number, told in tuple(self._told.items()):
            if now < told.when + PATIENCE:
                continue
            if number not in clients or told.tries == TRIES:
                self._told.pop(number, None)
                continue
            told.when, told.tries = now, told.tries + 1
            _tell(clients[number], told.view)

    async def _on_connect(self, client: Any) -> None:
        camera = client.camera
        self.size = (int(camera.image_width), int(camera.image_height))
        if self._aimed is not None:
            # it may have been opening while the others were moved; its first words come again below
            self._told[client.client_id] = _Told(view=self._aimed, when=time.monotonic())
        camera.on_update(self._on_update)

    async def _on_disconnect(self, client: Any) -> None:
        self._told.pop(client.client_id, None)
        if not self._server.get_clients():
            self.size = None

    async def _on_update(self, camera: Any) -> None:
        # a coroutine runs in the event loop, in order
        view = _view_of(camera)
        if not _is_sane(view):
            return
        if 0 < view.width < 1 << 15 and 0 < view.height < 1 << 15:
            self.size = (view.width, view.height)
        told = self._told.get(camera.client.client_id)
        if told is not None:
            if not _is_elsewhere(view, told.view):
                self._told.pop(camera.client.client_id, None)
            return
        before = self.moved or self._aimed
        if before is not None and not _is_elsewhere(view, before):
            return
        self.moved = view


@dataclass(kw_only=True, slots=True)
class _Told:
    """What one page was told."""

    view: View
    when: float
    """s, of the monotonic clock"""
    tries: int = 0


def _tell(client: Any, view: View) -> None:
    camera = client.camera
    with client.atomic():
        camera.up_direction = view.up
        camera.position = view.eye + NUDGE
        camera.position = view.eye
        camera.look_at = view.target + NUDGE
        camera.look_at = view.target


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
