"""SciPy's qhull without the two packages around it, whose loading takes ten times as long as qhull's own.

`scipy.spatial` and `scipy.linalg` come into `sys.modules` as they are found, and are executed once anything
of them is asked for but these extension modules: a program that imports them gets them whole.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec, module_from_spec
from threading import RLock
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scipy.spatial import ConvexHull

_PACKAGES = "scipy.spatial", "scipy.linalg"
_QHULL = "scipy.spatial._qhull"
_DONE = "_roboyard_is_done"
_loading = RLock()
PATIENCE = 10.0
"""Time (s) for which a thread waits for one that executes a package, which may wait for what it imports."""


class _LatePackage(ModuleType):
    """A package that is executed when a name is asked for that it does not have yet."""

    def __getattr__(self, name: str) -> Any:
        if name == "__all__" or not name.startswith("__"):
            self._execute()
            if name in vars(self):
                return vars(self)[name]
        raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")

    def __dir__(self) -> list[str]:
        self._execute()
        return list(vars(self))

    def _execute(self) -> None:
        """Execute the package, once; while it is executed, its own modules ask for names that are to come."""
        state = vars(self)
        if state.get(_DONE) or not _loading.acquire(timeout=PATIENCE):
            return
        try:
            if _DONE not in state:
                state[_DONE] = False
                spec = self.__spec__
                assert spec is not None and spec.loader is not None
                spec.loader.exec_module(self)
                state[_DONE] = True
        except BaseException:
            del state[_DONE]
            raise
        finally:
            _loading.release()


def qhull() -> tuple[type[ConvexHull], type[Exception]]:
    """Return SciPy's `ConvexHull` and `QhullError`.

    Raises:
        ImportError: SciPy cannot be loaded.
    """
    found: Any = sys.modules.get("scipy.spatial")
    if found is None or isinstance(found, _LatePackage):
        found = _alone()
    return found.ConvexHull, found.QhullError


def _alone() -> Any:
    """Return qhull's module; the whole package where another version of SciPy has it elsewhere."""
    with _loading:
        parent = import_module("scipy")
        for name in _PACKAGES:
            spec = None if name in sys.modules else find_spec(name)
            if spec is not None and spec.loader is not None:
                module = sys.modules[name] = module_from_spec(spec)
                module.__class__ = _LatePackage
                setattr(parent, name.rpartition(".")[2], module)
        try:
            return import_module(_QHULL)
        except ImportError:
            return import_module("scipy.spatial")
