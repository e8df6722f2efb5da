"""The shapes of a body, and where they are among MuJoCo's geoms."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from roboyard._records import dataclass
from roboyard.pybullet.bullet_rules.contact_order import CONVEX, NESTED, visits_of
from roboyard.pybullet.bullet_rules.mesh_objects import split_geometry
from roboyard.pybullet.bullet_rules.placed_shapes.boxes import (
    ENDLESS_BOX,
    ENDLESS_COVER,
    NO_HULL,
    ShapeBoxes,
)
from roboyard.pybullet.bullet_rules.placed_shapes.plain_shapes import PlainShape, boxes_of
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.pybullet.bullet_rules.models import LinkModel

_ONE_LENGTH, _NO_COMPOUND, _FIRST_VISIT = (
    np.zeros(1, np.int32),
    np.zeros(1, np.uint8),
    np.zeros((1, 2), np.int32),
)


@dataclass(frozen=True, slots=True, eq=False)
class PlacedShapes:
    """The shapes of one body, and where they are among MuJoCo's geoms."""

    geoms: list[int]
    rows: slice | np.ndarray
    """The geoms as places in arrays, a slice where one follows the other."""
    boxes: np.ndarray
    """(n, 4, 3) as in `ShapeBoxes`."""
    covers: np.ndarray
    """(k, 5, 3) boxes around the links; see `ShapeForms`."""
    parts: np.ndarray
    """(n, 5, 3) boxes around the shapes; see `ShapeForms`."""
    rounding: np.ndarray
    """(n,) radius of the edges (m)."""
    hulls: tuple[np.ndarray, ...]
    lengths: np.ndarray
    """(n,) numbers of corners of the hulls."""
    has_hulls: bool
    compound: np.ndarray
    """(n,) 1 for the parts of compounds, 2 for those of compounds within these, else 0."""
    visits: np.ndarray
    """(n, 2) as in `ShapeForms`."""

    def at(self, links: Sequence[Sequence[int]]) -> PlacedShapes:
        """Return the same shapes at other geoms, as many of each link."""
        geoms = [row for rows in links for row in rows]
        return PlacedShapes(
            geoms=geoms,
            rows=_places(geoms),
            boxes=self.boxes,
            covers=self.covers,
            parts=self.parts,
            rounding=self.rounding,
            hulls=self.hulls,
            lengths=self.lengths,
            has_hulls=self.has_hulls,
            compound=self.compound,
            visits=self.visits,
        )


def place_shapes(
    found: ShapeBoxes,
    links: Sequence[Sequence[int]],
    compound: np.ndarray,
    margins: Sequence[float],
    covers: Sequence[Array],
    models: Sequence[LinkModel],
) -> PlacedShapes:
    """Return the shapes of a body.

    Where a shape's place among the geoms is not known, or it is no box, ball or hull, its box is endless.

    Args:
        found: boxes around them.
        links: geoms of each link.
        compound: (n,) as in `PlacedShapes`, for the geoms of all links.
        margins: of the shapes of each link (m), with which edges of boxes and cylinders are round.
        covers: (5, 3) box around each link; see `cover_of`.
        models: the links.
    """
    if tuple(map(len, links)) != found.counts:
        found = _without_unknown(found, links)
    widths = np.repeat(np.asarray(margins, float), [len(rows) for rows in links])
    geoms = [row for rows in links for row in rows]
    around = np.reshape(covers, (-1, 5, 3))
    of_links = around.repeat([len(rows) for rows in links], axis=0)
    return PlacedShapes(
        geoms=geoms,
        rows=_places(geoms),
        boxes=found.boxes,
        covers=around,
        parts=np.where(compound[:, None, None] > 0, found.parts, of_links),
        rounding=np.where(widths < found.edges, widths, 0.0),
        hulls=found.hulls,
        lengths=np.array([len(hull) for hull in found.hulls], np.int32),
        has_hulls=any(map(len, found.hulls)),
        compound=compound,
        visits=_visits(found, links, models, compound),
    )


def _visits(
    found: ShapeBoxes,
    links: Sequence[Sequence[int]],
    models: Sequence[LinkModel],
    compound: np.ndarray,
) -> np.ndarray:
    """Return the order in which the parts of each link are visited; see `ShapeForms`."""
    visits, first = np.zeros((len(compound), 2), np.int32), 0
    for rows, link in zip(links, models, strict=True):
        count = len(rows)
        if count > 1:
            sizes = [1 if shape.concave else len(split_geometry(shape.geometry)) for shape in link.collisions]
            rows_of = slice(first, first + count)
            nests = bool((compound[rows_of] == NESTED - CONVEX).all())
            visits[rows_of] = visits_of(found.parts[rows_of], sizes, link.frame, nests=nests)
        first += count
    return visits


def place_plain(shape: PlainShape, margin: float, row: int) -> PlacedShapes:
    """Return the only shape of a body as `place_shapes` does.

    Args:
        shape: the shape.
        margin: of it (m).
        row: its geom.
    """
    boxes, covers = boxes_of([shape])
    return PlacedShapes(
        geoms=[row],
        rows=slice(row, row + 1),
        boxes=boxes,
        covers=covers,
        parts=covers,
        rounding=np.array([shape.rounding(margin)]),
        hulls=(NO_HULL,),
        lengths=_ONE_LENGTH,
        has_hulls=False,
        compound=_NO_COMPOUND,
        visits=_FIRST_VISIT,
    )


def _without_unknown(found: ShapeBoxes, links: Sequence[Sequence[int]]) -> ShapeBoxes:
    """Return endless boxes for the geoms of links that have more or fewer geoms than shapes."""
    boxes, parts, edges = [np.zeros((0, 4, 3))], [np.zeros((0, 5, 3))], [np.zeros(0)]
    hulls, first = list[np.ndarray](), 0
    for rows, count in zip(links, found.counts, strict=True):
        place = slice(first, first + count)
        first += count
        is_known = len(rows) == count
        boxes.append(
            found.boxes[place] if is_known else np.array([ENDLESS_BOX] * len(rows)).reshape(-1, 4, 3)
        )
        parts.append(found.parts[place] if is_known else np.tile(ENDLESS_COVER, (len(rows), 1, 1)))
        edges.append(found.edges[place] if is_known else np.zeros(len(rows)))
        hulls += found.hulls[place] if is_known else [NO_HULL] * len(rows)
    joined = [np.concatenate(found) for found in (boxes, parts, edges)]
    return ShapeBoxes(joined[0], joined[1], joined[2], tuple(hulls), tuple(map(len, links)))


def _places(geoms: Sequence[int]) -> slice | np.ndarray:
    if geoms and all(b - a == 1 for a, b in pairwise(geoms)):
        return slice(geoms[0], geoms[-1] + 1)
    return np.array(geoms, np.intp)
