"""Points that pairs of shapes keep: as they are saved, and room for those of a world."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard._records import dataclass
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.face_corners import SCRATCH
from roboyard.sim.stepping.impulses.records import (
    LISTED,
    NOTES,
    PAIRS,
    RANKED,
    RENUMBERED,
    SHAPES,
    WORK,
    Points,
)  # fmt: skip
from roboyard.sim.stepping.narrow_phase.field_kernels import WORK as SEARCHED
from roboyard.transforms import Array


@dataclass(frozen=True, slots=True)
class MetPairs:
    """The pairs whose boxes meet after a step, in their order; see `meet`."""

    owners: np.ndarray
    """(n, 2, 3) body, link and place in the link of the pairs' shapes."""
    ranks: np.ndarray
    """(n,) int32 ranks in the order of solution, -1 for none."""
    checked: int
    """Which of them is checked next for whether it ended."""
    shapes: np.ndarray
    """(m, 3) body, link and place in the link of all shapes."""
    boxes: Array
    """(m, 6) boxes that the shapes are in (m)."""


@dataclass(frozen=True, slots=True)
class KeptPoints:
    """The points of all pairs after a step."""

    owners: np.ndarray
    """(n, 2, 3) body, link and place in the link of the pairs' shapes."""
    counts: np.ndarray
    """(n,) number of points."""
    points: Array
    """(n, 4, 17) places in the frames of both links (m), contact frame, 1 where it did not slide, gap (m)."""
    met: MetPairs


def without(kept: KeptPoints, body: int, link: int | None) -> KeptPoints:
    """Return kept points but for those of a link, or of all links of a body (by id)."""
    ended = kept.owners[:, :, 0] == body
    if link is not None:
        ended &= kept.owners[:, :, 1] == link
    left = ~ended.any(axis=1)
    return KeptPoints(kept.owners[left], kept.counts[left], kept.points[left], kept.met)


@cache
def no_points() -> Points:
    """Return room for no points, which nothing is written into."""
    return make_points(np.zeros(0, np.int32), np.zeros(0, np.int32), 0, 0)


def make_points(turns: np.ndarray, tree_places: np.ndarray, pairs: int, meeting: int) -> Points:
    """Return room for the points of so many pairs, and for so many pairs whose boxes meet.

    Args:
        turns: (ngeom,) as of `Points`.
        tree_places: (ntree,) as of `Points`.
        pairs: number of pairs with points.
        meeting: number of pairs whose boxes meet.
    """
    geoms, notes = len(turns), np.zeros(NOTES, np.int64)
    new, ages = np.zeros((geoms, 6)), np.zeros(geoms, np.int32)
    new[:, 0], notes[SHAPES] = 1.0, _write_ages(turns, ages)
    return Points(
        kinds=_kinds_that_keep(),
        keys=np.zeros((2, pairs), np.int64),
        counts=np.zeros((2, pairs), np.int32),
        points=np.zeros((2, pairs, 4, 17)),
        fresh=np.zeros(max(SCRATCH, SEARCHED)),
        source=np.zeros(4 * pairs, np.int32),
        extra=np.zeros((4 * pairs, 13)),
        slots=np.full(5 * pairs, -1, np.int32),
        turns=turns,
        ages=ages,
        tree_places=tree_places,
        tight=np.zeros((geoms, 6)),
        wide=new,
        seats=np.full((geoms, 3), np.inf),
        pairs=np.zeros((3, meeting), np.int32),
        ranked=np.zeros(meeting, np.int32),
        table=np.full(1 << (2 * meeting).bit_length(), -1, np.int32),
        work=np.zeros((WORK, meeting), np.int32),
        following=np.zeros(5 * pairs, np.int32),
        sequence=np.zeros(5 * pairs, np.int32),
        listing=np.zeros(5 * pairs, np.int32),
        refreshed=np.zeros((0, 2), np.int32),
        notes=notes,
    )


def _write_ages(turns: np.ndarray, ages: np.ndarray) -> int:
    """Write the place of each geom in an order, where ages are 0; return the number of geoms in it."""
    shapes = int(np.count_nonzero(turns >= 0))
    ages[turns[:shapes]] = np.arange(shapes)
    return shapes


def start_again(points: Points, turns: np.ndarray, tree_places: np.ndarray) -> None:
    """Leave the arrays of other bodies as `make_points` would make them, but for room.

    Args:
        points: the arrays.
        turns: (ngeom,) as of `Points`.
        tree_places: (ntree,) as of `Points`.
    """
    points.turns[:], points.tree_places[:], points.ages[:] = turns, tree_places, 0
    points.notes[SHAPES] = _write_ages(turns, points.ages)
    forget_points(points)


