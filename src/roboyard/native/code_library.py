"""numba's libraries of code without machine code, for functions that only become parts of others.

numba makes machine code of each function that it compiles, also of those that are merely parts of a loop, and
of a loop that is stored as an object file: a third of the time that the largest loop takes.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from numba.core import codegen
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

_METHODS = (
    *((codegen.JITCodeLibrary, name) for name in ("get_pointer_to_function", "_finalize_specific")),
    *((codegen.JITCPUCodegen, name) for name in ("_add_module", "set_env")),
)
"""Methods of numba's classes that those below replace: without one, numba makes machine code elsewhere."""


class _Library(codegen.JITCodeLibrary):
    """Functions that other ones are linked with; none of them has an address."""

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0, once nothing is added to the library any more."""
        self._ensure_finalized()
        return 0

    def _finalize_specific(self) -> None:
        """Make no machine code."""


class _Codegen(codegen.JITCPUCodegen):
    """Makes such libraries."""

    _library_class: Any = _Library

    def _add_module(self, module: Any) -> None:
        """Hand nothing to LLVM's engine, which makes machine code."""

    def set_env(self, env_name: str, env: Any) -> None:
        """Leave the place of numba's environment empty: it is one for calls from Python."""


@contextmanager
def without_machine_code() -> Iterator[None]:
    """Let numba compile functions up to LLVM's code, which `inspect_llvm` returns and others are linked with.

    Other threads compile nothing meanwhile. Where numba has other libraries than are known, it makes machine
    code, too.
    """
    context: Any = cpu_target.target_context
    with global_compiler_lock:
        kept = getattr(context, "_internal_codegen", None)
        is_known = all(hasattr(kind, name) for kind, name in _METHODS)
        if type(kept) is not codegen.JITCPUCodegen or not is_known:
            yield
            return
        context._internal_codegen = _without()
        try:
            yield
        finally:
            context._internal_codegen = kept


@cache
def _without() -> _Codegen:
    return _Codegen("roboyard")
