"""The end of a process that ran a script, without taking apart the modules of the libraries that it used.

Python ends by deleting each object of each module one by one, and passes through all of them twice in search
of garbage. A script of a second spends a tenth of it there, before the process ends and all memory is free
anyhow. Here what the script and its own modules created ends as always: files are written, `__del__` is
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
from contextlib import suppress
from ctypes import py_object, pythonapi
from functools import partial
from io import BufferedRandom, BufferedWriter, TextIOWrapper
from types import ModuleType
from typing import Any

from roboyard import _bytecode

_NO_MODULE: Any = None
_FILES = (TextIOWrapper, BufferedWriter, BufferedRandom)
_PYTHONS_OWN = ("sys", "builtins", "__main__")
"""Modules that Python itself ends last."""
_INSTALLED = (f"{os.sep}site-packages{os.sep}", f"{os.sep}dist-packages{os.sep}")
_LIBRARIES = tuple(
    os.path.dirname(file) + os.sep for file in (os.__file__, os.path.dirname(_bytecode.__file__))
)
"""Folders of Python's library and of this package."""


def end_early(script: ModuleType) -> None:
    """Let the process end as described above; call it before anything that is registered for the end.

    Where other programs have registered functions already, such as tools that watch tests, nothing changes:
    they run last, and may import modules.

    Args:
        script: the module whose code is the script's.
    """
    if sys.implementation.name == "cpython" and atexit._ncallbacks() == 1:  # ours
        atexit.register(partial(_end, script))


def _end(script: ModuleType) -> None:
    """End what the script created, and keep Python from the rest."""
    _bytecode.close()
    atexit._clear()  # functions of the script that have run, and hold what it created
    _clear(script)
    own = [name for name, module in sys.modules.items() if not _is_of_a_library(module)]
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
    for file in gc.get_objects():
        if type(file) in _FILES and not file.closed:
            with suppress(OSError, ValueError):
                file.flush()


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
