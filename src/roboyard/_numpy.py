"""Loads NumPy without its annotations, and NumPy 1 without the packages that NumPy 2 loads on first use.

They take more than a third of the time of its import. Import it before `numpy`, in programs that Roboyard
starts.
"""

from __future__ import annotations

import sys
import warnings
from importlib import import_module
from typing import Any, ForwardRef

from roboyard._lazy import Deferred, deferred

_PACKAGES = ("ctypeslib", "fft", "ma", "polynomial", "random")
_UNUSED = ("ast", "pickle", "platform", "textwrap")
"""Modules that NumPy imports for files of arrays, and for texts about itself."""
_ANNOTATIONS = "_typing"
_ARRAY = "NDArray"


class _Annotations(Deferred):
    """The place of `numpy._typing`, of which NumPy itself needs one name, for fields of named tuples."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # an import statement asks for them
            raise AttributeError(name)
        return _array if name == _ARRAY else super().__getattr__(name)


class _Array:
    """The place of `numpy.typing.NDArray` in NumPy's own annotations."""

    is_loading = False
    """Whether NumPy is being imported."""

    def __getitem__(self, kind: Any) -> Any:
        """Return the type of arrays of a kind; while NumPy is imported a reference to it."""
        if self.is_loading:
            return ForwardRef(f"{_ARRAY}[{getattr(kind, '__name__', 'Any')}]")
        return self._real()[kind]

    def __getattr__(self, name: str) -> Any:
        return getattr(self._real(), name)

    def _real(self) -> Any:
        return getattr(import_module(f"numpy.{_ANNOTATIONS}"), _ARRAY)


_array = _Array()


def load_numpy() -> None:
    """Import `numpy`; packages in it, such as `numpy.random`, are imported when they are first used.

    Changes nothing where the program imported `numpy` before.
    """
    if "numpy" in sys.modules:
        return
    _array.is_loading = True
    try:
        with (
            deferred(*_UNUSED, *(f"numpy.{name}" for name in _PACKAGES)),
            deferred(f"numpy.{_ANNOTATIONS}", kind=_Annotations) as waiting,
        ):
            numpy: Any = import_module("numpy")
    finally:
        _array.is_loading = False
    absent = [name for name in _PACKAGES if isinstance(vars(numpy).get(name), Deferred)]
    for name in absent:
        delattr(numpy, name)
    if waiting and waiting[0] not in sys.modules:
        absent.append(_ANNOTATIONS)
    if absent:
        _give_on_first_use(numpy, absent)


def _give_on_first_use(numpy: Any, absent: list[str]) -> None:
    """Have NumPy import packages when they are asked for as its attributes."""
    other_names, other_value = numpy.__dir__, numpy.__getattr__
    packages = {*absent, "testing"}  # which NumPy 1 imports so itself
    known: dict[str, tuple[Any, list[warnings.WarningMessage]]] = {}

    def __getattr__(name: str) -> Any:
        if name in packages:
            return import_module(f"numpy.{name}")
        said: list[warnings.WarningMessage] = []
        try:
            if name in known:  # programs ask for deprecated names in loops
                value, said = known[name]
                return value
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("always")
                value = other_value(name)
            known[name] = value, said
            return value
        finally:
            for warning in said:  # of this line; they are to name the one that asks
                warnings.warn(warning.message, warning.category, stacklevel=2)

    def __dir__() -> list[str]:
        return sorted({*other_names(), *absent})

    numpy.__getattr__, numpy.__dir__ = __getattr__, __dir__
