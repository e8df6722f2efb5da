"""Scratch arrays reused from frame to frame: a picture allocates little more than its result."""

from __future__ import annotations

import threading

import numpy as np
from numpy.typing import NDArray

_local = threading.local()
MOST = 48
"""Most arrays cached in a thread; one more clears the cache."""


def buffer(name: str, shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray:
    """Return the calling thread's scratch array of this name and shape (n, ...); its content is arbitrary."""
    cached: dict[tuple[str, tuple[int, ...]], NDArray] = _local.__dict__.setdefault("cached", {})
    array = cached.get((name, shape))
    if array is None:
        if len(cached) >= MOST:
            cached.clear()
        array = cached[name, shape] = np.empty(shape, dtype=dtype)
    return array
