"""Inertia tensors that no body has, changed as little as makes them possible."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from roboyard.shapes.inertia import Array

ROD_RATIO = 1e-3
"""Least moment of a rod / its largest, where a file rounds the least to zero; that of a rod 39 times longer
than thick is about this.
"""


def rod_inertia(inertia: ArrayLike) -> Array | None:
    """The (3, 3) tensor of a rod of no thickness, its least moment raised to `ROD_RATIO` of the largest.

    None for any other tensor: one that no body comes near to, or that needs no change.
    """
    moments, axes = np.linalg.eigh(np.asarray(inertia, dtype=float))
    small, middle, large = moments
    if not (large > 0 and abs(small) <= 1e-9 * large and large - middle <= ROD_RATIO * large):
        return None
    moments[0] = ROD_RATIO * large
    return (axes * moments) @ axes.T


def valid_inertia(inertia: ArrayLike) -> Array | None:
    """The (3, 3) tensor with its two smaller principal moments raised equally until they add up to the third.

    None for a tensor that needs no change, and for one whose moments are not positive.
    """
    moments, axes = np.linalg.eigh(np.asarray(inertia, dtype=float))
    small, middle, large = moments
    if small <= 0 or small + middle >= large:
        return None
    moments[:2] += (large - small - middle) / 2 * (1.0 + 1e-6)
    return (axes * moments) @ axes.T
