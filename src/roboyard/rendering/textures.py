"""Textures with their mipmap levels, packed into one flat array."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard._arrays import NDArray
from roboyard.native import compiled

LEVELS = 14
"""Mipmap levels of a texture, the full image included."""


@compiled("u1[:,::1] i8 i8 i8 i8", releases_gil=True)
def halve(texels, start, width, height, target):  # pragma: no cover
    """Write the image of half the size behind an image, each pixel the mean of four.

    texels: (n, 4), with the image from `start` and the smaller one from `target` on. The smaller one has at
    least one row and column; an odd last row or column of the image is dropped.
    """
    right, below = min(1, width - 1), width * min(1, height - 1)
    for row in range(max(height // 2, 1)):
        for column in range(max(width // 2, 1)):
            first = start + 2 * row * width + 2 * column
            for k in range(4):
                upper = int(texels[first, k]) + int(texels[first + right, k])
                lower = int(texels[first + below, k]) + int(texels[first + below + right, k])
                texels[target, k] = (upper + lower + 2) >> 2
            target += 1


def pack(images: Sequence[NDArray[np.uint8]]) -> tuple[NDArray[np.uint32], NDArray[np.int32]]:
    """Pack textures and their mipmap levels into one array.

    Returns (texels,) RGBA with red in the low byte, and (textures, LEVELS, 3) offset, width and height of
    each level. Levels after the last one (1 x 1) repeat it.
    """
    table = np.zeros((max(len(images), 1), LEVELS, 3), dtype=np.int32)
    offset = 0
    for index, image in enumerate(images):
        height, width = image.shape[:2]
        for k in range(LEVELS):
            if k and max(height, width) == 1:
                table[index, k] = table[index, k - 1]
                continue
            if k:
                height, width = max(height // 2, 1), max(width // 2, 1)
            table[index, k] = offset, width, height
            offset += width * height
    flat = np.empty((max(offset, 1), 4), dtype=np.uint8)
    flat[offset:] = 0
    for index, image in enumerate(images):
        levels = table[index].tolist()
        at, width, height = levels[0]
        flat[at : at + width * height] = image.reshape(-1, 4)
        for place in levels[1:]:
            if place[0] == at:
                break
            halve(flat, at, width, height, place[0])
            at, width, height = place
    return flat.view("<u4").ravel().astype(np.uint32, copy=False), table


def as_rgba(image: NDArray) -> NDArray[np.uint8]:
    """Return (h, w, 4) uint8 RGBA of an (h, w), (h, w, 3) or (h, w, 4) uint8 image; else raise ValueError."""
    a = np.asarray(image, dtype=np.uint8)
    if a.ndim == 2:
        a = np.repeat(a[..., None], 3, axis=2)
    if a.ndim != 3 or a.shape[2] not in (3, 4) or 0 in a.shape:
        raise ValueError(f"a texture must have shape (h, w, 3) or (h, w, 4), got {a.shape}")
    if a.shape[2] == 3:
        a = np.concatenate([a, np.full((*a.shape[:2], 1), 255, dtype=np.uint8)], axis=2)
    return a


def lets_light_through(image: NDArray[np.uint8], uv: NDArray[np.floating]) -> bool:
    """Return whether faces with (m, 3, 2) texture coordinates show transparent texels of an RGBA texture.

    Samples 28 points of each face: palettes often contain transparent corners that no face uses.
    """
    if image[..., 3].min() == 255:
        return False
    height, width = image.shape[:2]
    steps = np.array([(i, j, 6 - i - j) for i in range(7) for j in range(7 - i)]) / 6.0
    for weights in steps:
        at = np.einsum("k,mkc->mc", weights, uv) % 1.0
        column = np.minimum((at[:, 0] * width).astype(int), width - 1)
        row = np.minimum(((1.0 - at[:, 1]) * height).astype(int), height - 1)
        if (image[row, column, 3] < 255).any():
            return True
    return False
