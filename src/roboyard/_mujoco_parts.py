"""MuJoCo's Python module without its enumerations, whose 83 classes take half as long to load as all else.

`mujoco` loads them at its start. Here its other extension modules are loaded alone, into a module that stays
out of `sys.modules`: a program that imports `mujoco` gets the package as it is. The numbers of the
enumerations come from the user's cache folder; a process that finds none there loads the package and stores
them.
"""

# pathlib takes longer to import than all of this:
# ruff: noqa: PTH110, PTH116, PTH118, PTH120

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES, ModuleSpec, PathFinder, SourceFileLoader
from types import ModuleType
from typing import Any
from zlib import crc32

from roboyard._bootstrap import user_cache
from roboyard._bytecode import private_lines, write_for_the_user

PARTS = ("_callbacks", "_constants", "_errors", "_functions", "_specs", "_structs")
"""Extension modules whose names `mujoco` has."""
_ENUMS = "mujoco._enums"
_HEAD = "roboyard 1"
_GETTERS = "getters"
_original: dict[tuple[type, str], property] = {}
"""Class and name of its properties that give enumerations, until these are loaded."""


class Package:
    """MuJoCo's package where a program has a module named `mujoco` itself, as a file beside its script."""

    is_wanted = False
    """Whether an import of `mujoco` is one of the package."""
    behind: ModuleType | None = None
    """The package, once it was loaded behind such a module."""

    def spec(self) -> ModuleSpec | None:
        """Return how `mujoco` is found: the first one, but where the package is wanted that."""
        first = PathFinder.find_spec("mujoco")
        if first is None or not self.is_wanted or is_package(first):
            return first
        found = (PathFinder.find_spec("mujoco", [folder]) for folder in sys.path)
        return next((spec for spec in found if spec is not None and is_package(spec)), first)

    @contextmanager
    def in_place(self) -> Iterator[None]:
        """Have the package as `mujoco` in `sys.modules` for what is imported meanwhile."""
        modules: dict[str, Any] = sys.modules
        own = modules.get("mujoco")
        is_other = (
            own is not None and getattr(own, "__spec__", None) is not None and not is_package(own.__spec__)
        )
        if is_other:
            del modules["mujoco"]
        if self.behind is not None and "mujoco" not in modules:
            modules["mujoco"] = self.behind
        before, self.is_wanted = self.is_wanted, True
        try:
            yield
        finally:
            self.is_wanted = before
            loaded = modules.get("mujoco")
            first = None if is_other or loaded is None else PathFinder.find_spec("mujoco")
            if is_other or (first is not None and not is_package(first)):
                self.behind = modules.pop("mujoco", None) or self.behind
            if is_other:
                modules["mujoco"] = own


def is_package(spec: ModuleSpec) -> bool:
    """Return whether this is MuJoCo's package, with its extension modules."""
    name = f"_structs{EXTENSION_SUFFIXES[0]}"
    return any(os.path.exists(os.path.join(folder, name)) for folder in spec.submodule_search_locations or ())


package = Package()


def import_from_package(name: str) -> Any:
    """Import `mujoco` or a module of it, and return it."""
    if name != "mujoco" and name in sys.modules:
        return sys.modules[name]
    with package.in_place():
        return import_module(name)


class Enumeration:
    """The numbers of one of MuJoCo's enumerations; the enumeration itself for all else."""

    def __init__(self, name: str, numbers: dict[str, int]) -> None:
        """Name the enumeration, and its members."""
        self._name = name
        vars(self).update(numbers)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._whole(), name)

    def __call__(self, *values: Any) -> Any:
        """Return the member with a number."""
        return self._whole()(*values)

    def __iter__(self) -> Iterator[Any]:
        """Iterate over the members."""
        return iter(self._whole())

    def _whole(self) -> Any:
        return getattr(import_from_package(_ENUMS), self._name)


