"""Where the machine code of loops is stored, as earlier processes found it.

The name of such a file depends on the content of all sources of a loop, on constants and on the compiler. To
read and digest these takes a program's first step as long as all else in it. Here is kept what they were:
where the sources' times and sizes, and the constants, are still the same, so is the name.
"""

# pathlib takes longer to look at thirty files than all of this:
# ruff: noqa: PTH116

from __future__ import annotations

import marshal
import os
import sys
from types import FunctionType
from typing import TYPE_CHECKING, Any
from zlib import crc32

import numpy as np

from roboyard import _bootstrap, _bytecode
from roboyard.native.called import is_constant, parts_of
from roboyard.native.processor import processor
from roboyard.native.signatures import Bundle, Record

if TYPE_CHECKING:
    import ast
    from collections.abc import Iterator

    from roboyard.native.memory import StoredImage

_HEAD = f"roboyard 4 {np.__version__} {getattr(sys, 'abiflags', '')}"
_COMPILER = "llvmlite"
_PACKAGE = __name__.partition(".")[0]
_PLAIN = tuple(f"{_PACKAGE}.{part}" for part in ("native", "_records", "_arrays"))
"""Parts of this package on which no constant of a loop depends."""
_HARMLESS = frozenset(("__future__", "collections", "math", "numpy", "typing"))
"""Other packages: their constants are the same where the head of the file is."""


class KnownPlaces:
    """The file of the places of all loops of one Python, and what this process adds to it."""

    def __init__(self, layout: int) -> None:
        """Read the file, if there is one; `layout` is that of the machine code's arguments."""
        self._head = f"{_HEAD} {layout} {processor()}"
        tag = crc32(os.fsencode("\n".join((sys.prefix, __file__, self._head))))
        self._path = os.path.join(  # noqa: PTH118
            _bootstrap.user_cache(), "places", f"{sys.implementation.cache_tag}-{tag:08x}"
        )
        self._known: dict[str, bytes] = {}
        self._is_new = False
        self._missed: set[str] = set()
        """Loops that were asked for by their modules, in vain."""
        try:
            head, known = marshal.loads(_bootstrap.private_content(self._path))  # noqa: S302 - the user's own
            if head == self._head:
                self._known = known
        except (ValueError, EOFError, TypeError):
            pass
        _bytecode.stores.append(self)

    def find(self, function: FunctionType, signature: Any) -> tuple[str, str, StoredImage | None] | None:
        """Return path and name of a loop's machine code, and what is known of it.

        Returns:
            None where something may have changed.
        """
        blob = self._known.get(_key(function, signature))
        if blob is None:
            return None
        path, name, image, files, states, constants, values = marshal.loads(blob)  # noqa: S302 - the user's own
        if _states(files.split("\n")) != states or _values(constants.split("\n")) != values:
            return None
        if image is not None and _closed_key(function.__module__, function.__name__) in self._missed:
            self._add_closed(function, signature, path, image)
        return path, name, image

    def add(
        self, function: FunctionType, signature: Any, path: str, name: str, image: StoredImage | None = None
    ) -> None:
        """Keep path and name of a loop's machine code, and what is known of it, for later processes."""
        parts = parts_of(function)
        if any(vars(sys.modules.get(one.__module__, sys)) is not one.__globals__ for one in parts):
            return  # of no module: later processes could not ask for its constants
        compiler = os.path.dirname(str(getattr(sys.modules.get(_COMPILER), "__file__", None)))  # noqa: PTH120
        files = [f"{compiler}/{file}" for file in ("__init__.py", "_version.py")]
        files += sorted({one.__code__.co_filename for one in parts})
        names: dict[str, set[str]] = {}
        for one in parts:
            given = one.__globals__
            plain = {n for n in one.__code__.co_names if n in given and _may_be_constant(given[n])}
            names.setdefault(one.__module__, set()).update(plain)
        constants = [" ".join((module, *sorted(plain))) for module, plain in sorted(names.items())]
        states, values = _states(files), _values(constants)
        if states is not None and values is not None:
            entry = path, name, image, "\n".join(files), states, "\n".join(constants), values
            self._known[_key(function, signature)] = marshal.dumps(entry)
            self._is_new = True
            if image is not None:
                self._add_closed(function, signature, path, image)

    def add_image(self, function: FunctionType, signature: Any, image: StoredImage) -> None:
        """Keep what is known of a loop's machine code beside path and name, which `find` has returned."""
        key = _key(function, signature)
        path, name, _, *sources = marshal.loads(self._known[key])  # noqa: S302 - the user's own
        self._known[key] = marshal.dumps((path, name, image, *sources))
        self._is_new = True
        self._add_closed(function, signature, path, image)

    def find_closed(self, module: str, name: str) -> tuple[str, StoredImage] | None:
        """Return file and image of a loop by its module, which need not be imported; None if not known."""
        key = _closed_key(module, name)
        blob = self._known.get(key)
        if blob is not None:
            path, image, files, states = marshal.loads(blob)  # noqa: S302 - the user's own
            if _states(files.split("\n")) == states:
                return None if image is None else (path, image)
        self._missed.add(key)
        return None

    def _add_closed(self, function: FunctionType, signature: Any, path: str, image: StoredImage) -> None:
        """Keep a loop by its module, where the sources that are imported there decide all constants."""
        loop: Any = vars(sys.modules[function.__module__]).get(function.__name__)
        if getattr(loop, "py_func", None) is not function or loop.library or loop.signature is not signature:
            return
        sources, found = _closed_sources(function.__module__), image
        if not sources:  # later processes need not look again as long as its own source is the same
            sources, found = [function.__code__.co_filename], None
        states = _states(sources)
        if states is not None:
            key = _closed_key(function.__module__, function.__name__)
            self._known[key] = marshal.dumps((path, found, "\n".join(sources), states))
            self._is_new = True

    def close(self) -> None:
        """Write the file again, without what is gone, if this process has added to it."""
        if self._is_new:
            kept = {key: blob for key, blob in self._known.items() if os.path.exists(marshal.loads(blob)[0])}  # noqa: PTH110, S302
            _bytecode.write_for_the_user(self._path, [marshal.dumps((self._head, kept))])


