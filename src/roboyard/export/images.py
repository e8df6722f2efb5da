"""Images of materials and meshes, encoded once however many files show them."""

from __future__ import annotations

import hashlib
import io
from collections import OrderedDict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from roboyard.description.model import Material
from roboyard.shapes.readers.external_files import load_image_file

CACHE_BYTES = 64 * 1024 * 1024
"""PNG files kept in memory, the least recently used leave first."""
_COMPRESSION = 1
"""Of 0 to 9; a larger level takes five times as long for a tenth of the size."""

_encoded: OrderedDict[str, bytes] = OrderedDict()


@dataclass(kw_only=True, eq=False)
class ImageCache:
    """Content digests of images, worked out once for each array."""

    known: dict[int, tuple[np.ndarray, str]] = field(default_factory=dict)
    """Array by identity (kept alive here) with its digest."""

    def of(self, pixels: np.ndarray) -> str:
        """Return the digest of an image's size and its (h, w, c) pixels."""
        found = self.known.get(id(pixels))
        if found is None:
            digest = hashlib.blake2b(repr(pixels.shape).encode(), digest_size=8)
            digest.update(np.ascontiguousarray(pixels).data)
            found = self.known[id(pixels)] = (pixels, digest.hexdigest())
        return found[1]


def material_pixels(material: Material) -> np.ndarray | None:
    """(h, w, 4) image of a material; None where it has none that can be read."""
    if material.texture is None or not material.texture.is_file():
        return None
    return load_image_file(material.texture, material.texture.name)


def write_png(pixels: np.ndarray, digest: str, path: Path, *, alpha: bool = True) -> None:
    """Write an (h, w, 4) image as PNG; without transparency where it has none, or none is wanted."""
    path.parent.mkdir(parents=True, exist_ok=True)
    keep = alpha and bool((pixels[..., 3] < 255).any())
    key = f"{digest}{keep}"
    if key not in _encoded:
        from PIL import Image

        buffer = io.BytesIO()
        shown = pixels if keep else pixels[..., :3]
        image = Image.fromarray(np.ascontiguousarray(shown))
        image.save(buffer, "PNG", compress_level=_COMPRESSION)
        _encoded[key] = buffer.getvalue()
        while len(_encoded) > 1 and sum(map(len, _encoded.values())) > CACHE_BYTES:
            _encoded.popitem(last=False)
    _encoded.move_to_end(key)
    path.write_bytes(_encoded[key])
