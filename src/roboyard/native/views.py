"""Memory at addresses, for code that C calls with pointers; compiled code reads it without a check."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np


def numbers_at(address: int, count: int) -> np.ndarray:
    """Return a view (count,) of numbers of eight bytes."""
    return _view(address, 8 * count, np.float64)


def short_numbers_at(address: int, count: int) -> np.ndarray:
    """Return a view (count,) of numbers of four bytes."""
    return _view(address, 4 * count, np.float32)


def integers_at(address: int, count: int) -> np.ndarray:
    """Return a view (count,) of whole numbers of four bytes."""
    return _view(address, 4 * count, np.int32)


def words_at(address: int, count: int) -> np.ndarray:
    """Return a view (count,) of addresses."""
    return _view(address, 8 * count, np.int64)


def _view(address: int, size: int, kind: Any) -> np.ndarray:
    """Return a view of so many bytes as numbers of one kind."""
    memory: Any = (ctypes.c_byte * size).from_address(int(address))
    return np.frombuffer(memory, kind)
