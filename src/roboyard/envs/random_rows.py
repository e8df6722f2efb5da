"""Random numbers with one stream for each environment.

The stream of an environment depends on its seed alone, not on how many others there are or which of them
start an episode at the same time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.transforms import Array

Rows: TypeAlias = "np.ndarray[Any, np.dtype[np.intp]]"
"""(k,) indices of environments."""


class RandomRows:
    """The random streams of k environments; every draw has k rows."""

    def __init__(self, streams: Sequence[np.random.Generator]) -> None:
        """Draw from these streams, one for each row."""
        self.streams = streams

    def __len__(self) -> int:
        return len(self.streams)

    def uniform(
        self, low: ArrayLike = 0.0, high: ArrayLike = 1.0, size: int | tuple[int, ...] | None = None
    ) -> Array:
        """Return (k, *size) numbers between low and high; size is that of the bounds by default."""
        low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        shape = _shape(size, np.broadcast_shapes(low.shape, high.shape))
        return low + (high - low) * np.array([s.random(shape) for s in self.streams]).reshape(
            len(self), *shape
        )

    def normal(
        self, mean: ArrayLike = 0.0, deviation: ArrayLike = 1.0, size: int | tuple[int, ...] | None = None
    ) -> Array:
        """Return (k, *size) normally distributed numbers; size is that of the arguments by default."""
        mean, deviation = np.asarray(mean, dtype=float), np.asarray(deviation, dtype=float)
        shape = _shape(size, np.broadcast_shapes(mean.shape, deviation.shape))
        drawn = np.array([s.standard_normal(shape) for s in self.streams]).reshape(len(self), *shape)
        return mean + deviation * drawn

    def integers(self, low: int, high: int, size: int | tuple[int, ...] | None = None) -> np.ndarray:
        """Return (k, *size) whole numbers from low to high, both included."""
        shape = _shape(size, ())
        return np.array([s.integers(low, high, shape, endpoint=True) for s in self.streams]).reshape(
            len(self), *shape
        )

    def yaw_quaternion(self, low: float = -np.pi, high: float = np.pi) -> Array:
        """Return (k, 4) quaternions x, y, z, w of turns about z between two angles (rad)."""
        half = self.uniform(low, high) / 2
        zero = np.zeros_like(half)
        return np.stack([zero, zero, np.sin(half), np.cos(half)], axis=-1)


def _shape(size: int | tuple[int, ...] | None, default: tuple[int, ...]) -> tuple[int, ...]:
    if size is None:
        return default
    return (size,) if isinstance(size, int) else size
