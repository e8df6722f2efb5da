"""Convex hulls kept on disk, so that a program that starts again need not compute them, nor import scipy.

A file holds two counts, the vertices, the faces and a checksum; one that is cut or changed counts as absent.
Without a place to write, nothing is kept.
"""

from __future__ import annotations

import os
import struct
from contextlib import suppress
from functools import cache
from pathlib import Path

import numpy as np

from roboyard._bootstrap import user_cache
from roboyard._digests import blake2b
from roboyard.transforms import Array

_HEADER = struct.Struct("<8sII")
_FORMAT = b"ryhull2\0"
"""First bytes of a file; another number for another way to compute hulls."""
_CHECKSUM = 16
MOST_VERTICES = 20_000
"""Larger hulls are not kept."""
MOST_FILES = 16_384
"""Number of hulls that are kept; the oldest quarter goes where there are more."""


def load_hull(key: bytes) -> tuple[Array, np.ndarray] | None:
    """Return the (n, 3) float64 vertices (m) and (m, 3) int32 faces of a hull, or None where it is not kept.

    Args:
        key: digest of the points.
    """
    try:
        with _file(key).open("rb") as stream:
            content = stream.read(_HEADER.size + MOST_VERTICES * 48 + _CHECKSUM + 1)
    except OSError:
        return None
    body, checksum = content[:-_CHECKSUM], content[-_CHECKSUM:]
    if len(body) < _HEADER.size or blake2b(body, digest_size=_CHECKSUM).digest() != checksum:
        return None
    form, n, m = _HEADER.unpack_from(body)
    if form != _FORMAT or len(body) != _HEADER.size + 24 * n + 12 * m:
        return None
    vertices = np.frombuffer(body, np.float64, 3 * n, _HEADER.size).reshape(n, 3)
    return vertices.copy(), np.frombuffer(body, np.int32, 3 * m, _HEADER.size + 24 * n).reshape(m, 3).copy()


def store_hull(key: bytes, vertices: Array, faces: np.ndarray) -> None:
    """Keep a hull, where there is a place and it is not too large.

    Args:
        key: digest of the points.
        vertices: (n, 3) (m).
        faces: (m, 3) vertex indices.
    """
    if len(vertices) > MOST_VERTICES:
        return
    path = _file(key)
    body = _HEADER.pack(_FORMAT, len(vertices), len(faces))
    body += (
        np.ascontiguousarray(vertices, np.float64).tobytes() + np.ascontiguousarray(faces, np.int32).tobytes()
    )
    new = path.with_name(f"{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _make_room(path.parent)
        new.write_bytes(body + blake2b(body, digest_size=_CHECKSUM).digest())
        new.replace(path)
    except OSError:
        with suppress(OSError):
            new.unlink()


_counts: dict[Path, int] = {}
"""Folder to the number of its files, counted once and not by each hull: a model may have hundreds."""


def _make_room(folder: Path) -> None:
    """Count one more file, and delete the oldest ones where there are too many."""
    count = _counts.get(folder)
    if count is None:
        count = sum(1 for _ in os.scandir(folder))
    if count >= MOST_FILES:
        there = sorted(os.scandir(folder), key=lambda file: file.stat().st_mtime_ns)
        going = there[: max(len(there) // 4, len(there) + 1 - MOST_FILES)]
        for file in going:
            with suppress(OSError):  # another process deletes some, too
                Path(file.path).unlink()
        count = len(there) - len(going)
    _counts[folder] = count + 1


def _file(key: bytes) -> Path:
    return _folder() / f"{key.hex()}.hull"


@cache
def _folder() -> Path:
    return Path(user_cache()) / "hulls"
