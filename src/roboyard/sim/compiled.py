"""The compiled loops of a step, imported with the first one: numba takes a while to load."""

from __future__ import annotations

from functools import cache
from typing import Any


@cache
def kernels() -> Any:
    """The module `roboyard.sim._kernels`; cheaper than an import statement where every step passes."""
    from roboyard.sim import _kernels

    return _kernels
