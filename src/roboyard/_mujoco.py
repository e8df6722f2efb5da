"""Loads MuJoCo's Python module without its windows, which take as long to load as its physics.

Import it before `mujoco`.
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

_WINDOW_MODULES = {
    "Renderer": "mujoco.rendering.classic.renderer",
    "GLContext": "mujoco.rendering.classic.gl_context",
}
"""Name in `mujoco` to the module that defines it. MuJoCo skips the modules where they are not installed."""
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
    if _METADATA not in modules and not plugins_are_installed(sys.path):
        hidden.append(_METADATA)
        modules[_METADATA] = _NoPlugins(_METADATA)
    try:
        mujoco: Any = import_module("mujoco")
    finally:
        for name in hidden:
            if modules.get(name) is None or isinstance(modules[name], _NoPlugins):
                modules.pop(name, None)
    mujoco.__getattr__ = _window_name


def plugins_are_installed(folders: list[str]) -> bool:
    """Return whether a package in one of Python's folders names plugins of MuJoCo's."""
    for folder in folders:
        try:
            entries = [entry for entry in Path(folder or ".").iterdir() if entry.name.endswith(_INFO)]
        except NotADirectoryError:
            return True  # an archive: MuJoCo looks into it
        except OSError:
            continue
        for entry in entries:
            try:
                text = (entry / "entry_points.txt").read_bytes()
            except OSError:
                continue
            if _PLUGINS.encode() in text:
                return True
    return False


class _NoPlugins(ModuleType):
    """The place of `importlib.metadata` while MuJoCo looks for plugins, since loading that takes 0.03 s."""

    def __getattr__(self, name: str) -> Any:
        if name == "entry_points":
            return _entry_points
        return getattr(_metadata(), name)


def _entry_points(**asked: str) -> Any:
    return () if asked == {"group": _PLUGINS} else _metadata().entry_points(**asked)


def _metadata() -> Any:
    """Return the real module, which another thread may ask for meanwhile."""
    if isinstance(sys.modules.get(_METADATA), _NoPlugins):
        del sys.modules[_METADATA]
    return import_module(_METADATA)


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
