"""The forms of shapes where contacts follow the rules of an impulse engine."""

from __future__ import annotations

import numpy as np

from roboyard._records import dataclass
from roboyard.transforms import Array

PLACED = 1 << 28
"""Among MuJoCo's flags of what is disabled one that it does not know: contacts of known forms are placed
after its search, which only has to see them."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ShapeForms:
    """Boxes, edges and hulls of all geoms; of none where contacts are MuJoCo's."""

    boxes: Array
    """(ngeom, 4, 3) middle and three half axes of the box around each shape, in the frame of its body (m)."""
    covers: Array
    """(nbody, 5, 3) middle and three half axes of the box around all shapes of each link, in the frame of its
    body, and half the size along the world's axes that comes in addition (m); see `place_box`."""
    parts: Array
    """(ngeom, 5, 3) the same of the box that is looked at of each shape where one of two is of a compound."""
    compound: np.ndarray
    """(ngeom,) 1 for the parts of compounds, 2 for those of compounds within these, else 0."""
    visits: np.ndarray
    """(ngeom, 2) of each link's n-th geom, the place in the link of the one that is visited as the n-th; of
    the n-th node of its tree of parts, from the root down, how many parts are on the side that is visited
    first, below 0 for nodes of a compound within another; see `rank_pair`."""
    rounding: Array
    """(ngeom,) radii of the edges (m), 0 for shapes without."""
    hulls: Array
    """(n, 3) corners of all convex hulls in the frames of their bodies (m)."""
    spans: np.ndarray
    """(ngeom, 2) first corner and number of corners of each geom's hull, none where it has none."""


def no_forms() -> ShapeForms:
    """Return the forms of no geoms."""
    return ShapeForms(
        boxes=np.zeros((0, 4, 3)),
        covers=np.zeros((0, 5, 3)),
        parts=np.zeros((0, 5, 3)),
        compound=np.zeros(0, np.uint8),
        visits=np.zeros((0, 2), np.int32),
        rounding=np.zeros(0),
        hulls=np.zeros((0, 3)),
        spans=np.zeros((0, 2), np.int32),
    )
