"""Write pictures to PNG and GIF files; convert depth and segmentation to colours."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from roboyard._arrays import ArrayLike, NDArray
from roboyard.rendering.image import Image
from roboyard.rendering.png import encode_png

Picture = Image | NDArray[np.uint8]


def save_png(path: str | Path, picture: Picture) -> Path:
    """Write an image, or an (h, w), (h, w, 3) or (h, w, 4) uint8 array, as PNG; returns the path."""
    target = Path(path)
    target.write_bytes(png_bytes(picture))
    return target


def png_bytes(picture: Picture, *, colors: int | None = None) -> bytes:
    """Encode a picture as PNG; a palette of `colors` (2 to 256) makes it a third as large and drops alpha."""
    return encode_png(_pixels(picture), colors=colors)


def save_gif(
    path: str | Path, frames: Iterable[Picture], *, fps: float = 20.0, colors: int = 256, loop: bool = True
) -> Path:
    """Write an animation with one palette for all its frames; returns the path.

    GIF stores durations in hundredths of a second: they alternate so that the animation plays at `fps` on
    average. `fps` is at most 50 Hz, the highest rate that viewers play. Raises ValueError for an animation
    without frames, frames of different sizes, and `fps` or `colors` out of range.
    """
    from PIL import Image as Pillow

    pictures = [Pillow.fromarray(np.ascontiguousarray(_pixels(frame)[..., :3])) for frame in frames]
    if not pictures:
        raise ValueError(f"an animation needs at least one frame, got {len(pictures)}")
    sizes = {picture.size for picture in pictures}
    if len(sizes) > 1:
        raise ValueError(
            f"the frames of an animation must all have the same size, got (width, height) {sorted(sizes)}"
        )
    if not 0 < fps <= 50 or not 2 <= colors <= 256:
        raise ValueError(f"fps must be in (0, 50] and colors in [2, 256], got {fps} and {colors}")
    palette = _common_palette(pictures, colors)
    indexed = [picture.quantize(palette=palette, dither=Pillow.Dither.NONE) for picture in pictures]
    ends = [round(100.0 * (k + 1) / fps) for k in range(len(indexed))]
    durations = [10 * (b - a) for a, b in zip([0, *ends[:-1]], ends, strict=True)]
    target = Path(path)
    options: dict[str, int] = {"loop": 0} if loop else {}
    indexed[0].save(
        target, "GIF", save_all=True, append_images=indexed[1:], duration=durations, optimize=True,
        disposal=1, **options,
    )  # fmt: skip
    return target


def side_by_side(*pictures: Picture, gap: int = 4) -> NDArray[np.uint8]:
    """Return pictures of one height side by side on white, `gap` pixels apart; (h, w, 3) uint8."""
    return contact_sheet(pictures, columns=len(pictures), gap=gap)


def contact_sheet(
    pictures: Sequence[Picture], *, columns: int | None = None, gap: int = 4
) -> NDArray[np.uint8]:
    """Return pictures in rows on white, `gap` pixels apart, as (h, w, 3) uint8.

    `columns` pictures form a row; None: about as many as there are rows. Raises ValueError without pictures,
    for `columns` below 1 and for a negative `gap`.
    """
    tiles = [_pixels(picture)[..., :3] for picture in pictures]
    if not tiles:
        raise ValueError(f"a contact sheet needs at least one picture, got {len(tiles)}")
    across = columns or math.ceil(math.sqrt(len(tiles)))
    if across < 1 or gap < 0:
        raise ValueError(f"columns must be at least 1 and gap at least 0, got {columns} and {gap}")
    h, w = (max(tile.shape[k] for tile in tiles) for k in range(2))
    down = math.ceil(len(tiles) / across)
    sheet = np.full((down * (h + gap) - gap, across * (w + gap) - gap, 3), 255, dtype=np.uint8)
    for k, tile in enumerate(tiles):
        top, left = (k // across) * (h + gap), (k % across) * (w + gap)
        sheet[top : top + tile.shape[0], left : left + tile.shape[1]] = tile
    return sheet


def depth_to_rgb(
    depth: ArrayLike | Image, *, near: float | None = None, far: float | None = None
) -> NDArray[np.uint8]:
    """Return an (h, w, 3) uint8 picture of (h, w) depths (m): yellow near, dark blue far, white no surface.

    The colours span the depths of the picture unless `near` and `far` (m) are given.
    """
    d = np.asarray(depth.depth if isinstance(depth, Image) else depth, dtype=float)
    there = np.isfinite(d)
    low = near if near is not None else (float(d[there].min()) if there.any() else 0.0)
    high = far if far is not None else (float(d[there].max()) if there.any() else 1.0)
    # linear in inverse depth: a floor up to the horizon would otherwise use most colours
    low, high = max(low, 1e-6), max(high, 1e-6)
    span = max(1.0 / low - 1.0 / high, 1e-12)
    share = np.clip((1.0 / low - 1.0 / np.maximum(np.where(there, d, high), 1e-6)) / span, 0.0, 1.0)
    stops = np.array(
        [(253, 231, 76), (244, 132, 64), (190, 55, 100), (96, 36, 122), (24, 22, 72)], dtype=float
    )
    at = np.linspace(0.0, 1.0, len(stops))
    out = np.stack([np.interp(share, at, stops[:, k]) for k in range(3)], axis=-1)
    out[~there] = 255.0
    return np.round(out).astype(np.uint8)


def segmentation_to_rgb(segmentation: ArrayLike | Image) -> NDArray[np.uint8]:
    """Return an (h, w, 3) uint8 picture with a fixed colour for each body and link; white is the background.

    `segmentation` is an image, (h, w, 2) body ids and link indices, or (h, w) body ids; -1: background.
    """
    ids = np.asarray(
        segmentation.segmentation if isinstance(segmentation, Image) else segmentation, dtype=np.int64
    )
    if ids.ndim == 2:
        ids = np.stack([ids, np.zeros_like(ids)], axis=-1)
    body, link = ids[..., 0], ids[..., 1] + 1
    golden = 0.61803398875
    # bodies spread over the circle of hues; links step through nearby hues and three tones
    hue = np.mod(golden * body + 0.11 * np.mod(golden * link, 1.0) + 0.58, 1.0)[..., None]
    tone = (0.62 + 0.19 * np.mod(link, 3))[..., None]
    wheel = np.clip(np.abs(np.mod(6.0 * hue + (0.0, 4.0, 2.0), 6.0) - 3.0) - 1.0, 0.0, 1.0)
    out = tone * (0.35 + 0.65 * wheel)
    out[body < 0] = 1.0
    return np.round(255.0 * out).astype(np.uint8)


def _pixels(picture: Picture) -> NDArray[np.uint8]:
    pixels = picture.rgba if isinstance(picture, Image) else np.asarray(picture)
    if pixels.dtype != np.uint8:
        raise ValueError(
            f"a picture must be uint8, got {pixels.dtype}; see depth_to_rgb, segmentation_to_rgb"
        )
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[..., None], 3, axis=2)
    if pixels.ndim != 3 or pixels.shape[2] not in (3, 4):
        raise ValueError(f"a picture must have shape (h, w), (h, w, 3) or (h, w, 4), got {pixels.shape}")
    return pixels


def _common_palette(pictures: Sequence, colors: int):
    """Palette of a few frames spread over the animation, shrunk so that a long one costs little."""
    from PIL import Image as Pillow

    chosen = [pictures[k] for k in sorted({round(t) for t in np.linspace(0, len(pictures) - 1, 12)})]
    w, h = chosen[0].size
    step = max(1, round(math.sqrt(w * h / 40000)))
    small = [np.asarray(picture)[::step, ::step] for picture in chosen]
    return Pillow.fromarray(np.concatenate(small)).quantize(colors, method=Pillow.Quantize.MEDIANCUT)
