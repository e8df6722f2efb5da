"""Loads NumPy 1 without the packages in it that NumPy 2, too, loads when they are first used.

They take a third of the time of its import. Import it before `numpy`, in programs that Roboyard starts.
"""

from __future__ import annotations

import sys
import warnings
from importlib import import_module
from typing import Any

from roboyard._lazy import Deferred, deferred

_PACKAGES = ("ctypeslib", "fft", "ma", "polynomial", "random")
_UNUSED = ("ast", "pickle", "platform", "textwrap")
"""Modules that NumPy imports for files of arrays, and for texts about itself."""


def load_numpy() -> None:
    """Import `numpy`; packages in it, such as `numpy.random`, are imported when they are first used.

    Changes nothing of NumPy 2, or where the program imported `numpy` before.
    """
    if "numpy" in sys.modules:
        return
    with deferred(*_UNUSED, *(f"numpy.{name}" for name in _PACKAGES)):
        numpy: Any = import_module("numpy")
    absent = [name for name in _PACKAGES if isinstance(vars(numpy).get(name), Deferred)]
    for name in absent:
        delattr(numpy, name)
    if absent:
        _give_on_first_use(numpy, absent)


def _give_on_first_use(numpy: Any, absent: list[str]) -> None:
    """Have NumPy import packages when they are asked for as its attributes."""
    other_names, other_value = numpy.__dir__, numpy.__getattr__
    packages = {*absent, "testing"}  # which NumPy 1 imports so itself

    def __getattr__(name: str) -> Any:
        if name in packages:
            return import_module(f"numpy.{name}")
        said: list[warnings.WarningMessage] = []
        try:
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("always")
                return other_value(name)
        finally:
            for warning in said:  # of this line; they are to name the one that asks
                warnings.warn(warning.message, warning.category, stacklevel=2)

    def __dir__() -> list[str]:
        return sorted({*other_names(), *absent})

    numpy.__getattr__, numpy.__dir__ = __getattr__, __dir__
