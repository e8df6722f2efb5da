"""Log one line when the kernels are compiled for the first time; later runs load them from disk."""

from __future__ import annotations

from typing import Any

from roboyard._lazy import LazyLogger
from roboyard.native import Kernel

_log = LazyLogger("roboyard")
_announced = False
_warm: set[int] = set()
"""Kernels that were found compiled or stored, so that the disk is asked once."""


def announce(*kernels: Any) -> None:
    """Log one line when any of the loops has neither been compiled nor been stored on disk."""
    global _announced
    for kernel in kernels:
        if _announced or id(kernel) in _warm:
            continue
        if not is_cold(kernel):
            _warm.add(id(kernel))
            continue
        _announced = True
        _log.warning("compiling the software renderer for this machine: once, about 30 seconds")


def is_cold(kernel: Any) -> bool:
    """Return whether a loop has neither been compiled nor been stored on disk."""
    return isinstance(kernel, Kernel) and not kernel.is_ready
