"""Decoded images kept on disk, so that a program that starts again need not decode them, nor import Pillow.

A file holds height and width, a checksum and the pixels; one that is cut or changed counts as absent. Without
a place to write, nothing is kept.
"""

from __future__ import annotations

import struct
from contextlib import suppress
from pathlib import Path
from zlib import crc32

import numpy as np

from roboyard._arrays import NDArray
from roboyard._bootstrap import private_content, user_cache
from roboyard._bytecode import write_for_the_user
from roboyard._digests import blake2b
from roboyard.shapes.mesh import shared

_HEADER = struct.Struct("<8sIII")
_FORMAT = b"ryimage1"
"""First bytes of a file; another number for another way to decode images."""
FEWEST_PIXELS = 64 * 64
"""Smaller images are decoded faster than a file is read."""
MOST_PIXELS = 2048 * 2048
"""Larger images are not kept."""
MOST_BYTES = 256 * 2**20
"""Size of all images that are kept."""


def image_key(data: bytes) -> str:
    """Return the name of an image file's content."""
    return str(blake2b(data, digest_size=16).hexdigest())


def stored_image(key: str) -> NDArray[np.uint8] | None:
    """Return the read-only (h, w, 4) RGBA of a content; None where it is not kept."""
    try:
        content = private_content(str(_path(key)))
    except (OSError, ValueError):
        return None
    if len(content) < _HEADER.size:
        return None
    form, height, width, checksum = _HEADER.unpack_from(content)
    if form != _FORMAT or len(content) != _HEADER.size + 4 * height * width:
        return None
    if crc32(memoryview(content)[_HEADER.size :]) != checksum:
        return None
    pixels = np.frombuffer(content, np.uint8, offset=_HEADER.size)
    return shared(pixels.reshape(height, width, 4), np.uint8)


def store_image(key: str, image: NDArray[np.uint8]) -> None:
    """Keep an (h, w, 4) RGBA image, where there is a place and it has neither few nor many pixels."""
    height, width = image.shape[:2]
    if not FEWEST_PIXELS <= height * width <= MOST_PIXELS:
        return
    path, held = _path(key), 0
    with suppress(OSError):
        held = sum(file.stat().st_size for file in path.parent.iterdir())
    if held + image.nbytes > MOST_BYTES:
        return
    pixels = np.ascontiguousarray(image).data
    header = _HEADER.pack(_FORMAT, height, width, crc32(pixels))
    write_for_the_user(str(path), [header, pixels])


def _path(key: str) -> Path:
    return Path(user_cache()) / "images" / key
