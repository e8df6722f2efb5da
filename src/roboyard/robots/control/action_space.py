"""The bounds of a robot's actions, and the slice of each group."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ActionSpace:
    """Like a Gymnasium Box: `low`, `high`, `shape`, `sample`, `contains`."""

    low: Array
    """(n,) lower bounds, -inf where commands are not limited."""
    high: Array
    """(n,) upper bounds, inf where commands are not limited."""
    slices: Mapping[str, slice]
    """Group to the slice of its command in an action."""

    @property
    def shape(self) -> tuple[int]:
        """Shape of an action, (n,)."""
        return (len(self.low),)

    def sample(self, rng: np.random.Generator | None = None) -> Array:
        """Return an (n,) action with uniformly random numbers; those without bounds are between -1 and 1."""
        rng = np.random.default_rng() if rng is None else rng
        low = np.where(np.isfinite(self.low), self.low, -1.0)
        high = np.where(np.isfinite(self.high), self.high, 1.0)
        return rng.uniform(low, high)

    def contains(self, action: ArrayLike) -> bool:
        """Return whether an (n,) action has the right length and is within the bounds."""
        values = np.asarray(action, dtype=float)
        return values.shape == self.shape and bool(((values >= self.low) & (values <= self.high)).all())
