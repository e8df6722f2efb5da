"""Bytecode of the package's own modules in the user's cache folder: one file for all that programs load.

A program loads nearly two hundred modules. Python searches folders and opens a file for each, a third of the
time that they take; here all come out of one file, which a process that had to load many without it extends
at its end. A module whose source has changed since is loaded without that file. Where Python stores no
bytecode, in containers that set PYTHONDONTWRITEBYTECODE and in read-only folders, the file saves compiling
every module in every process, too. Import it before the package's other modules.
"""

# pathlib takes longer to import than all of this:
# ruff: noqa: PTH103, PTH105, PTH108, PTH110, PTH116, PTH118, PTH120

from __future__ import annotations

import atexit
import marshal
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import MAGIC_NUMBER
from mmap import ACCESS_READ, mmap
from types import CodeType, ModuleType
from typing import Any

from roboyard._bootstrap import FinderLoader, cache_folder, is_private, private_content

_HEAD = b"roboyard 1 " + MAGIC_NUMBER + bytes([sys.flags.optimize])
"""Start of the file: its format, the Python, and the level of optimization."""
_NUMBER = 8
"""Bytes of each of the two numbers after the head: sizes of the file, and of the table at its end."""
_FIRST = len(_HEAD) + 2 * _NUMBER
"""Where the first module's bytecode is."""
_CACHED_AS = "" if sys.flags.optimize or sys.pycache_prefix else f".{sys.implementation.cache_tag}.pyc"
"""How the names of Python's own files of bytecode end; an empty text where these are in other places."""
MANY = 16
"""Modules and texts beyond the file for which it is written again where Python stores bytecode itself."""