def _closed_key(module: str, name: str) -> str:
    return f"{module}:{name}:{os.environ.get('NUMBA_CACHE_DIR')}"


def _closed_sources(module: str) -> list[str]:
    """Return the files of a module and of all of its package that are imported with it.

    None are returned where one of them imports others than Python's library, NumPy and this package, or
    parts of this package that depend on the machine or on other libraries.
    """
    import ast

    files: dict[str, str] = {}
    waiting = [module]
    package = module.partition(".")[0]
    while waiting:
        name = waiting.pop()
        if name in files or name.startswith(_PLAIN) or name not in sys.modules:
            continue  # what a function imports later decides no constant
        file = getattr(sys.modules.get(name), "__file__", None)
        if not file or name.partition(".")[2].startswith("_"):
            return []
        files[name] = file
        with open(file, "rb") as source:  # noqa: PTH123
            tree = ast.parse(source.read())
        for node in _executed(tree):
            names = [one.name for one in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                home = node.module or ""
                names = [f"{home}.{one.name}" for one in node.names if f"{home}.{one.name}" in sys.modules]
                names.append(home)
            for found in names:
                first = found.partition(".")[0]
                if first == package or found.startswith(_PLAIN):
                    waiting.append(found)
                elif first not in _HARMLESS:
                    return []
    return sorted(files.values())


def _executed(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield the statements of a module that are executed when it is imported, those for types excepted."""
    import ast

    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        yield node
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            waiting += node.orelse
        else:
            waiting += ast.iter_child_nodes(node)


def _key(function: FunctionType, signature: Any) -> str:
    """Return the name of a loop among all."""
    arguments = [
        [_fields(record) for record in argument.records]
        if isinstance(argument, Bundle)
        else _fields(argument)
        if isinstance(argument, Record)
        else argument
        for argument in getattr(signature, "arguments", ())
    ]
    others = [value for name, value in vars(signature).items() if name != "arguments"]
    given = os.environ.get("NUMBA_CACHE_DIR")
    code = function.__code__
    text = repr((given, type(signature), arguments, others))
    return f"{code.co_filename}:{function.__qualname__}:{crc32(text.encode()):08x}"


def _fields(record: Record) -> Any:
    """Return what a record is made of in plain values, whose text takes a tenth of the time of its own."""
    kinds = [(field.dtype, field.dimensions, field.is_contiguous) for field in record.fields]
    return record.made_by, record.names, kinds


def _may_be_constant(value: Any) -> bool:
    return value is None or is_constant(value)


def _states(files: list[str]) -> list[int] | None:
    """Return times and sizes of files; None where one is gone."""
    states: list[int] = []
    try:
        for file in files:
            found = os.stat(file)
            states += found.st_mtime_ns, found.st_size
    except OSError:
        return None
    return states


def _values(constants: list[str]) -> str | None:
    """Return the text of the values of names, given as "module name name"; None where one is gone."""
    values: list[Any] = []
    for line in constants:
        module, *names = line.split(" ")
        if module not in sys.modules:
            return None
        given = vars(sys.modules[module])
        for name in names:
            value = given.get(name, sys)
            if not _may_be_constant(value):
                return None
            is_array = isinstance(value, np.ndarray)
            values.append((value.dtype, value.shape, value.tobytes()) if is_array else value)
    return repr(values)
