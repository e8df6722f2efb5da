"""Files in which connect(SHARED_MEMORY, key) finds the address of a server on this machine."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from platformdirs import user_cache_path

from roboyard.untrusted.files import read_file


def _file(key: int) -> Path:
    return user_cache_path("roboyard") / "servers" / f"{key}.json"


@contextmanager
def announced(key: int, host: str, port: int) -> Iterator[None]:
    """Publish an address under a key while the context lasts; the newest server has the key."""
    path = _file(key)
    path.parent.mkdir(parents=True, exist_ok=True)
    address = {"host": host, "port": port, "process": os.getpid()}
    path.write_text(json.dumps(address), encoding="utf-8")
    try:
        yield
    finally:
        if _read(path) == address:
            path.unlink(missing_ok=True)


def find(key: int) -> tuple[str, int] | None:
    """Return host and port published under a key, or None."""
    match _read(_file(key)):
        case {"host": str(host), "port": int(port)}:
            return host, port
    return None


def _read(path: Path) -> object:
    with suppress(OSError, ValueError, RecursionError):
        return json.loads(read_file(path, 1 << 16))
    return None
