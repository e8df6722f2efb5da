"""Running a script written for PyBullet as it is."""

from __future__ import annotations

import runpy
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType, TracebackType

from roboyard.omnigibson.import_alias import install_omnigibson_alias

STAND_INS = {
    "pybullet": "roboyard.pybullet",
    "pybullet_data": "roboyard.pybullet_data",
    "pybullet_utils.bullet_client": "roboyard.pybullet.bullet_client",
}
"""Module that scripts import to the one they get."""


def install() -> None:
    """Make `import pybullet`, `pybullet_data` and `pybullet_utils.bullet_client` find Roboyard's modules.

    Other modules of an installed `pybullet_utils` stay what they are; they too then work on Roboyard.
    """
    for name, ours in STAND_INS.items():
        sys.modules[name] = import_module(ours)
    if "pybullet_utils" not in sys.modules and find_spec("pybullet_utils") is None:
        package = ModuleType("pybullet_utils", "Stands in for pybullet_utils, which is not installed.")
        package.__path__ = []
        sys.modules["pybullet_utils"] = package
    setattr(import_module("pybullet_utils"), "bullet_client", sys.modules["pybullet_utils.bullet_client"])  # noqa: B010


def run_script(script: str | Path, arguments: Sequence[str] = ()) -> int:
    """Run a script as `python script.py arguments...` would, with Roboyard in PyBullet's place.

    Returns:
        The exit code that the script asked for; 1 after an exception, whose traceback is the script's own.
    """
    install()
    install_omnigibson_alias()
    path = str(script)
    sys.argv = [path, *arguments]
    sys.path.insert(0, str(Path(script).resolve().parent))
    code = 0
    try:
        runpy.run_path(path, run_name="__main__")
    except SystemExit as leave:
        code = _exit_code(leave.code)
    except BaseException as problem:
        problem = problem.with_traceback(_from_script(problem.__traceback__, path))
        sys.excepthook(type(problem), problem, problem.__traceback__)
        code = 130 if isinstance(problem, KeyboardInterrupt) else 1
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    return code


def _exit_code(asked: object) -> int:
    """What the interpreter makes of `sys.exit(asked)`."""
    if asked is None:
        return 0
    if isinstance(asked, int):
        return asked
    print(asked, file=sys.stderr)
    return 1


def _from_script(trace: TracebackType | None, path: str) -> TracebackType | None:
    """The part of a traceback that begins in the script; None for a script that does not compile."""
    while trace is not None and trace.tb_frame.f_code.co_filename != path:
        trace = trace.tb_next
    return trace
