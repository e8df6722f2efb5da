"""Previews of a script's camera images in the page's panel."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.state.visualizer_camera import VisualizerCamera
from roboyard.pybullet.window.switches import is_on

PERIOD = 0.1
"""Time between two updates of the panel (s)."""
LONGEST = 320
"""Longest side of a preview (pixels)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CameraImages:
    """The last images of getCameraImage."""

    rgba: NDArray[np.uint8]
    """(h, w, 4) colours."""
    depth: NDArray[np.float32]
    """(h, w) depth buffer (0 to 1)."""
    ids: NDArray[np.int32]
    """(h, w) segmentation ids."""


class Previews:
    """Colours, depth and ids of the last images, each while its flag is on."""

    def __init__(self, server: Any) -> None:
        """Add previews to the panel of a server."""
        self._gui = server.gui
        self._images: dict[int, Any] = {}
        self._taken: CameraImages | None = None
        self._shown: tuple[Any, ...] = ()
        self._due = 0.0

    def store(self, rgba: NDArray[np.uint8], depth: NDArray[np.float32], ids: NDArray[np.int32]) -> None:
        """Store the images of a script, which must not be changed.

        Args:
            rgba: (h, w, 4) colours.
            depth: (h, w) depth buffer (0 to 1).
            ids: (h, w) segmentation ids.
        """
        self._taken = CameraImages(rgba=rgba, depth=depth, ids=ids)

    def show(self, camera: VisualizerCamera) -> None:
        """Update the panel; call it in the viewer's thread."""
        taken = self._taken
        if taken is None or perf_counter() < self._due:
            return
        wanted = tuple(flag for flag in _LABELS if is_on(camera, flag))
        if (taken, wanted) == self._shown:
            return
        self._due = perf_counter() + PERIOD
        self._shown = (taken, wanted)
        for flag, label in _LABELS.items():
            if flag not in wanted:
                if flag in self._images:
                    self._images.pop(flag).remove()
                continue
            picture = _picture(flag, taken)
            if flag in self._images:
                self._images[flag].image = picture
            else:
                self._images[flag] = self._gui.add_image(picture, label=label, format="jpeg")


_LABELS = {
    c.COV_ENABLE_RGB_BUFFER_PREVIEW: "camera",
    c.COV_ENABLE_DEPTH_BUFFER_PREVIEW: "depth",
    c.COV_ENABLE_SEGMENTATION_MARK_PREVIEW: "segmentation",
}


def _picture(flag: int, taken: CameraImages) -> NDArray[np.uint8]:
    """Return (h, w, 3) colours of every n-th pixel."""
    skip = -(-max(taken.ids.shape) // LONGEST)
    if flag == c.COV_ENABLE_RGB_BUFFER_PREVIEW:
        return np.ascontiguousarray(taken.rgba[::skip, ::skip, :3])
    if flag == c.COV_ENABLE_DEPTH_BUFFER_PREVIEW:
        depth = taken.depth[::skip, ::skip]
        low, high = float(depth.min()), float(depth.max())
        grey = np.round(255.0 * (depth - low) / max(high - low, 1e-9)).astype(np.uint8)
        return np.repeat(grey[..., None], 3, axis=2)
    from roboyard.rendering.files import segmentation_to_rgb

    return segmentation_to_rgb(taken.ids[::skip, ::skip])
