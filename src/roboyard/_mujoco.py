"""Loads MuJoCo's Python module without its windows, which take as long to load as its physics.

Import it before `mujoco`.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any

_WINDOW_MODULES = {
    "Renderer": "mujoco.rendering.classic.renderer",
    "GLContext": "mujoco.rendering.classic.gl_context",
}
"""Name in `mujoco` to the module that defines it. MuJoCo skips the modules where they are not installed."""


def load_mujoco() -> None:
    """Import `mujoco`; `mujoco.Renderer` and `mujoco.GLContext` are imported when they are first used.

    Does nothing where the program imported `mujoco` before.
    """
    if "mujoco" in sys.modules:
        return
    hidden = [name for name in _WINDOW_MODULES.values() if name not in sys.modules]
    modules: dict[str, Any] = sys.modules
    modules.update(dict.fromkeys(hidden))  # None: Python reports the module as not found
    try:
        mujoco: Any = import_module("mujoco")
    finally:
        for name in hidden:
            modules.pop(name, None)
    mujoco.__getattr__ = _window_name


def _window_name(name: str) -> Any:
    """Return a name of MuJoCo's window modules; raise AttributeError for any other name."""
    if name not in _WINDOW_MODULES:
        raise AttributeError(f"module 'mujoco' has no attribute {name!r}")
    try:
        value = getattr(import_module(_WINDOW_MODULES[name]), name)
    except ImportError as error:
        raise AttributeError(f"module 'mujoco' has no attribute {name!r}: {error}") from error
    setattr(sys.modules["mujoco"], name, value)
    return value


load_mujoco()
