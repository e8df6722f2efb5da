"""Read the materials of an OBJ file."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from roboyard.shapes.readers.external_files import find_external_file, load_image

REMEMBERED = 16
"""Libraries."""
# options before a file name: those of one word, -mm of two numbers, -o -s -t of one to three
_OPTIONS = re.compile(
    r"^(?:-(?:blendu|blendv|cc|clamp|imfchan|texres|type|bm|boost)\s+\S+\s+"
    r"|-mm\s+\S+\s+\S+\s+|-[ost](?:\s+[-+.\deE]+){1,3}\s+)+"
)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Finish:
    """How a material looks."""

    color: NDArray[np.uint8] | None = None
    """(4,) RGBA; white where a texture covers the surface."""
    texture: NDArray[np.uint8] | None = None


def read_mtl(obj_file: Path, libraries: Sequence[str], wanted: Collection[str]) -> dict[str, Finish]:
    """Materials by name, those wanted of all the libraries of an OBJ file that can be found."""
    finishes: dict[str, Finish] = {}
    images: dict[str, NDArray[np.uint8] | None] = {}
    for library in libraries:
        file = find_external_file(obj_file, library)
        if file is None:
            continue
        state = file.stat()
        if state.st_size > 16 << 20:
            continue
        for name, entries in _library(file, state.st_mtime_ns, state.st_size).items():
            if name in wanted and name not in finishes:
                finishes[name] = _finish(entries, obj_file, images)
    return finishes


@lru_cache(REMEMBERED)
def _library(file: Path, changed: int, size: int) -> dict[str, dict[str, str]]:
    """A library's materials; files of one scene often share theirs."""
    return _materials(file.read_text(encoding="utf-8", errors="replace"))


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


def _finish(entries: dict[str, str], obj_file: Path, images: dict[str, NDArray[np.uint8] | None]) -> Finish:
    alpha = _numbers(entries.get("d", ""))[:1] or [
        1.0 - value for value in _numbers(entries.get("tr", ""))[:1]
    ]
    opacity = alpha[0] if alpha else 1.0
    rgb = _numbers(entries.get("kd", ""))[:3]
    color = None
    if len(rgb) == 3:
        color = np.rint(255 * np.clip([*rgb, opacity], 0.0, 1.0)).astype(np.uint8)
    name = _OPTIONS.sub("", entries.get("map_kd", "")).strip()
    if not name:
        return Finish(color=color)
    if name not in images:
        images[name] = load_image(obj_file, name)
    texture = images[name]
    if texture is None:
        return Finish(color=color)
    # Exporters leave all kinds of Kd beside a texture; what is meant is the texture.
    if color is None or color[3] == 255:
        return Finish(texture=texture)
    return Finish(texture=texture, color=np.array([255, 255, 255, color[3]], dtype=np.uint8))


def _numbers(text: str) -> list[float]:
    values: list[float] = []
    for token in text.split():
        try:
            values.append(float(token))
        except ValueError:
            break
    return [value for value in values if np.isfinite(value)]