class StoredModules:
    """The finder of a package's modules, which has the bytecode of those in the file."""

    def __init__(self, root: str, prefix: str, many: int) -> None:
        """Open the file, if there is one, of the modules in a folder.

        Args:
            root: the package's folder.
            prefix: start of the names of its modules, such as "numpy."; "" where the folder is no package.
            many: modules and texts beyond the file for which it is written again.
        """
        self.root, self.prefix = root, prefix
        self._base = os.path.dirname(root) if prefix else root
        self.folder = cache_folder(root)
        self.path = os.path.join(self.folder, f"modules-{sys.flags.optimize}")
        self.modules: dict[str, tuple[bool, int, int, int, int]] = {}
        """Module in the file to: is it a package, its source's time (ns) and size, first byte and end."""
        self.texts: dict[str, tuple[int, int]] = {}
        """Text in the file that the package has compiled to the first byte of its code, and the end."""
        self.new_modules: dict[str, tuple[bool, int, int, CodeType]] = {}
        """Module that this process has loaded without the file to its place in `modules` and its code."""
        self.new_texts: dict[str, CodeType] = {}
        """Text that this process has compiled to its code."""
        self.many = many
        self.content = memoryview(b"")
        try:
            self._open()
        except (OSError, ValueError, EOFError, TypeError):
            self.modules, self.texts = {}, {}

    def _open(self) -> None:
        file = os.open(self.path, os.O_RDONLY)
        try:
            if is_private(os.fstat(file)) and is_private(os.stat(self.folder)):
                self.content = memoryview(mmap(file, 0, access=ACCESS_READ))
        finally:
            os.close(file)
        size, table = (
            int.from_bytes(self.content[at : at + _NUMBER], "little") for at in (len(_HEAD), _FIRST - _NUMBER)
        )
        if self.content[: len(_HEAD)] == _HEAD and len(self.content) == size >= _FIRST + table:
            root, modules, texts = marshal.loads(self.content[size - table :])  # noqa: S302 - the user's own
            if root == self.root:
                self.modules, self.texts = modules, texts

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return how to load a module of the package, from the file if its source is as it was; else None."""
        if not name.startswith(self.prefix):
            return None
        spec = self._from_file(name, path or ()) if name in self.modules else None
        return spec or self.with_loader(PathFinder.find_spec(name, path, target))

    def with_loader(self, spec: ModuleSpec | None) -> ModuleSpec | None:
        """Let a source file that Python found be loaded by its bytecode in the file, and else be noted."""
        if spec is not None and type(spec.loader) is SourceFileLoader and spec.origin is not None:
            is_package, time, size, *place = self.modules.get(spec.name, (False, 0, 0, 0, 0))
            is_known = self._source(spec.name, is_package) == spec.origin and _is_as_it_was(
                spec.origin, time, size
            )
            part = self.content[slice(*place)] if is_known else None
            spec.loader = StoredLoader(spec.name, spec.origin, self, part)
        return spec

    def _from_file(self, name: str, path: Sequence[str]) -> ModuleSpec | None:
        is_package, time, size, start, end = self.modules[name]
        source = self._source(name, is_package)
        folder = os.path.dirname(source)
        if (os.path.dirname(folder) if is_package else folder) not in path or not _is_as_it_was(
            source, time, size
        ):
            return None
        loader = StoredLoader(name, source, self, self.content[start:end])
        spec = ModuleSpec(name, loader, origin=source, is_package=is_package)
        spec.has_location = True
        if _CACHED_AS:  # else Python computes it, which takes longer than all of this
            stem = "__init__" if is_package else name.rpartition(".")[2]
            spec.cached = f"{folder}{os.sep}__pycache__{os.sep}{stem}{_CACHED_AS}"
        if is_package:
            spec.submodule_search_locations = [folder]
        return spec

    def _source(self, name: str, is_package: bool) -> str:
        stem = self._base + os.sep + name.replace(".", os.sep)
        return f"{stem}{os.sep}__init__.py" if is_package else f"{stem}.py"

    def code_of(self, text: str, file: str) -> CodeType:
        """Return the code of a text, which is shown as that of `file`."""
        code = _loaded(self.content[slice(*self.texts[text])]) if text in self.texts else None
        if code is None:
            code = self.new_texts[text] = compile(text, file, "exec", dont_inherit=True)
        return code

    def close(self) -> None:
        """Write the file again if this process has loaded much without it."""
        if len(self.new_modules) + len(self.new_texts) < self.many:
            return
        pieces: list[bytes | memoryview] = []
        end = _FIRST

        def placed(code: bytes | memoryview) -> tuple[int, int]:
            nonlocal end
            start, end = end, end + len(code)
            pieces.append(code)
            return start, end

        modules = {}
        for name, (is_package, time, size, *place) in self.modules.items():
            if name not in self.new_modules and _is_as_it_was(self._source(name, is_package), time, size):
                modules[name] = is_package, time, size, *placed(self.content[slice(*place)])
        texts = {}
        if len(modules) == len(self.modules):  # else they may be those of older sources
            texts = {text: placed(self.content[slice(*place)]) for text, place in self.texts.items()}
        for name, (*known, code) in self.new_modules.copy().items():
            modules[name] = *known, *placed(marshal.dumps(code))
        texts |= {text: placed(marshal.dumps(code)) for text, code in self.new_texts.copy().items()}
        table = marshal.dumps((self.root, modules, texts))
        sizes = (end + len(table)).to_bytes(_NUMBER, "little") + len(table).to_bytes(_NUMBER, "little")
        write_for_the_user(self.path, [_HEAD, sizes, *pieces, table])


class StoredLoader(SourceFileLoader):
    """Loads a module by its stored bytecode, or as Python does and notes what it loaded."""

    def __init__(self, name: str, path: str, home: StoredModules, part: memoryview | None = None) -> None:
        """Load a source file; `part` is its bytecode as it is now, if that is known."""
        super().__init__(name, path)
        self._home, self._part = home, part

    def get_code(self, fullname: str) -> CodeType | None:
        """Return the code of the module."""
        part, self._part = self._part, None  # when it is asked for again, the source may have changed
        code = None if part is None else _loaded(part)
        if code is not None:
            return code
        source = self.get_filename(fullname)
        stats = os.stat(source)
        code = super().get_code(fullname)
        if code is not None:
            kept = self.is_package(fullname), stats.st_mtime_ns, stats.st_size, code
            self._home.new_modules[fullname] = kept
        return code


def _is_as_it_was(source: str, time: int, size: int) -> bool:
    try:
        stats = os.stat(source)
    except OSError:
        return False
    return stats.st_mtime_ns == time and stats.st_size == size


def _loaded(part: memoryview) -> CodeType | None:
    """Return the code of stored bytecode; None if it is damaged."""
    try:
        code = marshal.loads(part)  # noqa: S302 - the user's own
    except (ValueError, EOFError, TypeError):
        return None
    return code if isinstance(code, CodeType) else None


def private_lines(path: str) -> list[str]:
    """Return the lines of a text that only the user may write, as may its folder; none without one."""
    try:
        text = private_content(path).decode()
    except ValueError:
        return []
    return text.split("\n") if text else []


def write_for_the_user(path: str, pieces: Sequence[bytes | memoryview]) -> None:
    """Write a file, which other processes may read or write meanwhile; without a place for it, do nothing."""
    folder = os.path.dirname(path)
    new = f"{path}.{os.getpid()}"
    try:
        os.makedirs(folder, mode=0o700, exist_ok=True)
        if not is_private(os.stat(folder)):
            return
        with open(new, "wb", opener=_for_the_user_alone) as file:
            file.writelines(pieces)
            file.flush()
            os.fsync(file.fileno())
        os.replace(new, path)
    except OSError:
        with suppress(OSError):
            os.unlink(new)


def _for_the_user_alone(path: str, flags: int) -> int:
    return os.open(path, flags, mode=0o600)


def insert_finder(finder: Any) -> None:
    """Let a finder be asked before Python's own of files."""
    place = sys.meta_path.index(PathFinder) if PathFinder in sys.meta_path else len(sys.meta_path)
    sys.meta_path.insert(place, finder)


def many_for(spec: ModuleSpec) -> int:
    """Return for how many modules a file is written, by whether Python has stored the bytecode of one."""
    return MANY if spec.cached is not None and os.path.exists(spec.cached) else 1


def _stored_modules(package: ModuleSpec | None) -> StoredModules | None:
    """Return the finder, in use from now on, of a package of source files; None for other packages."""
    if package is None or package.origin is None or type(package.loader) is not SourceFileLoader:
        return None
    many = 1 if sys.dont_write_bytecode else many_for(package)
    finder = StoredModules(os.path.dirname(package.origin), f"{package.name}.", many)
    insert_finder(finder)
    stores.append(finder)
    return finder


@atexit.register
def close() -> None:
    """Write what the process loaded without the files."""
    if FinderLoader.content is not None:
        write_for_the_user(FinderLoader.stored, [FinderLoader.content])
    while stores:
        stores.pop().close()


stores: list[Any] = []
"""Objects with a method `close` that writes a file at the end of the process."""
_modules = _stored_modules(sys.modules[__name__.partition(".")[0]].__spec__)


def code_of(text: str, file: str = "<string>") -> CodeType:
    """Return the code of a text that the package has composed of names in its own sources.

    Args:
        text: statements.
        file: name of the text in tracebacks, always the same for one text.
    """
    if _modules is None:
        return compile(text, file, "exec", dont_inherit=True)
    return _modules.code_of(text, file)
