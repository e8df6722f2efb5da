"""Loads MuJoCo's Python module without its windows, which take as long to load as its physics.

Import it before `mujoco`.
"""

# pathlib takes four times as long to look at a hundred packages:
# ruff: noqa: PTH123, PTH208

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import Any

from roboyard._lazy import Deferred, deferred

_WINDOW_MODULES = {
    "Renderer": "mujoco.rendering.classic.renderer",
    "GLContext": "mujoco.rendering.classic.gl_context",
}
"""Name in `mujoco` to the module that defines it. MuJoCo skips the modules where they are not installed."""
_UNUSED = ("ctypes.util", "subprocess", "zipfile")
"""Modules that MuJoCo imports for other systems, and for worlds in archives."""
_METADATA = "importlib.metadata"
_INFO = (".dist-info", ".egg-info")
_PLUGINS = "mujoco.plugins"
"""Entry points of packages that bring plugins of MuJoCo's."""


def load_mujoco() -> None:
    """Import `mujoco`; `mujoco.Renderer` and `mujoco.GLContext` are imported when they are first used.

    Does nothing where the program imported `mujoco` before.
    """
    if "mujoco" in sys.modules:
        return
    hidden = [name for name in _WINDOW_MODULES.values() if name not in sys.modules]
    modules: dict[str, Any] = sys.modules
    modules.update(dict.fromkeys(hidden))  # None: Python reports the module as not found
    no_plugins = _METADATA not in modules and not plugins_are_installed(sys.path)
    if no_plugins:
        modules[_METADATA] = _NoPlugins(_METADATA)
    try:
        with deferred(*_UNUSED):
            mujoco: Any = import_module("mujoco")
    finally:
        for name in hidden:
            if modules.get(name) is None:
                modules.pop(name, None)
        if no_plugins and isinstance(modules.get(_METADATA), _NoPlugins):
            del modules[_METADATA]
    mujoco.__getattr__ = _window_name


def plugins_are_installed(folders: list[str]) -> bool:
    """Return whether a package in one of Python's folders names plugins of MuJoCo's."""
    for folder in folders:
        try:
            names = os.listdir(folder or ".")
        except NotADirectoryError:
            return True  # an archive: MuJoCo looks into it
        except OSError:
            continue
        for name in names:
            if not name.endswith(_INFO):
                continue
            try:
                with open(f"{folder or '.'}/{name}/entry_points.txt", "rb") as file:
                    text = file.read()
            except OSError:
                continue
            if _PLUGINS.encode() in text:
                return True
    return False


class _NoPlugins(Deferred):
    """The place of `importlib.metadata` while MuJoCo looks for plugins, since loading that takes 0.03 s."""

    def __getattr__(self, name: str) -> Any:
        real = super().__getattr__
        if name != "entry_points":
            return real(name)
        return lambda **asked: () if asked == {"group": _PLUGINS} else real(name)(**asked)


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
