"""The memory of a compiled model, of which MuJoCo has all arrays in one block."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

_NAMES: list[str] = []


def memory_of(model: Any) -> np.ndarray | None:
    """Return (n,) bytes: all arrays of an MjModel, which MuJoCo has in one block; None if it has not."""
    first, end = 2**63, 0
    for name in array_names(model):
        values = getattr(model, name)
        if values.size and values.flags.c_contiguous and not values.flags.owndata:
            at = values.__array_interface__["data"][0]
            first, end = min(first, at), max(end, at + values.nbytes)
    size = end - first
    if not 0 < size <= model.nbuffer:
        return None
    return np.frombuffer(memoryview((ctypes.c_uint8 * size).from_address(first)), np.uint8)


def array_names(model: Any) -> list[str]:
    """Return the names of all arrays of an MjModel, of which each has the same ones.

    It takes five times as long to look at all its members.
    """
    if not _NAMES:
        names = (name for name in dir(type(model)) if not name.startswith("_"))
        _NAMES.extend(name for name in names if isinstance(getattr(model, name), np.ndarray))
    return _NAMES