@dataclass(frozen=True, slots=True)
class Content:
    """The content of the arrays of `Points` before a step, in as many of their columns as are used."""

    keys: np.ndarray
    counts: np.ndarray
    points: Array
    pairs: np.ndarray
    ranked: np.ndarray
    wide: Array
    notes: np.ndarray


def forget_points(points: Points) -> None:
    """Leave the arrays as `make_points` returns them, but for room and order of the geoms."""
    shapes = points.notes.item(SHAPES)
    points.notes[:], points.wide[:], points.wide[:, 0] = 0, 0.0, 1.0
    points.notes[SHAPES], points.notes[RENUMBERED] = shapes, 1  # so that the table of pairs is emptied
    _forget_boxes(points)


def _forget_boxes(points: Points) -> None:
    points.tight[:], points.seats[:], points.slots[:] = 0.0, np.inf, -1


def content_of(points: Points) -> Content:
    """Return a copy of what the arrays hold, where no step was taken since `forget_points`."""
    pairs, listed, ranked = points.notes[[PAIRS, LISTED, RANKED]].tolist()
    return Content(
        keys=points.keys[0, :pairs].copy(),
        counts=points.counts[0, :pairs].copy(),
        points=points.points[0, :pairs].copy(),
        pairs=points.pairs[:, :listed].copy(),
        ranked=points.ranked[:ranked].copy(),
        wide=points.wide.copy(),
        notes=points.notes.copy(),
    )


def write_content(points: Points, content: Content) -> None:
    """Write what the arrays held."""
    pairs, listed, ranked = len(content.keys), content.pairs.shape[1], len(content.ranked)
    points.notes[:], points.wide[:] = content.notes, content.wide
    if pairs:
        points.keys[0, :pairs], points.counts[0, :pairs] = content.keys, content.counts
        points.points[0, :pairs] = content.points
    points.pairs[:, :listed], points.ranked[:ranked] = content.pairs, content.ranked
    _forget_boxes(points)


def owners_of_geoms(world: Engine[Body], count: int) -> np.ndarray:
    """Return (ngeom, 3) body, as a number from 0 on, link and place in the link of each geom; -1 for none."""
    owners, geoms, places = np.full((count, 3), -1), list[int](), list[tuple[int, int, int]]()
    for number, body in enumerate(world.body_by_id.values()):
        for link, rows in enumerate(body.geom_rows):
            geoms += rows
            places += [(number, link, place) for place in range(len(rows))]
    if geoms:
        owners[geoms] = places
    return owners


def creation_order(owners: np.ndarray, model: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return bodies' geoms in the order in which these were made, and (ntree,) each tree's place in it.

    Of the (ngeom,) first numbers the last are -1 where geoms have no body.
    """
    turns = np.lexsort((owners[:, 2], owners[:, 1], owners[:, 0])).astype(np.int32)
    loose = np.count_nonzero(owners[:, 0] < 0)
    turns = turns[loose:].copy()
    trees = model.body_treeid[model.geom_bodyid[turns]]
    first = np.full(model.ntree, len(turns))
    np.minimum.at(first, trees[trees >= 0], np.flatnonzero(trees >= 0))
    places = np.empty(model.ntree, np.int32)
    places[np.argsort(first, kind="stable")] = np.arange(model.ntree)
    return np.concatenate([turns, np.full(loose, -1, np.int32)]), places


@cache
def _kinds_that_keep() -> np.ndarray:
    """Return (8, 8) 1 for pairs of geom types that keep points: all but two balls, as in Bullet."""
    kinds = mujoco.mjtGeom
    convex = [
        int(kind)
        for kind in (
            kinds.mjGEOM_CAPSULE,
            kinds.mjGEOM_ELLIPSOID,
            kinds.mjGEOM_CYLINDER,
            kinds.mjGEOM_BOX,
            kinds.mjGEOM_MESH,
        )
    ]
    keep = np.zeros((8, 8), np.uint8)
    keep[np.ix_(convex, convex)] = 1
    sphere = int(kinds.mjGEOM_SPHERE)
    keep[sphere, convex] = keep[convex, sphere] = 1
    surfaces = [int(kinds.mjGEOM_PLANE), int(kinds.mjGEOM_HFIELD)]  # of each prism of one it finds one
    keep[np.ix_(surfaces, [sphere, *convex])] = keep[np.ix_([sphere, *convex], surfaces)] = 1
    return keep
