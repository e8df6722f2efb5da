"""Read the materials of an OBJ file."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from roboyard._arrays import NDArray
from roboyard._lazy import LazyLogger, lazy_pattern
from roboyard._records import dataclass
from roboyard.shapes.readers.external_files import find_external_file, load_image
from roboyard.untrusted.files import read_file

MAX_BYTES = 16 * 1024 * 1024
"""Largest library (bytes)."""
_log = LazyLogger(__name__)
CACHED_LIBRARIES = 16
"""Number of parsed libraries in the cache."""
# options before a file name: one argument, two numbers for -mm, one to three for -o -s -t
_OPTIONS = lazy_pattern(
    r"^(?:-(?:blendu|blendv|cc|clamp|imfchan|texres|type|bm|boost)\s+\S+\s+"
    r"|-mm\s+\S+\s+\S+\s+|-[ost](?:\s+[-+.\deE]+){1,3}\s+)+"
)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SurfaceMaterial:
    """Colour and texture of a material."""

    color: NDArray[np.uint8] | None = None
    """(4,) RGBA; white where a texture covers the surface."""
    texture: NDArray[np.uint8] | None = None


def read_mtl(obj_file: Path, libraries: Sequence[str], names: Collection[str]) -> dict[str, SurfaceMaterial]:
    """Return the named materials from those libraries of an OBJ file that exist."""
    found: dict[str, SurfaceMaterial] = {}
    images: dict[str, NDArray[np.uint8] | None] = {}
    for library in libraries:
        file = find_external_file(obj_file, library)
        if file is None:
            continue
        state = file.stat()
        for name, entries in _library(file, state.st_mtime_ns, state.st_size).items():
            if name in names and name not in found:
                found[name] = _material(entries, obj_file, images)
    return found


@lru_cache(CACHED_LIBRARIES)
def _library(file: Path, changed: int, size: int) -> dict[str, dict[str, str]]:
    """Return a library's materials; the files of one scene often share a library."""
    try:
        return _materials(read_file(file, MAX_BYTES).decode("utf-8", "replace"))
    except OSError as error:
        _log.info("%s: %s; skipped", file.name, error.strerror)
        return {}


def _materials(text: str) -> dict[str, dict[str, str]]:
    found: dict[str, dict[str, str]] = {}
    current: dict[str, str] = {}
    for line in text.splitlines():
        key, _, rest = line.strip().replace("\t", " ").partition(" ")
        if key == "newmtl":
            current = found.setdefault(rest.strip(), {})
        elif key and not key.startswith("#"):
            current.setdefault(key.lower(), rest.strip())
    return found


def _material(
    entries: dict[str, str], obj_file: Path, images: dict[str, NDArray[np.uint8] | None]
) -> SurfaceMaterial:
    alpha = _numbers(entries.get("d", ""))[:1] or [
        1.0 - value for value in _numbers(entries.get("tr", ""))[:1]
    ]
    opacity = alpha[0] if alpha else 1.0
    rgb = _numbers(entries.get("kd", ""))[:3]
    color = None
    if len(rgb) == 3:
        color = np.rint(255 * np.clip([*rgb, opacity], 0.0, 1.0)).astype(np.uint8)
    name = entries.get("map_kd", "")
    if name.startswith("-"):
        name = _OPTIONS.sub("", name)
    name = name.strip()
    if not name:
        return SurfaceMaterial(color=color)
    if name not in images:
        images[name] = load_image(obj_file, name)
    texture = images[name]
    if texture is None:
        return SurfaceMaterial(color=color)
    # exporters write arbitrary Kd beside a texture: only the texture counts
    if color is None or color[3] == 255:
        return SurfaceMaterial(texture=texture)
    return SurfaceMaterial(texture=texture, color=np.array([255, 255, 255, color[3]], dtype=np.uint8))


def _numbers(text: str) -> list[float]:
    values: list[float] = []
    for token in text.split():
        try:
            values.append(float(token))
        except ValueError:
            break
    return [value for value in values if np.isfinite(value)]
