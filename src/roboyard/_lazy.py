"""Modules and names that are imported on first use, since some of them load numba."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, partial
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any, AnyStr, cast

if TYPE_CHECKING:
    import re


def lazy_module(name: str) -> Callable[[], Any]:
    """Return a function that imports the module of this name once and returns it.

    Calling it is cheaper than an import statement in code that runs every step.
    """
    return cache(partial(import_module, name))


def lazy_names(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Return a package's `__getattr__` that imports public names from their modules on first use.

    Args:
        package: name of the package.
        homes: public name to the full name of the module that defines it.
    """

    def load(name: str) -> Any:
        """Return a public name of the package; raise AttributeError where it has none."""
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(homes[name]), name)
        setattr(sys.modules[package], name, value)  # later uses do not come here
        return value

    return load


class LazyLogger:
    """A logger whose module is imported when something is logged.

    Until any module imports `logging`, nothing can have set a level below a warning's, and messages below it
    are dropped.
    """

    def __init__(self, name: str) -> None:
        """Name the logger."""
        self._name = name

    def __getattr__(self, name: str) -> Any:
        if name in ("debug", "info") and "logging" not in sys.modules:
            return _drop
        return getattr(import_module("logging").getLogger(self._name), name)


def _drop(*_: object, **__: object) -> None:
    """Log nothing."""


class _LazyPattern:
    """A regular expression that is compiled when it is first used."""

    def __init__(self, text: Any, flags: int) -> None:
        self._text, self._flags = text, flags

    def __getattr__(self, name: str) -> Any:
        value = getattr(import_module("re").compile(self._text, self._flags), name)
        setattr(self, name, value)  # later uses do not come here
        return value


def lazy_pattern(text: AnyStr, flags: int = 0) -> re.Pattern[AnyStr]:
    """Return what `re.compile` returns, compiled when one of its methods is first called.

    For expressions of modules that every program loads, and that few use.
    """
    return cast("re.Pattern[AnyStr]", _LazyPattern(text, flags))


class Deferred(ModuleType):
    """The place of a module that is imported when one of its names is first used."""

    def __getattr__(self, name: str) -> Any:
        return getattr(_real(self.__name__), name)


class DeferredFunctions(Deferred):
    """The place of a module that is imported when one of its functions is first called."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # an import statement asks for them
            raise AttributeError(name)
        return lambda *given, **named: getattr(_real(self.__name__), name)(*given, **named)


@contextmanager
def deferred(*names: str, kind: type[Deferred] = Deferred) -> Iterator[list[str]]:
    """Have modules that are imported meanwhile import others of these names only when they use them.

    For modules of other packages, which import at their start what programs rarely need.

    Args:
        names: full names of modules; those that are imported already stay as they are.
        kind: `DeferredFunctions` where single functions are imported, which are then imported when called.

    Yields:
        The names that are deferred.
    """
    modules: dict[str, Any] = sys.modules
    waiting = [name for name in names if name not in modules]
    modules.update({name: kind(name) for name in waiting})
    try:
        yield waiting
    finally:
        for name in waiting:
            if isinstance(modules.get(name), Deferred):
                del modules[name]


def _real(name: str) -> Any:
    """Return the module whose place a `Deferred` takes, which another thread may ask for meanwhile."""
    if isinstance(sys.modules.get(name), Deferred):
        del sys.modules[name]
    return import_module(name)


with deferred("urllib.parse", kind=DeferredFunctions):  # for Path.as_uri alone
    import pathlib as pathlib

_has_frozen = False
"""Whether the program excepted objects from collections, which `paused_collection` must not undo."""


def freeze() -> None:
    """Except all that exists from garbage collections for good: what a program has before its script runs."""
    global _has_frozen
    gc.freeze()
    _has_frozen = True


@contextmanager
def paused_collection(*, makes_old: bool = True) -> Iterator[None]:
    """Pause Python's garbage collector while many objects are created and none becomes garbage.

    Its passes through all objects take a tenth of the time of importing many modules, and a quarter of that
    of reading a large XML file.

    Args:
        makes_old: whether what exists counts as old afterwards, so that the collector does not pass through
            it at once. That is for what a process does once: garbage among it stays for long.
    """
    global _has_frozen
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        if makes_old:
            _has_frozen = _has_frozen or gc.get_freeze_count() > 0  # Python counts them one by one
            if not _has_frozen:
                gc.freeze()
                gc.unfreeze()
        gc.enable()
