"""Loads MuJoCo's Python module without its windows, which take as long to load as its physics.

The package's other modules take `mujoco` from here: where possible without enumerations, see `_mujoco_parts`.
"""

# pathlib takes four times as long to look at a hundred packages:
# ruff: noqa: PTH123, PTH208

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.machinery import ModuleSpec, SourceFileLoader
from types import ModuleType
from typing import TYPE_CHECKING, Any

from roboyard._lazy import Deferred, deferred
from roboyard._mujoco_parts import (
    PARTS,
    PartsLoader,
    import_from_package,
    is_package,
    package,
    restore_getters,
    store,
    stored_lines,
)

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


class _Finder:
    """Finds `mujoco` for all modules that import it, so that it is loaded as here."""

    parts_alone = False
    """Whether the parts are wanted without the package, which is loaded where they cannot be."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return how `mujoco` is loaded; None for other modules, a program's own of that name among them."""
        if name != "mujoco":
            return None
        spec = package.spec()
        if spec is None or not is_package(spec):
            return None
        if spec.origin is not None and type(spec.loader) is SourceFileLoader:
            lines = stored_lines(spec) if self.parts_alone else None
            spec.loader = (
                _WholeLoader(name, spec.origin) if lines is None else PartsLoader(spec.origin, lines)
            )
        return spec


class _WholeLoader(SourceFileLoader):
    """Loads the package `mujoco`; its `Renderer` and `GLContext` are imported when they are first used."""

    def exec_module(self, module: ModuleType) -> None:
        """Execute the package's code."""
        sys.meta_path.remove(_finder)
        for part in PARTS:
            if f"mujoco.{part}" in sys.modules:
                setattr(module, part, sys.modules[f"mujoco.{part}"])
        with _without_windows():
            super().exec_module(module)
        vars(module)["__getattr__"] = _window_name
        restore_getters()


@contextmanager
def _without_windows() -> Iterator[None]:
    hidden = [name for name in _WINDOW_MODULES.values() if name not in sys.modules]
    modules: dict[str, Any] = sys.modules
    modules.update(dict.fromkeys(hidden))  # None: Python reports the module as not found
    no_plugins = _METADATA not in modules and not plugins_are_installed(sys.path)
    if no_plugins:
        modules[_METADATA] = _NoPlugins(_METADATA)
    try:
        with deferred(*_UNUSED):
            yield
    finally:
        for name in hidden:
            if modules.get(name) is None:
                modules.pop(name, None)
        if no_plugins and isinstance(modules.get(_METADATA), _NoPlugins):
            del modules[_METADATA]


def _loaded() -> Any:
    """Return `mujoco` as the program imported it, or its parts, or the package where they are not known."""
    known = sys.modules.get("mujoco")
    if "mujoco" in sys.modules and ((spec := getattr(known, "__spec__", None)) is None or is_package(spec)):
        return known
    sys.meta_path.insert(0, _finder)
    with package.in_place():
        _finder.parts_alone = True
        try:
            module = import_module("mujoco")
        finally:
            _finder.parts_alone = False
        spec = module.__spec__
        if spec is not None and isinstance(spec.loader, PartsLoader):
            del sys.modules["mujoco"]
        elif spec is not None and isinstance(spec.loader, _WholeLoader):
            store(spec)
    return module


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
        value = getattr(import_from_package(_WINDOW_MODULES[name]), name)
    except ImportError as error:
        raise AttributeError(f"module 'mujoco' has no attribute {name!r}: {error}") from error
    setattr(package.behind or sys.modules["mujoco"], name, value)
    return value


_finder: Any = _Finder()

if TYPE_CHECKING:
    import mujoco as mujoco
else:
    mujoco = _loaded()

__all__ = ["mujoco"]
