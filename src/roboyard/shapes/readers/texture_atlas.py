"""Pack several images into one, since a `TriangleMesh` has one texture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import dataclass

_BLANK = 4


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Places:
    """Positions of the images in the packed image."""

    width: int
    height: int
    rectangles: tuple[tuple[int, int, int, int], ...]
    """Left, top, width and height of each image (pixels)."""
    blank: tuple[float, float]
    """(u, v) of a white pixel."""

    def map(self, number: int, uv: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) coordinates in image `number`, clipped to it, as coordinates in the packed image."""
        left, top, width, height = self.rectangles[number]
        u = left + 0.5 + np.clip(uv[:, 0], 0.0, 1.0) * (width - 1)
        v = top + 0.5 + (1.0 - np.clip(uv[:, 1], 0.0, 1.0)) * (height - 1)
        return np.stack([u / self.width, 1.0 - v / self.height], axis=1)


def pack_textures(images: Sequence[NDArray[np.uint8]]) -> tuple[NDArray[np.uint8], Places]:
    """Return the (h, w, 4) RGBA images one below the other, with a white spot beneath them."""
    width = max(_BLANK, *(image.shape[1] for image in images))
    height = sum(image.shape[0] for image in images) + _BLANK
    packed = np.full((height, width, 4), 255, dtype=np.uint8)
    rectangles: list[tuple[int, int, int, int]] = []
    top = 0
    for image in images:
        rows, columns = image.shape[:2]
        packed[top : top + rows, :columns] = image
        rectangles.append((0, top, columns, rows))
        top += rows
    blank = (_BLANK / 2 / width, 1.0 - (top + _BLANK / 2) / height)
    return packed, Places(width=width, height=height, rectangles=tuple(rectangles), blank=blank)
