"""Open the files that a mesh file names: material libraries and images."""

from __future__ import annotations

import io
import logging
import re
from collections import OrderedDict
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from roboyard.shapes.mesh import shared

if TYPE_CHECKING:
    from PIL.Image import Image

MAX_PIXELS = 128 * 1024 * 1024
MAX_SIDE = 4096
"""Larger images are reduced to this."""
RECENT_BYTES = 128 * 1024 * 1024
"""Of decoded images that are kept: the meshes of one scene often share theirs."""
_recent: OrderedDict[tuple[Path, int, int], NDArray[np.uint8] | None] = OrderedDict()
_recent_lock = Lock()
_MESH_FOLDER = re.compile(
    r"(\w+_)?(mesh(es)?|visuals?|collisions?|assets?|geometry|geometries|materials?|textures?|media|stl|obj|dae)",
    re.IGNORECASE,
)
_IMAGES = ("PNG", "JPEG", "BMP", "TGA", "GIF", "TIFF", "WEBP", "PPM", "DDS")
_log = logging.getLogger(__name__)


def find_external_file(mesh_file: Path, name: str) -> Path | None:
    """The file that a mesh names, if it lies in the mesh's own folders; else None, and the log says why.

    The mesh's folders are its own and, as long as they are called as mesh folders are (`meshes/visual/`),
    the one above. Symbolic links are resolved before the check.
    """
    text = unquote(name.strip().removeprefix("file://")).replace("\\", "/")
    if not text or "\0" in text:
        return None
    root = mesh_file.absolute().parent
    for _ in range(3):
        if root.parent == root or not _MESH_FOLDER.fullmatch(root.name):
            break
        root = root.parent
    # as written, and by its bare name: exporters leave the paths of the machine that they ran on
    for candidate in (mesh_file.parent / text, mesh_file.parent / text.rpartition("/")[2]):
        try:
            if candidate.is_file() and candidate.resolve().is_relative_to(root.resolve()):
                return candidate
        except (OSError, ValueError):
            continue
    _log.info("%s: %r was not found in the mesh's folders; left out", mesh_file.name, name)
    return None


def pixels(image: Image) -> NDArray[np.uint8]:
    """(h, w, 4) RGBA of a Pillow image, reduced to at most 4096 pixels a side; read-only."""
    image.draft("RGB", (MAX_SIDE, MAX_SIDE))
    rgba = image.convert("RGBA")
    rgba.thumbnail((MAX_SIDE, MAX_SIDE))
    return shared(np.asarray(rgba, dtype=np.uint8), np.uint8)


def load_image(mesh_file: Path, name: str) -> NDArray[np.uint8] | None:
    """(h, w, 4) RGBA pixels of an image that a mesh names; None, logged, where there is none to read."""
    file = find_external_file(mesh_file, name)
    return None if file is None else load_image_file(file, f"{mesh_file.name}: {file.name}")


def load_image_file(file: Path, what: str) -> NDArray[np.uint8] | None:
    """(h, w, 4) RGBA pixels of an image file, read once while it is in use; None, logged, if unreadable.

    Args:
        file: there is one.
        what: it is called in the log.
    """
    status = file.stat()
    key = (file.resolve(), status.st_mtime_ns, status.st_size)
    with _recent_lock:
        if key in _recent:
            _recent.move_to_end(key)
            return _recent[key]
    image = decode_image(file.read_bytes(), what)
    with _recent_lock:
        _recent[key] = image
        while sum(kept.nbytes for kept in _recent.values() if kept is not None) > RECENT_BYTES:
            _recent.popitem(last=False)
    return image


def forget_images() -> None:
    """Decode images anew from now on."""
    with _recent_lock:
        _recent.clear()


def decode_image(data: bytes, who: str) -> NDArray[np.uint8] | None:
    """(h, w, 4) RGBA pixels of an image file's bytes; None, logged, where they are no image."""
    from PIL.Image import open as open_image

    try:
        with open_image(io.BytesIO(data), formats=_IMAGES) as image:
            if image.width * image.height > MAX_PIXELS:
                _log.info("%s: %d x %d pixels are too many; left out", who, image.width, image.height)
                return None
            return pixels(image)
    except Exception as error:  # Pillow raises many kinds for broken files
        _log.info("%s: not a readable image (%s); left out", who, error)
        return None
