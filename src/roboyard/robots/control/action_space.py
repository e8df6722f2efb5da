"""The box of actions that a robot takes, and which numbers go to which group."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ActionSpace:
    """Like a Gymnasium Box: `low`, `high`, `shape`, `sample`, `contains`."""

    low: Array
    """(n,) -inf where commands are not limited"""
    high: Array
    """(n,)"""
    slices: Mapping[str, slice]
    """Group to its numbers in an action."""

    @property
    def shape(self) -> tuple[int]:
        return (len(self.low),)

    def sample(self, rng: np.random.Generator | None = None) -> Array:
        """(n,) an action drawn evenly; numbers without limits from -1 to 1."""
        rng = np.random.default_rng() if rng is None else rng
        low = np.where(np.isfinite(self.low), self.low, -1.0)
        high = np.where(np.isfinite(self.high), self.high, 1.0)
        return rng.uniform(low, high)

    def contains(self, action: ArrayLike) -> bool:
        """Whether an action has the right length and lies in the box."""
        values = np.asarray(action, dtype=float)
        return values.shape == self.shape and bool(((values >= self.low) & (values <= self.high)).all())
