"""What a camera returns: colour, depth and ids of one moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roboyard.rendering.camera import Camera
from roboyard.rendering.png import encode_png


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Image:
    """Colour, depth and ids, pixel by pixel, row 0 at the top."""

    rgba: NDArray[np.uint8]
    """(height, width, 4)"""
    depth: NDArray[np.float32]
    """(height, width) distance along the camera's axis (m) of the nearest surface; inf where there is none
    between the near and the far plane."""
    segmentation: NDArray[np.int32]
    """(height, width, 2) body id and link index of the nearest surface, -1 for the background."""
    camera: Camera

    @property
    def rgb(self) -> NDArray[np.uint8]:
        """(height, width, 3) view of `rgba`."""
        return self.rgba[..., :3]

    @property
    def width(self) -> int:
        """Pixels"""
        return self.camera.width

    @property
    def height(self) -> int:
        """Pixels"""
        return self.camera.height

    def depth_buffer(self) -> NDArray[np.float32]:
        """(height, width) non-linear OpenGL depth, 0 at the near plane, 1 at the far plane and for misses."""
        return self.camera.depth_to_buffer(self.depth)

    def points(self) -> NDArray[np.float64]:
        """(height, width, 3) world points (m) seen by each pixel; NaN where there is nothing."""
        return self.camera.deproject(self.depth)

    def _repr_png_(self) -> bytes:
        return encode_png(self.rgba)


def depth_buffer(image: Image) -> NDArray[np.float32]:
    """(height, width) non-linear OpenGL depth buffer in [0, 1] of an image; 1 for misses."""
    return image.depth_buffer()
