"""Pictures in a terminal: two pixels for each character, in 24-bit colours."""

from __future__ import annotations

import numpy as np

from roboyard._arrays import NDArray


def as_text(rgb: NDArray[np.uint8], width: int | None = None) -> str:
    """Return a picture as lines of half-block characters; an odd last row is omitted.

    Args:
        rgb: (h, w, 3) colours.
        width: width of the lines (characters); the picture is resized to it. By default w.
    """
    if width is not None and width != rgb.shape[1]:
        rgb = _resized(rgb, width, max(2, round(rgb.shape[0] * width / rgb.shape[1])))
    lines = []
    for upper, lower in zip(rgb[0:-1:2], rgb[1::2], strict=False):
        cells = [
            f"\x1b[38;2;{a[0]};{a[1]};{a[2]}m\x1b[48;2;{b[0]};{b[1]};{b[2]}m▀"
            for a, b in zip(upper.tolist(), lower.tolist(), strict=True)
        ]
        lines.append("".join(cells) + "\x1b[0m")
    return "\n".join(lines)


def _resized(rgb: NDArray[np.uint8], width: int, height: int) -> NDArray[np.uint8]:
    from PIL import Image

    return np.asarray(Image.fromarray(rgb).resize((width, height), Image.Resampling.BOX))
