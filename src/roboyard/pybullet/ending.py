"""The end of a process that ran a script, without taking apart the modules of the libraries that it used.

Python ends by deleting each object of each module one by one, and passes through all of them three times in
search of garbage. A script of a second spends a tenth of it there, before the process ends and all memory is
free anyhow. Here what the script and its own modules created ends as always: files are written, `__del__` is
called, also in cycles. Python's library, installed packages and this one are left as they are.
"""

# pathlib takes longer to look at a thousand files than all of this:
# ruff: noqa: PTH120

from __future__ import annotations

import atexit
import gc
import os
import sys
from _weakref import ref
from collections.abc import Callable
from contextlib import suppress
from ctypes import py_object, pythonapi
from io import BufferedRandom, BufferedWriter, TextIOWrapper
from itertools import compress
from types import ModuleType
from typing import Any

from roboyard import _bytecode

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

_STANDARD_ERROR = 2
_NO_MODULE: Any = None
_FILES = frozenset((TextIOWrapper, BufferedWriter, BufferedRandom))
_PYTHONS_OWN = ("sys", "builtins", "__main__")
"""Modules that Python itself ends last."""
_INSTALLED = (f"{os.sep}site-packages{os.sep}", f"{os.sep}dist-packages{os.sep}")
_LIBRARIES = tuple(
    os.path.dirname(file) + os.sep for file in (os.__file__, os.path.dirname(_bytecode.__file__))
)
"""Folders of Python's library and of this package."""


class _SecondPrompt(str):
    """What `sys.ps2` is by default, which Python drops when all registered functions have run.

    That is after the last line of Python outside of the ends of objects, when no other thread runs any more,
    and before modules are taken apart.
    """

    __slots__ = ()

    def __del__(self, is_last: Callable[[], bool] = sys.is_finalizing) -> None:
        if is_last():
            _end()


def end_early() -> None:
    """Let the process end as described above, unless it is an interactive one."""
    if sys.implementation.name == "cpython" and not hasattr(sys, "ps1") and not hasattr(sys, "ps2"):
        sys.ps2 = _SecondPrompt("... ")
        atexit.register(gc.disable)  # else Python passes through all objects before it drops any


def _end() -> None:
    """End what the script created, and keep Python from the rest."""
    atexit._clear()  # functions of the script that have run, and hold what it created
    own = [name for name, module in sys.modules.items() if name == "__main__" or not _is_of_a_library(module)]
    left = [ref(sys.modules[name]) for name in own]
    for name in own:
        sys.modules[name] = _NO_MODULE  # as Python does: a late import of it fails, and does not run it again
    _write_files()
    gc.collect()
    for module in left:
        _clear(module())
    gc.freeze()
    kept = {name: module for name, module in sys.modules.items() if name not in _PYTHONS_OWN}
    for name in kept:
        del sys.modules[name]
    pythonapi.Py_IncRef(py_object(kept))


def _write_files() -> None:
    """Write what open files have not written yet: the collector may close a file before its buffer is."""
    if not _may_write():
        return
    objects = gc.get_objects()
    for file in compress(objects, map(_FILES.__contains__, map(type, objects))):
        if not file.closed:
            with suppress(OSError, ValueError):
                file.flush()


def _may_write() -> bool:
    """Return whether the process can write to anything but the three standard streams."""
    if fcntl is None:
        return True
    try:
        for name in os.listdir("/dev/fd"):  # noqa: PTH208
            if int(name) > _STANDARD_ERROR:
                with suppress(OSError):  # the one of this folder is closed now
                    if fcntl.fcntl(int(name), fcntl.F_GETFL) & os.O_ACCMODE != os.O_RDONLY:
                        return True
    except (OSError, ValueError):
        return True
    return False


def _is_of_a_library(module: object) -> bool:
    """Return whether a module is Python's, an installed package's or this package's, or from no file."""
    if not isinstance(module, ModuleType):
        return True
    file = vars(module).get("__file__")
    if not isinstance(file, str):
        return True
    return file.startswith(_LIBRARIES) or any(folder in file for folder in _INSTALLED)


def _clear(module: ModuleType | None) -> None:
    """Take the values out of a module that something still refers to, in Python's order."""
    if module is None:
        return
    names = vars(module)
    private = [name for name in names if name.startswith("_") and not name.startswith("__")]
    for name in (*private, *names):
        if name != "__builtins__":
            names[name] = None
