"""Bytecode of the package's own modules in the user's cache folder, where Python stores none beside them.

Python compiles a module from source in every process where it may not write beside it: in containers, which
set PYTHONDONTWRITEBYTECODE to keep images small, and in folders that are read-only. That takes longer than
all else that the start of a program does. Machine code of loops is stored for later processes, too. Import
it before the package's other modules.
"""

# pathlib takes longer to import than all of this:
# ruff: noqa: PTH103, PTH105, PTH108, PTH110, PTH111, PTH116, PTH118, PTH120, PTH123

from __future__ import annotations

import marshal
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from importlib.machinery import FileFinder, ModuleSpec, SourceFileLoader
from importlib.util import MAGIC_NUMBER, cache_from_source
from types import CodeType
from zlib import crc32

_OTHERS_MAY_WRITE = 0o022


def store_bytecode(package: ModuleSpec | None) -> None:
    """Store bytecode of a package's modules in the user's cache folder where Python stores none.

    Args:
        package: spec of the package, whose modules but the present one are not imported yet.
    """
    if package is None or package.cached is None or package.origin is None:
        return
    if os.path.exists(package.cached) and not sys.dont_write_bytecode:
        return  # Python stores what has changed
    root = os.path.dirname(package.origin)
    folder = _folder_for(root) if isinstance(package.loader, SourceFileLoader) else None
    if folder is None:
        return

    class Loader(StoredLoader):
        """The loader of this package's modules."""

        store = folder

    def finder(path: str) -> FileFinder:
        if path != root and not path.startswith(root + os.sep):
            raise ImportError(f"{path!r} is no folder of {root!r}")
        return FileFinder(path, (Loader, [".py"]))

    sys.path_hooks.insert(0, finder)
    sys.path_importer_cache.pop(root, None)


class StoredLoader(SourceFileLoader):
    """Loads a module from source and stores its bytecode, which later processes load."""

    store: str = ""
    """The folder of stored bytecode."""

    def get_code(self, fullname: str) -> CodeType | None:
        """Return the code of a module: stored bytecode of this very source, else compiled now and stored."""
        source = self.get_filename(fullname)
        try:
            stats = self.path_stats(source)
        except OSError:
            return super().get_code(fullname)
        head = _head(int(stats["mtime"]), int(stats["size"]))
        path = os.path.join(self.store, f"{fullname}.pyc")
        with suppress(OSError, ValueError, EOFError, TypeError), open(path, "rb") as file:
            content = file.read()
            if content.startswith(head + source.encode() + b"\0"):
                code = marshal.loads(content[len(head) + len(source.encode()) + 1 :])  # noqa: S302 - our own
                if isinstance(code, CodeType):
                    return code
        code = super().get_code(fullname)
        if code is not None and not _is_stored(source, stats):
            _write(path, head + source.encode() + b"\0" + marshal.dumps(code))
        return code


def _head(mtime: int, size: int) -> bytes:
    """Return what identifies the Python and the source of stored bytecode."""
    numbers = (sys.flags.optimize, mtime, size)
    return MAGIC_NUMBER + b"".join(number.to_bytes(8, "little") for number in numbers)


def _is_stored(source: str, stats: Mapping[str, float]) -> bool:
    """Return whether Python has bytecode of a source as it is now beside it."""
    with suppress(OSError, NotImplementedError), open(cache_from_source(source), "rb") as file:
        head = file.read(16)
        now = (int(stats[name]).to_bytes(8, "little")[:4] for name in ("mtime", "size"))
        return head[:4] == MAGIC_NUMBER and (any(head[4:8]) or head[8:] == b"".join(now))
    return False


def _write(path: str, content: bytes) -> None:
    """Write a file that other processes may read at the same time; without a place for it, do nothing."""
    new = f"{path}.{os.getpid()}"
    try:
        with open(new, "wb") as file:
            file.write(content)
        os.replace(new, path)
    except OSError:
        with suppress(OSError):
            os.unlink(new)


def _folder_for(root: str) -> str | None:
    """Return the folder, made now, for bytecode of a package; None where others may write, or no one."""
    name = f"{sys.implementation.cache_tag}-{crc32(os.fsencode(root)):08x}"
    folder = os.path.join(user_cache(), "bytecode", name)
    try:
        os.makedirs(folder, mode=0o700, exist_ok=True)
        found = os.stat(folder)
    except OSError:
        return None
    if hasattr(os, "getuid") and (found.st_uid != os.getuid() or found.st_mode & _OTHERS_MAY_WRITE):
        return None
    return folder


def user_cache() -> str:
    """Return the folder that `platformdirs` names, whose import takes as long as thirty of our modules."""
    if sys.platform in ("win32", "darwin"):
        from platformdirs import user_cache_dir

        return user_cache_dir("roboyard", appauthor=False)
    named = os.environ.get("XDG_CACHE_HOME", "").strip()
    return os.path.join(named or os.path.expanduser("~/.cache"), "roboyard")


store_bytecode(sys.modules[__name__.partition(".")[0]].__spec__)
