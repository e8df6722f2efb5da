"""Open external files of a mesh: material libraries and images."""

from __future__ import annotations

import io
import re
import warnings
from _thread import _local, allocate_lock
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from roboyard._arrays import NDArray
from roboyard._lazy import LazyLogger, lazy_pattern
from roboyard.shapes.mesh import shared
from roboyard.shapes.readers.image_store import image_key, store_image, stored_image
from roboyard.untrusted.files import is_inside, read_file
from roboyard.untrusted.percent_codes import unquoted

if TYPE_CHECKING:
    from PIL.Image import Image

MAX_PIXELS = 64 * 1024 * 1024
"""Most pixels of an image file."""
MAX_IMAGE_BYTES = 256 * 1024 * 1024
"""Largest image file (bytes)."""
MAX_SIDE = 4096
"""Longest side of a decoded image (pixels); larger images are reduced."""
RECENT_BYTES = 128 * 1024 * 1024
"""Size of the cache of decoded images (bytes): the meshes of one scene often share theirs."""
_recent: OrderedDict[tuple[Path, int, int], NDArray[np.uint8] | None] = OrderedDict()
_recent_lock = allocate_lock()
MESH_FOLDER = lazy_pattern(
    r"(\w+_)?(mesh(es)?|visuals?|collisions?|assets?|geometry|geometries|materials?|textures?|media|stl|obj|dae)",
    re.IGNORECASE,
)
"""Name of a folder in which a robot's meshes or their images are, as vendors call it."""
_OBJECT_FOLDER = lazy_pattern(r"models?", re.IGNORECASE)
"""Name of a folder with the mesh of one object, beside which its images are, as in collections of objects."""
_IMAGES = ("PNG", "JPEG", "BMP", "TGA", "GIF", "TIFF", "WEBP", "PPM", "DDS")
_log = LazyLogger(__name__)
_asked = _local()


@contextmanager
def external_names() -> Iterator[list[tuple[Path, str]]]:
    """Collect what `find_external_file` is asked for in this thread: the mesh's file and the name."""
    asked: list[tuple[Path, str]] = []
    before = getattr(_asked, "names", None)
    _asked.names = asked
    try:
        yield asked
    finally:
        _asked.names = before


def find_external_file(mesh_file: Path, name: str) -> Path | None:
    """Return the path of an external file inside the mesh's folders; None, logged, if there is none.

    The mesh's folders are its own and, while their names are those of mesh folders (`meshes/visual/`) or of
    an object's (`models/`), the parent folders. Symbolic links are resolved before the check.
    """
    asked = getattr(_asked, "names", None)
    if asked is not None:
        asked.append((mesh_file, name))
    text = unquoted(name.strip().removeprefix("file://")).replace("\\", "/")
    if not text or "\0" in text:
        return None
    root = mesh_file.absolute().parent
    for _ in range(3):
        if root.parent == root or not (
            MESH_FOLDER.fullmatch(root.name) or _OBJECT_FOLDER.fullmatch(root.name)
        ):
            break
        root = root.parent
    # as written, and by its file name: exporters write absolute paths of their own machine
    for candidate in (mesh_file.parent / text, mesh_file.parent / text.rpartition("/")[2]):
        try:
            if candidate.is_file() and is_inside(candidate, (root,)):
                return candidate
        except (OSError, ValueError):
            continue
    _log.info("%s: %r was not found in the mesh's folders; skipped", mesh_file.name, name)
    return None


def pixels(image: Image) -> NDArray[np.uint8]:
    """Return read-only (h, w, 4) RGBA of a Pillow image, reduced to at most 4096 pixels per side."""
    image.draft("RGB", (MAX_SIDE, MAX_SIDE))
    if max(image.size) > MAX_SIDE and image.mode in ("RGB", "L"):  # before four bytes a pixel are taken
        image.thumbnail((MAX_SIDE, MAX_SIDE))
    rgba = image.convert("RGBA")
    rgba.thumbnail((MAX_SIDE, MAX_SIDE))
    return shared(np.asarray(rgba, dtype=np.uint8), np.uint8)


def load_image(mesh_file: Path, name: str) -> NDArray[np.uint8] | None:
    """Return (h, w, 4) RGBA of an image of a mesh; None, with a log message, if it cannot be read."""
    file = find_external_file(mesh_file, name)
    return None if file is None else load_image_file(file, f"{mesh_file.name}: {file.name}")


def load_image_file(file: Path, what: str) -> NDArray[np.uint8] | None:
    """Return (h, w, 4) RGBA of an image file, from the cache if possible; None, logged, if unreadable.

    Args:
        file: an existing file.
        what: its name in log messages.
    """
    status = file.stat()
    key = (file.resolve(), status.st_mtime_ns, status.st_size)
    with _recent_lock:
        if key in _recent:
            _recent.move_to_end(key)
            return _recent[key]
    try:
        image = _decoded(read_file(file, MAX_IMAGE_BYTES), what)
    except OSError as error:
        _log.info("%s: %s; skipped", what, error.strerror)
        image = None
    with _recent_lock:
        _recent[key] = image
        while sum(kept.nbytes for kept in _recent.values() if kept is not None) > RECENT_BYTES:
            _recent.popitem(last=False)
    return image


def _decoded(data: bytes, what: str) -> NDArray[np.uint8] | None:
    """Return what `decode_image` returns, from the images on disk if possible."""
    key = image_key(data)
    image = stored_image(key)
    if image is None:
        image = decode_image(data, what)
        if image is not None:
            store_image(key, image)
    return image


def clear_images() -> None:
    """Empty the cache of decoded images."""
    with _recent_lock:
        _recent.clear()


def _opened(data: bytes) -> Image:
    """Return an image whose pixels are not read yet.

    For the format of most textures Pillow is not asked, which imports four others first.
    """
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        from PIL.PngImagePlugin import PngImageFile

        return PngImageFile(io.BytesIO(data))
    from PIL.Image import open as open_image

    return open_image(io.BytesIO(data), formats=_IMAGES)


def decode_image(data: bytes, what: str) -> NDArray[np.uint8] | None:
    """Return (h, w, 4) RGBA of an image file's bytes; None, with a log message, if they are not an image."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of many pixels, which are counted below
            opened = _opened(data)
        with opened as image:
            if image.width * image.height > MAX_PIXELS:
                _log.info("%s: %d x %d pixels are too many; skipped", what, image.width, image.height)
                return None
            return pixels(image)
    except Exception as error:  # Pillow raises many types for broken files
        _log.info("%s: not a readable image (%s); skipped", what, error)
        return None
