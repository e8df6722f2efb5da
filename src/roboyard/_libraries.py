"""Bytecode of libraries in the user's cache folder, as `_bytecode` stores this package's.

For processes that are ours, such as that of `roboyard run`: it takes a third of the time that scripts spend
with the imports of NumPy, SciPy, Gymnasium and others. Each package has a file of its own, and Python's
library has one. Modules of the user's own are loaded as always.
"""

# pathlib takes longer to import than all of this:
# ruff: noqa: PTH119, PTH120

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import ModuleType

from roboyard._bytecode import StoredModules, insert_finder, many_for, stores

_STANDARD = os.path.dirname(os.__file__)
"""Folder of Python's library."""
_INSTALLED = ("site-packages", "dist-packages")
"""Names of the folders of installed packages."""
_FEW = 4
"""Modules beyond a file for which it is written again."""


class Libraries:
    """The finder of the modules of libraries."""

    def __init__(self) -> None:
        """Begin without any."""
        self._of_python: StoredModules | None = None
        self._homes: dict[str, StoredModules] = {}
        """Package that was imported to its modules."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return how to load a module of a library; None for what Python finds itself."""
        package, is_within, _ = name.partition(".")
        if is_within:
            home = self._homes.get(package)
            return None if home is None else home.find_spec(name, path, target)
        spec = PathFinder.find_spec(name, path, target)
        if spec is None or type(spec.loader) is not SourceFileLoader or spec.origin is None:
            return spec
        home = self._home(spec, spec.origin)
        return spec if home is None else home.with_loader(spec)

    def _home(self, spec: ModuleSpec, origin: str) -> StoredModules | None:
        """Return where the bytecode of a module or package is that Python found; None for the user's own."""
        is_package = spec.submodule_search_locations is not None
        home = self._homes.get(spec.name)
        if home is not None:
            return home
        folder = os.path.dirname(origin)
        place = os.path.dirname(folder) if is_package else folder
        if place == _STANDARD:
            home = self._of_python = self._of_python or _store(place, "", spec)
        elif is_package and os.path.basename(place) in _INSTALLED:
            home = _store(folder, f"{spec.name}.", spec)
        else:
            return None
        if is_package:
            self._homes[spec.name] = home
        return home


def _store(root: str, prefix: str, spec: ModuleSpec) -> StoredModules:
    stores.append(StoredModules(root, prefix, min(_FEW, many_for(spec))))
    return stores[-1]


@contextmanager
def stored_libraries() -> Iterator[None]:
    """Load libraries by stored bytecode meanwhile, in a process that is not ours."""
    before = list(sys.meta_path)
    store_libraries()
    try:
        yield
    finally:
        for finder in [one for one in sys.meta_path if isinstance(one, Libraries) and one not in before]:
            sys.meta_path.remove(finder)


def store_libraries() -> None:
    """Load libraries by stored bytecode from now on, and store that of others at the end."""
    if not any(isinstance(finder, Libraries) for finder in sys.meta_path):
        insert_finder(Libraries())
