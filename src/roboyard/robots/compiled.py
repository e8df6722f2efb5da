"""The compiled sums of balance, imported with the first control step: numba takes a while to load."""

from __future__ import annotations

from functools import cache
from typing import Any


@cache
def kernels() -> Any:
    """The module `roboyard.robots._kernels`."""
    from roboyard.robots import _kernels

    return _kernels
