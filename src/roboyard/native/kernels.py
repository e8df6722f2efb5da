"""The decorator of compiled loops, and their first call."""

from __future__ import annotations

import os
import sys
from _thread import RLock
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from importlib import import_module
from types import FunctionType, SimpleNamespace
from typing import Any

from roboyard.native import objects
from roboyard.native.builtin import builtin_function, lone_function
from roboyard.native.signatures import Bundle, Record, Signature, parse_signature

loading = RLock()
"""Held while a loop is compiled or loaded: LLVM and the files of loops are for one thread at a time."""


def can_call(library: Callable[[], Any]) -> bool:
    """Return whether loops that call functions of a C library are executed here; others need another way."""
    from roboyard.native.memory import images_can_be_loaded

    return objects.code_is_used() and images_can_be_loaded() and library() is not None


def lazy_loop(module: str, name: str) -> Callable[[], Any]:
    """Return a function that returns a module, or what has no more than one of its loops.

    That is enough where the loop's machine code is stored; the module would import those of all parts of the
    loop, of which a step has thirty. Arguments are not checked then, as in later calls of any loop.

    Args:
        module: full name of the module.
        name: of its loop.
    """
    return cache(partial(_home_of, module, name))


def _home_of(module: str, name: str) -> Any:
    if module not in sys.modules and not os.environ.get("ROBOYARD_CHECK_LOOPS"):
        with loading:
            address = objects.known_address(module, name)
        if address:
            return SimpleNamespace(**{name: lone_function(name, module, address)})
    return import_module(module)


class Kernel:
    """A loop that is compiled or loaded on its first call; its module then has the loaded function."""

    def __init__(
        self,
        function: FunctionType,
        signature: Signature,
        text: str,
        library: Callable[[], Any] | None = None,
    ) -> None:
        """Create the loop.

        Args:
            function: its Python source, which numba can compile.
            signature: its arguments.
            text: the signature as text.
            library: returns the `ctypes.CDLL` of the functions of C that it calls.
        """
        self.py_func = function
        """The loop in Python."""
        self.signature, self.text = signature, text
        self.__name__, self.__doc__, self.__module__ = (
            function.__name__,
            function.__doc__,
            function.__module__,
        )
        self.library = library
        """Returns the `ctypes.CDLL` of the functions of C that it calls, if there are any."""
        self._loaded: Callable[..., Any] | None = None
        self._checks = False

    def __call__(self, *values: Any) -> Any:
        """Call the loop; the first call loads it.

        Raises:
            TypeError: the values do not fit the signature. Later calls do not come here and are not checked,
                unless the environment had ROBOYARD_CHECK_LOOPS at the first one.
        """
        if self._loaded is None or self._checks:
            problem = self.signature.problem_with(values)
            if problem:
                raise TypeError(f"{self.__name__}({self.text}): {problem}")
            return self.load()(*values)
        return self._loaded(*values)

    @property
    def is_ready(self) -> bool:
        """Whether the loop is loaded, or its code is stored: its first call does not compile it."""
        return self._loaded is not None or objects.is_stored(self.py_func, self.signature)

    @property
    def is_cheap(self) -> bool:
        """Whether it is stored, or is compiled once and for all; loops that are convenient only ask."""
        return self._loaded is not None or objects.can_be_kept(self.py_func, self.signature)

    def load(self) -> Callable[..., Any]:
        """Compile the loop or load its stored code, and return the function that executes it."""
        with loading:
            return self._loaded or self._load()

    def _load(self) -> Callable[..., Any]:
        if self.library is not None:
            from roboyard.native.memory import offer

            offer(self.library())
        address = objects.address_of(self.py_func, self.signature)
        loaded = (
            builtin_function(self.py_func, address)
            if address
            else objects.jitted(self.py_func, self.signature)
        )
        self._loaded = loaded
        names = vars(sys.modules[self.__module__])
        self._checks = bool(os.environ.get("ROBOYARD_CHECK_LOOPS"))
        if names.get(self.__name__) is self and not self._checks:
            names[self.__name__] = loaded
        return loaded


def loaded(loop: Any) -> Any:
    """Return the function that executes a loop, for callers that keep it; a loop that checks as it is."""
    if not isinstance(loop, Kernel):
        return loop
    function = loop.load()
    return loop if loop._checks else function


def compiled(
    *parts: str | Record | Bundle,
    fast_math: bool = False,
    no_nan: bool = False,
    releases_gil: bool = False,
    from_start: bool = False,
    joins_lines: bool = False,
    library: Callable[[], Any] | None = None,
) -> Callable[[Any], Any]:
    """Return a decorator that makes a function a compiled loop.

    The function may use numbers, the arrays that it is given, NumPy's mathematics and other functions of its
    package, which are plain Python functions or loops; it creates no arrays. Divisions by zero give infinity.

    Args:
        parts: types of the arguments, separated by spaces: f8, i8, i4 for numbers (float64, int64, int32) and
            f8[:], i4[:,:], ... for arrays, f8[:,::1] for those in C order, which are faster (only the first
            call checks); "-> f8" or "-> i8" at the end where it returns a number. A `record` stands between
            texts for a named tuple, a `Bundle` for several, which are passed as what its `of` returns.
        fast_math: whether the order of sums and products may be changed.
        no_nan: whether no number is ever undefined.
        releases_gil: whether other Python threads run during a call; for calls of a microsecond and more.
        from_start: whether all indices count from the start of an array. Negative ones are then outside of
            it, unchecked, and indices that may be negative for all the compiler knows take no time.
        joins_lines: whether equal operations on neighbouring numbers that are written out one by one become
            vector instructions (LLVM's SLP vectoriser); those of loops do so anyway.
        library: returns the `ctypes.CDLL` of the functions of C that it calls, see `c_function`; callers of
            the loop ask `can_call` first.
    """
    signature = replace(
        parse_signature(*parts),
        fast_math=fast_math,
        no_nan=no_nan,
        releases_gil=releases_gil,
        from_start=from_start,
        joins_lines=joins_lines,
    )
    text = " ".join(part if isinstance(part, str) else _text(part) for part in parts)

    def decorate(function: Any) -> Kernel:
        given = function.__code__.co_argcount
        if given != signature.count:
            raise TypeError(f"{function.__name__} has {given} arguments, its signature {text!r} has others")
        return Kernel(function, signature, text, library)

    return decorate


def _text(part: Record | Bundle) -> str:
    if isinstance(part, Record):
        return part.made_by.__name__
    return f"({' '.join(record.made_by.__name__ for record in part.records)})"
