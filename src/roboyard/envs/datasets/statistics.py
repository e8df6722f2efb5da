"""Statistics of the numbers of a dataset, added in parts, as LeRobot has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


class Statistics:
    """Least, largest, mean and deviation of k numbers, added in parts."""

    def __init__(self, size: int) -> None:
        self._count = 0
        self._least, self._most = np.full(size, np.inf), np.full(size, -np.inf)
        self._sum, self._square = np.zeros(size), np.zeros(size)

    def add(self, values: np.ndarray) -> None:
        """Add (m, k) values."""
        values = values.astype(float)
        self._count += len(values)
        self._least = np.minimum(self._least, values.min(axis=0))
        self._most = np.maximum(self._most, values.max(axis=0))
        self._sum += values.sum(axis=0)
        self._square += (values**2).sum(axis=0)

    def result(self, name: str) -> dict[str, Any]:
        """Return the statistics as LeRobot has them; those of pictures are (3, 1, 1)."""
        mean = self._sum / self._count
        deviation = np.sqrt(np.maximum(self._square / self._count - mean**2, 0.0))
        shape = (3, 1, 1) if name.startswith("observation.images.") else (-1,)
        found = {"min": self._least, "max": self._most, "mean": mean, "std": deviation}
        return {key: value.reshape(shape).tolist() for key, value in found.items()} | {"count": [self._count]}


def merged_statistics(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the statistics of one feature over all parts of a dataset, each as of `Statistics.result`."""
    counts = np.array([part["count"][0] for part in parts], dtype=float)
    share = counts / counts.sum()

    def stacked(key: str) -> np.ndarray:
        return np.array([part[key] for part in parts], dtype=float)

    means, deviations = stacked("mean"), stacked("std")
    weight = share.reshape(-1, *[1] * (means.ndim - 1))
    mean = (weight * means).sum(axis=0)
    square = (weight * (deviations**2 + (means - mean) ** 2)).sum(axis=0)
    return {
        "min": stacked("min").min(axis=0).tolist(),
        "max": stacked("max").max(axis=0).tolist(),
        "mean": mean.tolist(),
        "std": np.sqrt(square).tolist(),
        "count": [int(counts.sum())],
    }
