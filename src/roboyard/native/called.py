"""The functions that a loop calls, which are compiled with it."""

from __future__ import annotations

from collections.abc import Iterator
from types import FunctionType


def called_functions(function: FunctionType) -> Iterator[tuple[str, FunctionType]]:
    """Yield name and source of each Python function of the same package that a function names directly."""
    package = function.__module__.partition(".")[0]
    for name in function.__code__.co_names:
        called = function.__globals__.get(name)
        source = getattr(called, "py_func", called)  # of a loop, also where it is loaded already
        if isinstance(source, FunctionType) and source.__module__.partition(".")[0] == package:
            yield name, source


def source_files(function: FunctionType) -> list[str]:
    """Return the source files of a function and of all that it calls, sorted."""
    found, waiting = {function}, [function]
    while waiting:
        for _, source in called_functions(waiting.pop()):
            if source not in found:
                found.add(source)
                waiting.append(source)
    return sorted({one.__code__.co_filename for one in found})
