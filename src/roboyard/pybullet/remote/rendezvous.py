"""Files in which connect(SHARED_MEMORY, key) finds the address of a server on this machine."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from platformdirs import user_cache_path

from roboyard.untrusted.json_reading import read_json
from roboyard.untrusted.text import one_line

_MAX_BYTES = 1 << 16


@dataclass(frozen=True, kw_only=True, slots=True)
class Address:
    """Where a server is."""

    host: str
    port: int
    token: str = ""
    """Token that it expects in a greeting; "" for none."""


def _file(key: int) -> Path:
    return user_cache_path("roboyard") / "servers" / f"{key}.json"


@contextmanager
def announced(key: int, address: Address) -> Iterator[None]:
    """Publish an address under a key while the context lasts; the newest server has the key.

    Only this user can read it. Where it cannot be written, a line says so; the port remains.
    """
    path = _file(key)
    content = {**asdict(address), "process": os.getpid()}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _write(path, json.dumps(content))
    except OSError as problem:
        print(
            f"roboyard: connect(SHARED_MEMORY, {key}) will not find this server: {path}: "
            f"{problem.strerror or problem}; use its port",
            file=sys.stderr,
        )
        yield
        return
    try:
        yield
    finally:
        with contextlib.suppress(OSError, ValueError):
            if _read(path) == content:
                path.unlink(missing_ok=True)


def find(key: int) -> Address | None:
    """Return the address published under a key; None without one, or, after a line, for a malformed file."""
    path = _file(key)
    try:
        found = _read(path)
        match found:
            case {"host": str(host), "port": int(port), **others} if 0 < port < 65536 and port is not True:
                match others.get("token", ""):
                    case str(token):
                        return Address(host=host, port=port, token=token)
        raise ValueError('expected {"host": text, "port": 1 to 65535}')
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as problem:
        reason = one_line(str(getattr(problem, "strerror", None) or problem))[:160] or type(problem).__name__
        print(f"roboyard: {path} is no address of a server: {reason}; delete it", file=sys.stderr)
        return None


def _write(path: Path, text: str) -> None:
    """Write a file that is never seen half written, and that only this user can read."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-")  # mode 0600
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text)
        os.replace(name, path)  # noqa: PTH105 - the name is a str
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(name)  # noqa: PTH108
        raise


def _read(path: Path) -> object:
    """Return the content of a file.

    Raises:
        OSError: it cannot be read.
        ValueError: it is no JSON.
    """
    return read_json(path, _MAX_BYTES)
