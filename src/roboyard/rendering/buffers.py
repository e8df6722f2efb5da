"""Scratch arrays reused from frame to frame: a picture allocates little more than its result."""

from __future__ import annotations

import sys
import threading

import numpy as np

from roboyard._arrays import NDArray

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


def scratch(vertices: int) -> tuple[NDArray, ...]:
    """Return the calling thread's (vertices,) and other scratch arrays for `raster.draw_meshes`."""
    from roboyard.rendering.kernels import raster  # on first use

    most = max(vertices, 1)
    return (
        buffer("cell", (most,), np.int32),
        buffer("place", (2, most), np.int32),
        buffer("q", (most,), np.float32),
        buffer("whole", (raster.WHOLE,), np.int32),
        buffer("single", (raster.SINGLE,), np.float32),
        buffer("corners", (7, 3), np.float64),
    )


def result(name: str, shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray:
    """Return an array of this shape (n, ...) and arbitrary content for the caller to keep.

    It is one that was returned before where nothing else refers to that any more, nor to a view of it: new
    pages of memory cost more time than the pixels that are written to them. At most KEPT arrays of a name are
    held, in each thread.
    """
    held: dict[str, list[NDArray]] = _local.__dict__.setdefault("held", {})
    arrays = held.setdefault(name, [])
    for k in range(len(arrays)):
        if sys.getrefcount(arrays[k]) == _UNSHARED and arrays[k].shape == shape and arrays[k].dtype == dtype:
            return arrays[k]
    if len(arrays) >= KEPT:
        del arrays[0]
    arrays.append(np.empty(shape, dtype=dtype))
    return arrays[-1]


KEPT = 2
"""Most arrays of a name that wait in a thread until nothing refers to them."""
_probe = [np.empty(0)]
_UNSHARED = sys.getrefcount(_probe[0])
"""References to an array that only its list refers to."""
