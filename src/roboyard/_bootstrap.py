"""The finder of the package's modules, `_bytecode`, by bytecode in the user's cache folder.

Where Python stores no bytecode, each process would compile that module, for five milliseconds. This one is
short for that reason. Import it first.
"""

# pathlib takes longer to import than all of this:
# ruff: noqa: PTH110, PTH111, PTH116, PTH118, PTH120

from __future__ import annotations

import marshal
import os
import sys
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import MAGIC_NUMBER, spec_from_file_location
from types import CodeType
from typing import Any
from zlib import crc32

_OTHERS_MAY_WRITE = 0o022
_SOURCE = os.path.join(os.path.dirname(__file__), "_bytecode.py")
_NAME = f"{__package__}._bytecode"


def user_cache() -> str:
    """Return the folder that `platformdirs` names, whose import takes as long as thirty of our modules."""
    if sys.platform in ("win32", "darwin"):
        from platformdirs import user_cache_dir

        return user_cache_dir("roboyard", appauthor=False)
    named = os.environ.get("XDG_CACHE_HOME", "").strip()
    return os.path.join(named or os.path.expanduser("~/.cache"), "roboyard")


def is_private(stats: os.stat_result) -> bool:
    """Return whether a file or folder is the user's, and no one else may write to it."""
    return not hasattr(os, "getuid") or (
        stats.st_uid == os.getuid() and not stats.st_mode & _OTHERS_MAY_WRITE
    )


def private_content(path: str) -> bytes:
    """Return the content of a file that only the user may write, as may its folder; b"" without one."""
    try:
        file = os.open(path, os.O_RDONLY)
        try:
            stats = os.fstat(file)
            content = os.read(file, stats.st_size) if is_private(stats) else b""
        finally:
            os.close(file)
        return content if is_private(os.stat(os.path.dirname(path))) else b""
    except OSError:
        return b""


def cache_folder(root: str) -> str:
    """Return the folder with the bytecode of the package or modules in a folder."""
    tag = f"{sys.implementation.cache_tag}-{crc32(os.fsencode(root)):08x}"
    return os.path.join(user_cache(), "bytecode", tag)


class FinderLoader(SourceFileLoader):
    """Loads the finder by its stored bytecode, or as Python does and keeps the code to be stored."""

    stored = os.path.join(cache_folder(os.path.dirname(__file__)), f"finder-{sys.flags.optimize}")
    """The file."""
    content: bytes | None = None
    """Content that the file should have, where it has another one."""

    def get_code(self, fullname: str) -> CodeType | None:
        """Return the code of the module."""
        stats = os.stat(self.path)
        head = MAGIC_NUMBER, self.path, stats.st_mtime_ns, stats.st_size
        try:
            *found, code = marshal.loads(private_content(self.stored))  # noqa: S302 - the user's own
            if tuple(found) == head and isinstance(code, CodeType):
                return code
        except (ValueError, EOFError, TypeError):
            pass
        code = super().get_code(fullname)
        FinderLoader.content = marshal.dumps((*head, code))
        return code

    @classmethod
    def find_spec(cls, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """Return how to load the finder, and is not asked again; None for any other module."""
        if name != _NAME:
            return None
        sys.meta_path.remove(cls)
        return spec_from_file_location(name, _SOURCE, loader=cls(name, _SOURCE))


if type(__spec__.loader) is SourceFileLoader and not os.path.exists(__spec__.cached or ""):
    sys.meta_path.insert(0, FinderLoader)
