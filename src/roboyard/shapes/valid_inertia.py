"""Smallest changes that make an impossible inertia tensor valid."""

from __future__ import annotations

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.shapes.inertia import Array

ROD_RATIO = 1e-3
"""Smallest / largest moment for a rod whose smallest moment was rounded to zero: that of a rod about 39 times
longer than thick.
"""


def rod_inertia(inertia: ArrayLike) -> Array | None:
    """Return a thin rod's (3, 3) tensor (kg m²), its smallest moment raised to `ROD_RATIO` of the largest.

    None for any other tensor, valid or not.
    """
    moments, axes = np.linalg.eigh(np.asarray(inertia, dtype=float))
    small, middle, large = moments
    if not (large > 0 and abs(small) <= 1e-9 * large and large - middle <= ROD_RATIO * large):
        return None
    moments[0] = ROD_RATIO * large
    return (axes * moments) @ axes.T


def valid_inertia(inertia: ArrayLike) -> Array | None:
    """Return the (3, 3) tensor (kg m²) with its two smaller moments raised equally to the sum of the third.

    None for a valid tensor, and for one whose moments are not positive.
    """
    moments, axes = np.linalg.eigh(np.asarray(inertia, dtype=float))
    small, middle, large = moments
    if small <= 0 or small + middle >= large:
        return None
    moments[:2] += (large - small - middle) / 2 * (1.0 + 1e-6)
    return (axes * moments) @ axes.T
