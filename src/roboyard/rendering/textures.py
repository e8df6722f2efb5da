"""Textures with their mipmap levels, packed into one flat array."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard._arrays import NDArray

LEVELS = 14
"""Mipmap levels of a texture, the full image included."""


def halved(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return an (h, w, c) image at half size, each pixel the mean of four.

    The result is (max(h // 2, 1), max(w // 2, 1), c); an odd last row or column is dropped.
    """
    h, w = max(image.shape[0] // 2, 1), max(image.shape[1] // 2, 1)
    below, beside = min(1, image.shape[0] - 1), min(1, image.shape[1] - 1)
    columns = w + beside * w
    rows = np.add(
        image[: 2 * h : 2, :columns], image[below : below + 2 * h - 1 : 2, :columns], dtype=np.uint16
    )
    if image.shape[2] == 4 and beside:  # four sums of 16 bits in a word: none of them overflows
        words = rows.reshape(h, columns * 4).view(np.uint64)
        total = words[:, ::2] + words[:, 1::2]
        total += np.uint64(0x0002_0002_0002_0002)
        total >>= np.uint64(2)
        return total.view(np.uint16).astype(np.uint8).reshape(h, w, 4)
    pairs = rows[:, : columns : 1 + beside] + rows[:, beside : columns : 1 + beside]
    pairs += 2
    pairs >>= 2
    return pairs.astype(np.uint8)


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
    flat = np.zeros((max(offset, 1), 4), dtype=np.uint8)
    for index, image in enumerate(images):
        level = image
        for k, (at, width, height) in enumerate(table[index]):
            if k:
                if at == table[index, k - 1, 0]:
                    break
                level = halved(level)
            flat[at : at + width * height] = level.reshape(-1, 4)
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
