"""Running unmodified PyBullet scripts on Roboyard."""

from __future__ import annotations

import gc
import runpy
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec, SourceFileLoader
from io import open_code
from pathlib import Path
from types import ModuleType, TracebackType
from typing import Any

from roboyard._lazy import freeze, paused_collection
from roboyard._numpy import load_numpy
from roboyard.omnigibson.import_alias import install_omnigibson_alias
from roboyard.pybullet.ending import end_early
from roboyard.pybullet.functions import PRELOADED

REPLACEMENTS = {
    "pybullet": "roboyard.pybullet",
    "pybullet_data": "roboyard.pybullet_data",
}
"""Module that scripts import to the module that replaces it."""
_UTILITIES = "pybullet_utils"
_CLIENT = f"{_UTILITIES}.bullet_client"
USAGE_ERROR = 2
"""Exit code for a wrong command line."""


def main(arguments: Sequence[str]) -> int:
    """Run the script of a command line `SCRIPT [ARGS]...` and return its exit code."""
    if not arguments or arguments[0] in ("-h", "--help"):
        print("usage: python -m roboyard.pybullet SCRIPT [ARGS]...", file=sys.stderr)
        return 0 if arguments else USAGE_ERROR
    script, *rest = arguments
    if not Path(script).exists():
        print(f"roboyard: there is no file {script!r}; give the path of a Python script", file=sys.stderr)
        return USAGE_ERROR
    return run_script(script, rest)


class _Utilities:
    """Finds `pybullet_utils.bullet_client` or, with `is_package`, the package, where no one else finds it.

    Neither is imported before a script asks for it: it may have a module of that name itself. It has the
    methods of finders and loaders without their base classes, which take long to load.
    """

    def __init__(self, *, is_package: bool) -> None:
        self._is_package = is_package

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != (_UTILITIES if self._is_package else _CLIENT):
            return None
        loader: Any = self
        return ModuleSpec(fullname, loader, origin="roboyard", is_package=self._is_package)

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        """Let Python create the module."""
        return None

    def exec_module(self, module: ModuleType) -> None:
        if self._is_package:
            module.__doc__ = f"Replaces {_UTILITIES}, which is not installed."
        else:
            sys.modules[module.__name__] = import_module("roboyard.pybullet.bullet_client")


def install() -> None:
    """Make `import pybullet`, `pybullet_data` and `pybullet_utils.bullet_client` find Roboyard's modules.

    Other modules of an installed `pybullet_utils` stay unchanged; they then run on Roboyard too.
    """
    for name, replacement in REPLACEMENTS.items():
        sys.modules[name] = import_module(replacement)
    client: Any = _Utilities(is_package=False)
    package: Any = _Utilities(is_package=True)
    sys.meta_path[:] = [client, *sys.meta_path, package]


YOUNG_OBJECTS = 10_000
"""New objects, those that are gone not counted, after which Python's collector passes through them."""


def preload() -> None:
    """Import what almost every script needs, and except it from later garbage collections.

    Python's collector goes through all objects several times while a program starts and three times when it
    ends. What exists before the script is the interpreter's and Roboyard's, and stays until the end.
    """
    with paused_collection():
        for name in PRELOADED:
            import_module(name)
    freeze()


def run_script(script: str | Path, arguments: Sequence[str] = ()) -> int:
    """Run a script as `python script.py arguments...` would, with Roboyard in place of PyBullet.

    Returns:
        The exit code of the script; 1 after an exception, whose traceback starts in the script.
    """
    path = str(script)
    end_early()
    with paused_collection():
        load_numpy()
        install()
        install_omnigibson_alias()
        preload()
    gc.set_threshold(max(gc.get_threshold()[0], YOUNG_OBJECTS), *gc.get_threshold()[1:])
    sys.argv = [path, *arguments]
    sys.path.insert(0, str(Path(script).resolve().parent))
    code = 0
    try:
        _execute(path)
    except SystemExit as leave:
        code = _exit_code(leave.code)
    except BaseException as problem:
        problem = problem.with_traceback(_from_script(problem.__traceback__, path))
        sys.excepthook(type(problem), problem, problem.__traceback__)
        code = 130 if isinstance(problem, KeyboardInterrupt) else 1
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    return code


def _execute(path: str) -> None:
    """Execute a script as the code of a new module, which is `__main__` from now on.

    `runpy`, which executes archives and bytecode, too, loses the names of a script before the process ends:
    what files hold that are still open would not be written.
    """
    with open_code(path) as file:
        source = file.read()
    if b"\0" in source:
        runpy.run_path(path, run_name="__main__")
        return
    code = compile(source, path, "exec", dont_inherit=True)
    module = ModuleType("__main__")  # not before `preload`, after which the collector leaves what exists
    module.__file__, module.__loader__ = path, SourceFileLoader("__main__", path)
    vars(module).update(__builtins__=sys.modules["builtins"], __cached__=None)
    sys.modules["__main__"] = module
    exec(code, vars(module))  # noqa: S102 - the user's script


def _exit_code(value: object) -> int:
    """Return the exit code of `sys.exit(value)`, as the interpreter defines it."""
    if value is None:
        return 0
    if isinstance(value, int):
        return value
    print(value, file=sys.stderr)
    return 1


def _from_script(trace: TracebackType | None, path: str) -> TracebackType | None:
    """Return the part of a traceback that begins in the script; None for a script that does not compile."""
    while trace is not None and trace.tb_frame.f_code.co_filename != path:
        trace = trace.tb_next
    return trace
