"""The memory of a compiled model, of which MuJoCo has all arrays in one block."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np


def memory_of(model: Any) -> np.ndarray | None:
    """Return (n,) bytes: all arrays of an MjModel, which MuJoCo has in one block; None if it has not."""
    found = [getattr(model, name) for name in dir(type(model)) if not name.startswith("_")]
    arrays = [values for values in found if isinstance(values, np.ndarray) and values.size]
    arrays = [values for values in arrays if values.flags.c_contiguous and not values.flags.owndata]
    first = min(values.ctypes.data for values in arrays)
    size = max(values.ctypes.data + values.nbytes for values in arrays) - first
    if size > model.nbuffer:
        return None
    return np.frombuffer(memoryview((ctypes.c_uint8 * size).from_address(first)), np.uint8)
