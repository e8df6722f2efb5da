"""`Image`: colour, depth and segmentation of one rendered picture."""

from __future__ import annotations

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import dataclass
from roboyard.rendering.camera import Camera
from roboyard.rendering.png import encode_png


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Image:
    """Colour, depth and segmentation of each pixel, row 0 at the top."""

    rgba: NDArray[np.uint8]
    """(height, width, 4) RGBA."""
    depth: NDArray[np.float32]
    """(height, width) distance of the nearest surface along the camera's axis (m); inf where there is no
    surface between the near and the far plane."""
    segmentation: NDArray[np.int32]
    """(height, width, 2) body id and link index of the nearest surface, -1 for the background."""
    camera: Camera
    """The camera that took the picture."""

    @property
    def rgb(self) -> NDArray[np.uint8]:
        """(height, width, 3) view of `rgba`."""
        return self.rgba[..., :3]

    @property
    def width(self) -> int:
        """Width (pixels)."""
        return self.camera.width

    @property
    def height(self) -> int:
        """Height (pixels)."""
        return self.camera.height

    def depth_buffer(self) -> NDArray[np.float32]:
        """Return the (height, width) OpenGL depth buffer, 0 (near) to 1 (far and misses)."""
        return self.camera.depth_to_buffer(self.depth)

    def points(self) -> NDArray[np.float64]:
        """Return (height, width, 3) world points (m) of the pixels' surfaces; NaN where there is none."""
        return self.camera.deproject(self.depth)

    def _repr_png_(self) -> bytes:
        return encode_png(self.rgba)


def depth_buffer(image: Image) -> NDArray[np.float32]:
    """Return the (height, width) OpenGL depth buffer of an image, 0 (near) to 1 (far and misses)."""
    return image.depth_buffer()
