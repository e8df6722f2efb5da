"""Encode pixels as PNG."""

from __future__ import annotations

import io

import numpy as np

from roboyard._arrays import NDArray


def encode_png(pixels: NDArray[np.uint8], *, colors: int | None = None) -> bytes:
    """Encode (h, w, 3) or (h, w, 4) pixels as PNG.

    Args:
        pixels: RGB or RGBA; an alpha channel that is opaque everywhere is dropped.
        colors: size of the palette (2 to 256), which makes the file a third as large and drops alpha;
            None keeps all colours.
    """
    from PIL import Image as Pillow

    if pixels.shape[-1] == 4 and (colors is not None or pixels[..., 3].min() == 255):
        pixels = pixels[..., :3]
    drawn = Pillow.fromarray(np.ascontiguousarray(pixels))
    if colors is not None:
        drawn = drawn.quantize(colors, method=Pillow.Quantize.FASTOCTREE, dither=Pillow.Dither.NONE)
    buffer = io.BytesIO()
    # Pillow's `optimize` takes three times as long for one file in a hundred less
    drawn.save(buffer, "PNG", compress_level=6)
    return buffer.getvalue()
