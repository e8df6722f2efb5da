"""Gaps up to which Bullet keeps the points of a pair, and boxes across whose gaps it does not look.

A pair keeps the points whose gap is below 0.02 of the smaller shape's reach from its inertial frame: half the
diagonal of its box and the distance of the box's centre.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from roboyard.description.model import Box, Collision, Cylinder, Heightfield, Mesh
from roboyard.pybullet.bullet_rules.shape_bounds import LinkBounds, local_bounds
from roboyard.transforms import matrix_from_quaternion

SHARE = 0.02
"""Bullet's contact threshold, as a share of a shape's reach."""
ENDLESS = 1e9
"""Half size (m) of the boxes of other shapes."""


def contact_reaches(model: Any, bounds: Iterable[tuple[int, LinkBounds, float]]) -> np.ndarray:
    """Return the (ngeom,) largest gaps of contact points (m), infinite for planes.

    Args:
        model: MjModel.
        bounds: row of the MuJoCo body, bounds and margin (m) of each link.
    """
    by_row = np.full(model.nbody, np.inf)
    for row, box, margin in bounds:
        if box.kind != "plane":
            by_row[row] = _reach(box, margin)
    return by_row[model.geom_bodyid]


@lru_cache(maxsize=512)
def _reach(box: LinkBounds, margin: float) -> float:
    """Return the largest gap of the points of a link with these bounds and this margin (m)."""
    lower, upper = box.grown(margin)
    return float(SHARE * (np.linalg.norm(upper - lower) / 2 + np.linalg.norm(upper + lower) / 2))


def shape_boxes(
    geoms: int, links: Iterable[tuple[Sequence[Collision], Sequence[int], bool, bool, float]]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (geoms, 4, 3) boxes around shapes, (geoms,) 1 for parts of compounds, (geoms,) radii of edges.

    A box is its middle and three half axes in the frame of the link (m). Where a shape's place among the
    geoms is not known, or it is no box, ball or hull, the box is endless.

    Args:
        geoms: number of geoms.
        links: shapes of each link, their geoms, whether cylinders are exact, whether the link is a compound,
            and the margin of its shapes (m), with which edges of boxes and cylinders are round.
    """
    boxes, compound = np.zeros((geoms, 4, 3)), np.zeros(geoms, np.uint8)
    boxes[:, 1:] = ENDLESS * np.eye(3)
    rounding = np.zeros(geoms)
    for shapes, rows, implicit_cylinder, is_compound, margin in links:
        compound[list(rows)] = is_compound
        if len(shapes) != len(rows):
            continue
        for shape, row in zip(shapes, rows, strict=True):
            known = _box_of(shape, implicit_cylinder)
            if known is not None:
                boxes[row], least = known
                if margin < least:
                    rounding[row] = margin
    return boxes, compound, rounding


_KNOWN = 256
_known: dict[tuple[int, bool], tuple[Collision, tuple[np.ndarray, float] | None]] = {}
"""Boxes of shapes without files, by the id of the shape, which is kept."""


def _box_of(shape: Collision, implicit_cylinder: bool) -> tuple[np.ndarray, float] | None:
    """Return the (4, 3) box around a shape and the largest radius of its edges (m), 0 where it has none."""
    key = id(shape), implicit_cylinder
    if key in _known:
        return _known[key][1]
    found = None
    corners = None if shape.concave else local_bounds(shape.geometry, implicit_cylinder=implicit_cylinder)
    if corners is not None:
        turn, box = matrix_from_quaternion(shape.origin.quaternion), np.empty((4, 3))
        box[0] = np.asarray(shape.origin.position) + turn @ (corners[0] + corners[1]) / 2
        box[1:] = ((corners[1] - corners[0]) / 2)[:, None] * turn.T
        has_edges = isinstance(shape.geometry, Box | Cylinder)
        found = box, float((corners[1] - corners[0]).min() / 2) if has_edges else 0.0
    if not isinstance(shape.geometry, Mesh | Heightfield):
        _known[key] = shape, found
        while len(_known) > _KNOWN:
            del _known[next(iter(_known))]
    return found
