"""Pictures that a script takes, in the page's panel: what its cameras see."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboyard.pybullet.face import constants as c
from roboyard.pybullet.state.visualizer_camera import VisualizerCamera
from roboyard.pybullet.window.switches import is_on

PERIOD = 0.1
"""s between two pictures in the panel"""
LONGEST = 320
"""pixels along a preview's longer side"""


@dataclass(frozen=True, kw_only=True, slots=True)
class Taken:
    """The last picture of getCameraImage."""

    rgba: NDArray[np.uint8]
    """(h, w, 4)"""
    depth: NDArray[np.float32]
    """(h, w) 0 to 1"""
    ids: NDArray[np.int32]
    """(h, w)"""


class Previews:
    """Colours, depth and ids of the last picture, each while its flag is on."""

    def __init__(self, server: Any) -> None:
        self._gui = server.gui
        self._images: dict[int, Any] = {}
        self._taken: Taken | None = None
        self._shown: tuple[Any, ...] = ()
        self._due = 0.0

    def take(self, rgba: NDArray[np.uint8], depth: NDArray[np.float32], ids: NDArray[np.int32]) -> None:
        """A script took a picture; the arrays are not to be written to."""
        self._taken = Taken(rgba=rgba, depth=depth, ids=ids)

    def show(self, camera: VisualizerCamera) -> None:
        """Bring the panel up to date; use it from the viewer's own thread."""
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


def _picture(flag: int, taken: Taken) -> NDArray[np.uint8]:
    """(h, w, 3) of every n-th pixel."""
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
