"""Pictures by `roboyard.rendering` from the page's camera."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.rendering import Camera, Image
from roboyard.viewer.page.callbacks import of_pages

if TYPE_CHECKING:
    from roboyard.sim import World

WIDTH, HEIGHT = 320, 240
"""Size of a picture (pixels)."""
KINDS = ("colour", "depth", "segmentation")


class CameraPanel:
    """A button that renders the view of the page where it is pressed."""

    def __init__(self, gui: Any, world: World, do: Callable[[Callable[[], None]], None]) -> None:
        self._world = world
        self.kind = gui.add_dropdown("shows", KINDS, initial_value=KINDS[0])
        button = gui.add_button("Take a picture from here", hint="rendered by roboyard.rendering")
        self.picture = gui.add_image(blank(), format="jpeg")

        def taken(event: Any) -> None:
            place = event.client.camera
            camera = camera_of(place.position, place.look_at, place.up_direction, place.fov)
            do(lambda: self.take(camera))

        button.on_click(of_pages(taken))

    def take(self, camera: Camera) -> None:
        """Show the picture of a camera; call it from the simulation thread."""
        self.picture.image = shown_as(self._world.render(camera), str(self.kind.value))


def shown_as(image: Image, kind: str) -> NDArray[np.uint8]:
    """Return an image as (h, w, 3) uint8; `kind` is one of `KINDS`."""
    from roboyard.rendering import depth_to_rgb, segmentation_to_rgb

    if kind == "depth":
        shown = depth_to_rgb(image.depth)
    elif kind == "segmentation":
        shown = segmentation_to_rgb(image.segmentation)
    else:
        shown = image.rgb
    return np.ascontiguousarray(shown[..., :3])


def blank() -> NDArray[np.uint8]:
    """Return an empty picture, (HEIGHT, WIDTH, 3) uint8."""
    return np.full((HEIGHT, WIDTH, 3), 235, dtype=np.uint8)


def camera_of(position: Any, look_at: Any, up: Any, fovy: float) -> Camera:
    """Return the page's camera as a `Camera`; positions in the world frame (m), `fovy` in rad."""
    return Camera.look_at(
        position, look_at, up, width=WIDTH, height=HEIGHT, fovy=float(np.clip(fovy, 0.05, math.pi - 0.1))
    )
