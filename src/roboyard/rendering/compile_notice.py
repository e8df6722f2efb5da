"""Log one line when the kernels are compiled for the first time; later runs load them from disk."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from roboyard._lazy import LazyLogger

_log = LazyLogger("roboyard")
_announced = False
_warm: set[int] = set()
"""Kernels that were found compiled or stored, so that the disk is asked once."""


def announce(*kernels: Any) -> None:
    """Log one line when any of the numba functions has neither been compiled nor been stored on disk."""
    global _announced
    for kernel in kernels:
        if _announced or id(kernel) in _warm:
            continue
        if not is_cold(kernel):
            _warm.add(id(kernel))
            continue
        _announced = True
        _log.warning("compiling the software renderer for this machine: once, about 15 seconds")


def is_cold(kernel: Any) -> bool:
    """Whether a numba function has neither been compiled nor been stored on disk."""
    if getattr(kernel, "signatures", True):  # without, as with NUMBA_DISABLE_JIT, it is plain Python
        return False
    path = kernel.stats.cache_path
    if path is None:
        return True
    function = kernel.py_func
    module = Path(function.__code__.co_filename).stem
    return not any(Path(path).glob(f"{module}.{function.__qualname__}-*.nbi"))
