"""Bodies of one link of one primitive at its inertial frame, whose numbers follow from half sizes."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from roboyard._records import NamedTuple
from roboyard.description.model import Box, Capsule, Cylinder, Sphere
from roboyard.pybullet.bullet_rules.contact_reaches import SHARE
from roboyard.pybullet.bullet_rules.placed_shapes.boxes import ENDLESS

if TYPE_CHECKING:
    from roboyard.pybullet.bullet_rules.models import LinkModel
    from roboyard.pybullet.bullet_rules.shape_bounds import LinkBounds


_PLAIN = frozenset(("solid", "sphere", "cylinder"))
"""Kinds of bounds around one shape at the inertial frame whose box is known by its half sizes."""
_AT_LINK = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)


class PlainShape(NamedTuple):
    """Such a shape."""

    half: tuple[float, float, float]
    """Half sizes of the box around it (m)."""
    is_ball: bool
    edge: float
    """Largest radius of its edges (m), 0 where it has none."""
    reach: float
    """Largest gap of its contact points (m)."""

    def rounding(self, margin: float) -> float:
        """Return the radius of the edges (m) with this margin (m)."""
        return margin if margin < self.edge else 0.0


def plain_shape(links: Sequence[LinkModel], bounds: LinkBounds) -> PlainShape | None:
    """Return the only shape of a body of one link.

    None where the body has more links or shapes, or where these or the centre of mass are not at the link's
    frame.

    Args:
        links: of the body.
        bounds: of its base.
    """
    if len(links) > 1 or bounds.kind not in _PLAIN:
        return None
    frame, (shape, *others) = links[0].frame, links[0].collisions
    if others or shape.concave or not isinstance(shape.geometry, Box | Sphere | Cylinder | Capsule):
        return None
    if (frame.position, frame.quaternion) != _AT_LINK:
        return None
    x, y, z = bounds.corners[1].tolist()
    if not max(x, y, z) < ENDLESS:
        return None
    has_edges = isinstance(shape.geometry, Box | Cylinder)
    return PlainShape(
        half=(x, y, z),
        is_ball=bounds.kind == "sphere",
        edge=min(x, y, z) if has_edges else 0.0,
        reach=SHARE * sqrt(x * x + y * y + z * z),
    )


def boxes_of(shapes: Sequence[PlainShape]) -> tuple[np.ndarray, np.ndarray]:
    """Return the boxes around shapes, (n, 4, 3) as in `ShapeBoxes`, and (n, 5, 3) around their links.

    The latter are also the boxes in which Bullet adds them, and those around them as parts of compounds.
    """
    half, count = np.array([shape.half for shape in shapes]), len(shapes)
    boxes, covers, axes = np.zeros((count, 4, 3)), np.zeros((count, 5, 3)), np.arange(3)
    boxes[:, 1 + axes, axes] = half
    are_balls = np.array([shape.is_ball for shape in shapes], bool)
    covers[:, :4], covers[are_balls, 4] = boxes, half[are_balls]
    covers[are_balls, :4] = 0.0
    return boxes, covers


def write_box(shape: PlainShape, box: np.ndarray, cover: np.ndarray) -> None:
    """Write what `boxes_of` returns of one shape into (4, 3) and (5, 3) arrays."""
    x, y, z = shape.half
    box[:] = 0.0
    box[1, 0], box[2, 1], box[3, 2] = x, y, z
    cover[:4], cover[4] = box, 0.0
    if shape.is_ball:
        cover[:4], cover[4] = 0.0, shape.half
