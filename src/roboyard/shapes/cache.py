"""Cache of arrays on disk, by the hash of their inputs.

The folder is `ROBOYARD_CACHE`, else the platform's user cache folder. Entries are written atomically, so that
several processes can share it; an unreadable entry counts as absent.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from roboyard._arrays import NDArray
from roboyard._bootstrap import user_cache
from roboyard._digests import blake2b
from roboyard.untrusted.arrays import ArraysError, read_arrays

MAX_BYTES = 256 << 20
"""Largest entry, unpacked (bytes)."""


def cache_folder() -> Path:
    """Return the folder of the cache; it may not exist yet."""
    named = os.environ.get("ROBOYARD_CACHE")
    if named:
        return Path(named).expanduser()
    return Path(user_cache())


def mesh_folder() -> Path:
    """Return the folder of meshes that were extracted from other files; it may not exist yet."""
    return cache_folder() / "meshes"


def content_key(*parts: object) -> str:
    """Return a hash of arrays (type, shape and bytes) and of other values (their repr)."""
    digest = blake2b(digest_size=20)
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype.str}{part.shape}".encode())
            digest.update(np.ascontiguousarray(part).tobytes())
        else:
            digest.update(repr(part).encode())
        digest.update(b"\0")
    return digest.hexdigest()


def load_arrays(kind: str, key: str) -> dict[str, NDArray] | None:
    """Return the (...,) arrays stored under `key`; None if they are missing or unreadable."""
    try:
        return read_arrays(_entry(kind, key), MAX_BYTES)
    except (OSError, ArraysError):
        return None


def store_arrays(kind: str, key: str, arrays: Mapping[str, NDArray]) -> bool:
    """Store (...,) arrays under `key`; return False, without an error, if the folder is not writable."""
    import tempfile

    entry = _entry(kind, key)
    try:
        entry.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=entry.parent, suffix=".tmp")
    except OSError:
        return False
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, allow_pickle=False, **dict(arrays))
        Path(name).replace(entry)
    except OSError:
        Path(name).unlink(missing_ok=True)
        return False
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    return True


def _entry(kind: str, key: str) -> Path:
    return cache_folder() / kind / key[:2] / f"{key}.npz"
