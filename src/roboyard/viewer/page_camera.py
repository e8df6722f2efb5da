"""The camera of the pages: where the last one that someone moved is, and a way to move them all."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAME = 1e-4
"""m: a page that was told to look from somewhere and answers within this has not been moved"""


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
            with client.atomic():
                client.camera.up_direction = view.up
                client.camera.position = view.eye
                client.camera.look_at = view.target

    async def _on_connect(self, client: Any) -> None:
        camera = client.camera
        self.size = (int(camera.image_width), int(camera.image_height))
        camera.on_update(self._on_update)

    async def _on_disconnect(self, _: Any) -> None:
        if not self._server.get_clients():
            self.size = None

    async def _on_update(self, camera: Any) -> None:
        # a coroutine runs in the event loop, in order
        width, height = int(camera.image_width), int(camera.image_height)
        view = View(
            eye=np.array(camera.position, dtype=float),
            target=np.array(camera.look_at, dtype=float),
            up=np.array(camera.up_direction, dtype=float),
            width=width,
            height=height,
        )
        if not all(np.isfinite(part).all() for part in (view.eye, view.target, view.up)):
            return
        if 0 < width < 1 << 15 and 0 < height < 1 << 15:
            self.size = (width, height)
        before = self.moved or self._aimed
        if before is not None and not _is_elsewhere(view, before):
            return
        self.moved = view


def _is_elsewhere(view: View, before: View) -> bool:
    way = max(np.abs(view.eye - before.eye).max(), np.abs(view.target - before.target).max())
    return bool(way > SAME * max(1.0, math.dist(before.eye, before.target)))