class PartsLoader(SourceFileLoader):
    """Loads the extension modules of `mujoco`, and not the package."""

    def __init__(self, path: str, lines: list[str]) -> None:
        """Load them from the folder of `mujoco/__init__.py`; `lines` are those of `stored_lines`."""
        super().__init__("mujoco", path)
        self._lines = lines

    def exec_module(self, module: ModuleType) -> None:
        """Give the module the names of the extension modules, and the enumerations' when they are used."""
        modules: dict[str, Any] = sys.modules
        modules[_ENUMS] = ModuleType(_ENUMS)
        names = vars(module)
        try:
            for part in PARTS:
                names.update(_public_names(import_module(f"mujoco.{part}")))
        finally:
            del modules[_ENUMS]
        names["__version__"] = names["mj_versionString"]()
        numbers: dict[str, str] = {}
        for line in self._lines:
            name, _, rest = line.partition(" ")
            if name == _GETTERS:
                for getter in rest.split():
                    _load_first(names, *getter.split("."))
            else:
                numbers[name] = rest
        names["__getattr__"] = _later_names(module, numbers)


def _public_names(part: ModuleType) -> dict[str, Any]:
    names = vars(part)
    chosen = names.get("__all__") or [name for name in names if not name.startswith("_")]
    return {name: names[name] for name in chosen}


def _later_names(module: ModuleType, numbers: dict[str, str]) -> Callable[[str], Any]:
    def load(name: str) -> Any:
        """Return an enumeration's numbers, or a name that only the whole package has."""
        if name in numbers:
            pairs = (pair.split("=") for pair in numbers[name].split())
            value: Any = Enumeration(name, {member: int(number) for member, number in pairs})
        elif name.startswith("__"):
            raise AttributeError(f"module 'mujoco' has no attribute {name!r}")
        else:
            value = getattr(import_from_package("mujoco"), name)
        setattr(module, name, value)
        return value

    return load


def _load_first(names: dict[str, Any], owner: str, name: str) -> None:
    """Let a property that gives a member of an enumeration load these when it is read."""
    cls = names[owner]
    original: property = vars(cls)[name]
    read: Any = original.fget

    def get(element: Any) -> Any:
        import_from_package(_ENUMS)
        restore_getters()
        return read(element)

    _original[cls, name] = original
    setattr(cls, name, property(get, original.fset, original.fdel, original.__doc__))


def restore_getters() -> None:
    """Give properties back as they are, once the enumerations are loaded."""
    while _original:
        (cls, name), original = _original.popitem()
        setattr(cls, name, original)


def parts_are_loaded() -> bool:
    """Return whether all parts, and the enumerations, are loaded."""
    return all(f"mujoco.{part}" in sys.modules for part in (*PARTS, "_enums"))


def stored_lines(spec: ModuleSpec) -> list[str] | None:
    """Return what `store` wrote about the same files of MuJoCo; None if it did not."""
    key, path = _key(spec), _path(spec)
    lines = private_lines(path)
    return lines[1:-1] if key and lines and (lines[0], lines[-1]) == (key, _HEAD) else None


def store(spec: ModuleSpec) -> None:
    """Write the numbers of the enumerations, and which properties give their members."""
    key = _key(spec)
    if not key or not parts_are_loaded():
        return
    lines = [key]
    for name, enumeration in vars(sys.modules[_ENUMS]).items():
        members = getattr(enumeration, "__members__", None)
        if members:
            lines.append(f"{name} " + " ".join(f"{member}={int(members[member])}" for member in members))
    getters = [
        f"{owner}.{name}"
        for owner, cls in _public_names(sys.modules["mujoco._specs"]).items()
        if isinstance(cls, type)
        for name, value in vars(cls).items()
        if isinstance(value, property) and f"-> {_ENUMS}." in (getattr(value.fget, "__doc__", None) or "")
    ]
    lines += [f"{_GETTERS} {' '.join(getters)}", _HEAD]
    write_for_the_user(_path(spec), ["\n".join(lines).encode()])


def _path(spec: ModuleSpec) -> str:
    return os.path.join(user_cache(), "mujoco", f"enumerations-{crc32(os.fsencode(str(spec.origin))):08x}")


def _key(spec: ModuleSpec) -> str:
    """Return the state of the files that the numbers depend on; an empty text where they are not known."""
    folder = os.path.dirname(str(spec.origin))
    names = ("__init__.py", *(f"{part}{EXTENSION_SUFFIXES[0]}" for part in ("_enums", "_specs")))
    try:
        files = [os.stat(os.path.join(folder, name)) for name in names]
    except OSError:
        return ""
    return " ".join([_HEAD, folder.encode().hex(), *(f"{s.st_size}:{s.st_mtime_ns}" for s in files)])
