"""numba's compiler for installations of any kind: with a cache on disk where there is a place for it.

numba raises an error where neither the package's folder nor the user's cache can be written, and at cache
files that a crash has cut. Here each process then compiles its own loops, and a line says so.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numba

_is_noted = False


def _njit(*given: Any, **options: Any) -> Any:
    """Return `numba.njit` of a function, or its decorator; `cache=True` caches where that is possible."""
    if given:
        return _compiled(given[0], options)
    return lambda function: _compiled(function, options)


def _compiled(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    compiler: Any = numba.njit
    if not options.get("cache"):
        return compiler(**options)(function)
    try:
        made = compiler(**options)(function)
    except RuntimeError as problem:
        if "cannot cache" not in str(problem):
            raise
        _note()
        return compiler(**{**options, "cache": False})(function)
    cache = getattr(made, "_cache", None)
    if cache is not None and hasattr(cache, "load_overload") and hasattr(cache, "save_overload"):
        cache.load_overload = _forgiving(cache.load_overload, cache)
        cache.save_overload = _forgiving(cache.save_overload, cache)
    return made


def _forgiving(call: Callable[..., Any], cache: Any) -> Callable[..., Any]:
    """Return a function of a cache for which damaged files count as absent, and full disks as no cache."""

    def tolerant(*arguments: Any) -> Any:
        try:
            return call(*arguments)
        except Exception:  # pickle raises many types for damaged files
            with suppress(Exception):
                cache.flush()
            return None

    return tolerant


def _note() -> None:
    global _is_noted
    if not _is_noted and sys.stderr is not None:
        print(
            "roboyard: no folder can be written for compiled loops, so each process compiles its own; "
            "set NUMBA_CACHE_DIR to a folder",
            file=sys.stderr,
        )
    _is_noted = True


if TYPE_CHECKING:
    from numba import njit
else:
    njit = _njit

__all__ = ["njit"]
