"""Convex hulls kept on disk, so that a program that starts again need not compute them, nor import scipy.

A file holds two counts, the vertices, the faces and a checksum; one that is cut or changed counts as absent.
Meshes that are needed together are kept in one file, whose opening takes longer than its reading. Without a
place to write, nothing is kept.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path

import numpy as np

from roboyard._bootstrap import user_cache
from roboyard._digests import blake2b
from roboyard.transforms import Array

_HEADER = struct.Struct("<8sII")
_FORMAT = b"ryhull3\0"
"""First bytes of a file; another number for another way to compute hulls."""
_GROUP_FORMAT = b"rymesh2\0"
_COUNTS = struct.Struct("<II")
_CHECKSUM = 16
MOST_VERTICES = 20_000
"""Larger hulls are not kept."""
MOST_GROUP_BYTES = 2**20
"""Meshes that take more together are not kept so."""
MOST_FILES = 16_384
"""Number of hulls that are kept; the oldest quarter goes where there are more."""


def load_hull(key: bytes) -> tuple[Array, np.ndarray] | None:
    """Return the (n, 3) float64 vertices (m) and (m, 3) int32 faces of a hull, or None where it is not kept.

    Args:
        key: digest of the points.
    """
    body = _read(_file(key), _HEADER.size + MOST_VERTICES * 48)
    if body is None or len(body) < _HEADER.size:
        return None
    form, n, m = _HEADER.unpack_from(body)
    if form != _FORMAT or len(body) != _HEADER.size + 24 * n + 12 * m:
        return None
    return _arrays(body, _HEADER.size, n, m)


def store_hull(key: bytes, vertices: Array, faces: np.ndarray) -> None:
    """Keep a hull, where there is a place and it is not too large.

    Args:
        key: digest of the points.
        vertices: (n, 3) (m).
        faces: (m, 3) vertex indices.
    """
    if len(vertices) <= MOST_VERTICES:
        body = _HEADER.pack(_FORMAT, len(vertices), len(faces)) + _bytes(vertices, faces)
        _write(_file(key), body)


def load_group(key: bytes) -> list[tuple[Array, np.ndarray]] | None:
    """Return the (n, 3) float64 vertices (m) and (m, 3) int32 faces of meshes that are kept together.

    Args:
        key: digest of what they were made of.

    Returns:
        Them in their order, or None where they are not kept.
    """
    body = _read(_group_file(key), MOST_GROUP_BYTES)
    if body is None or len(body) < _HEADER.size:
        return None
    form, count, _ = _HEADER.unpack_from(body)
    place = _HEADER.size + _COUNTS.size * count
    if form != _GROUP_FORMAT or len(body) < place:
        return None
    sizes = [_COUNTS.unpack_from(body, _HEADER.size + _COUNTS.size * k) for k in range(count)]
    if len(body) != place + sum(24 * n + 12 * m for n, m in sizes):
        return None
    found = list[tuple[Array, np.ndarray]]()
    for n, m in sizes:
        found.append(_arrays(body, place, n, m))
        place += 24 * n + 12 * m
    return found


def store_group(key: bytes, meshes: Sequence[tuple[Array, np.ndarray]]) -> None:
    """Keep meshes together, where there is a place and they are not too large.

    Args:
        key: digest of what they were made of.
        meshes: (n, 3) vertices (m) and (m, 3) vertex indices of each.
    """
    sizes = [(len(vertices), len(faces)) for vertices, faces in meshes]
    size = _HEADER.size + sum(_COUNTS.size + 24 * n + 12 * m for n, m in sizes)
    if size <= MOST_GROUP_BYTES:
        head = _HEADER.pack(_GROUP_FORMAT, len(meshes), 0), *(_COUNTS.pack(*counts) for counts in sizes)
        _write(_group_file(key), b"".join((*head, *(_bytes(*mesh) for mesh in meshes))))


def _arrays(body: bytes, place: int, n: int, m: int) -> tuple[Array, np.ndarray]:
    """Return n vertices and m faces that are at a place (bytes)."""
    vertices = np.frombuffer(body, np.float64, 3 * n, place).reshape(n, 3)
    return vertices.copy(), np.frombuffer(body, np.int32, 3 * m, place + 24 * n).reshape(m, 3).copy()


def _bytes(vertices: Array, faces: np.ndarray) -> bytes:
    first = np.ascontiguousarray(vertices, np.float64).tobytes()
    return first + np.ascontiguousarray(faces, np.int32).tobytes()


def _read(path: Path, most: int) -> bytes | None:
    """Return the content of a file before its checksum, at most so many bytes; None where it is damaged."""
    try:
        with open(path, "rb", buffering=0) as stream:  # noqa: PTH123 - half the time of a buffer's
            content = stream.read(most + _CHECKSUM + 1)
    except OSError:
        return None
    body, checksum = content[:-_CHECKSUM], content[-_CHECKSUM:]
    return body if blake2b(body, digest_size=_CHECKSUM).digest() == checksum else None


def _write(path: Path, body: bytes) -> None:
    """Write a file with a checksum, where there is a place."""
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


def _group_file(key: bytes) -> Path:
    return _folder() / f"{key.hex()}.meshes"


@cache
def _folder() -> Path:
    return Path(user_cache()) / "hulls"
