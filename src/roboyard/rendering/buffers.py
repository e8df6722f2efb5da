"""Scratch arrays kept from frame to frame, so that a picture allocates little more than its result."""

from __future__ import annotations

import threading

import numpy as np
from numpy.typing import NDArray

_local = threading.local()
MOST = 48


def buffer(name: str, shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray:
    """Scratch array of the calling thread, by name and shape; its content is arbitrary."""
    kept: dict[tuple[str, tuple[int, ...]], NDArray] = _local.__dict__.setdefault("kept", {})
    array = kept.get((name, shape))
    if array is None:
        if len(kept) >= MOST:
            kept.clear()
        array = kept[name, shape] = np.empty(shape, dtype=dtype)
    return array
