"""The functions that a loop calls, which are compiled with it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from roboyard.native.builtin import source_function
from roboyard.native.c_functions import CFunction


def called_functions(function: FunctionType) -> Iterator[tuple[str, FunctionType]]:
    """Yield name and source of each Python function of the same package that a function names directly."""
    package = function.__module__.partition(".")[0]
    for name in function.__code__.co_names:
        called = function.__globals__.get(name)
        source = source_function(called) if callable(called) else None
        if isinstance(source, FunctionType) and source.__module__.partition(".")[0] == package:
            yield name, source


def parts_of(function: FunctionType) -> list[FunctionType]:
    """Return a function and all functions of its package that it calls, directly or not."""
    found, waiting = {function: None}, [function]
    while waiting:
        for _, source in called_functions(waiting.pop()):
            if source not in found:
                found[source] = None
                waiting.append(source)
    return list(found)


def source_of(function: FunctionType) -> Iterator[bytes]:
    """Yield what decides the machine code of a function.

    That is the source files of the function and of all that it calls, and the constants that these name,
    which may be defined in further files.
    """
    found = parts_of(function)
    for file in sorted({one.__code__.co_filename for one in found}):
        try:
            yield _content(file)
        except OSError:  # an installation without sources
            for one in found:
                if one.__code__.co_filename == file:
                    yield one.__code__.co_code + repr(one.__code__.co_consts).encode()
    for one in found:
        for name in one.__code__.co_names:
            value = one.__globals__.get(name)
            if is_constant(value):
                yield f"{one.__qualname__} {name} ".encode() + _bytes(value)


@cache
def _content(file: str) -> bytes:
    """Return a source file's content."""
    return Path(file).read_bytes()


def is_constant(value: Any) -> bool:
    """Return whether machine code has a value of a name in it: numbers, texts, arrays and tuples of these."""
    if isinstance(value, tuple):
        return all(is_constant(part) for part in value)
    return isinstance(value, (bool, int, float, complex, str, bytes, np.generic, np.ndarray, CFunction))


def _bytes(value: Any) -> bytes:
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}".encode() + value.tobytes()
    return repr(value).encode()
