"""Points that pairs of shapes keep, and pairs in their order, as they are saved."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._records import dataclass
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.impulses.point_arrays import CreationOrder
from roboyard.transforms import Array


@dataclass(frozen=True, slots=True)
class MetPairs:
    """The pairs whose boxes meet after a step, in their order; see `meet`."""

    pairs: np.ndarray
    """(n, 2, 2) bodies and links of the pairs."""
    states: np.ndarray
    """(n,) int32, the third row of `Points.pairs`."""
    ranked: np.ndarray
    """(k, 2, 3) bodies, links and places in the links of the shapes at each rank."""
    ends: np.ndarray
    """(k,) int32, the third row of `Points.ranked`."""
    checked: int
    """Which of the pairs is checked next for whether it ended."""
    links: np.ndarray
    """(m, 2) bodies and links in the order in which they are updated."""
    leaves: np.ndarray
    """(m,) int32 their nodes in the tree of boxes."""
    nodes: Array
    ties: np.ndarray
    tree: np.ndarray
    """The tree; see `box_tree`."""

    def ended(self, there: set[tuple[int, ...]]) -> tuple[list[tuple[int, ...]], LeftPairs]:
        """Return the links that are gone, and what is left as if these had been removed in turn.

        Args:
            there: bodies and links that are there.
        """
        links = [tuple(link) for link in self.links.tolist()]
        pairs = [
            (tuple(one), tuple(two), state)
            for (one, two), state in zip(self.pairs.tolist(), self.states.tolist(), strict=True)
        ]
        ranked = [
            (tuple(one), tuple(two), end)
            for (one, two), end in zip(self.ranked.tolist(), self.ends.tolist(), strict=True)
        ]
        gone = sorted(set(links) - there)
        for link in gone:
            place = 0
            while place < len(pairs):
                if link in pairs[place][:2]:
                    _end_ranks(ranked, *pairs[place][:2])
                    _take_out(pairs, place)
                else:
                    place += 1
            _take_out(links, links.index(link))
        return gone, LeftPairs(links, pairs, ranked)


@dataclass(frozen=True, slots=True)
class LeftPairs:
    """Links in the order of updates, pairs with their states, and pairs of shapes by rank with `ends`."""

    links: list[tuple[int, ...]]
    pairs: list[tuple[tuple[int, ...], tuple[int, ...], int]]
    ranked: list[tuple[tuple[int, ...], tuple[int, ...], int]]


def _end_ranks(ranked: list[tuple[tuple[int, ...], tuple[int, ...], int]], *links: tuple[int, ...]) -> None:
    """End the ranks of the shapes of two links in their order."""
    ended = [pair for pair in ranked if {pair[0][:2], pair[1][:2]} == set(links)]
    for pair in sorted(ended, key=lambda pair: pair[2]):
        _take_out(ranked, ranked.index(pair))


def _take_out(items: list[Any], place: int) -> None:
    """Let the last item take the place of one that ends."""
    last = items.pop()
    if place < len(items):
        items[place] = last


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


def owners_of_links(world: Engine[Body], count: int) -> np.ndarray:
    """Return (nbody, 2) body, as a number from 0 on, and link of MuJoCo's bodies; -1 for none."""
    owners = np.full((count, 2), -1)
    for number, body in enumerate(world.body_by_id.values()):
        owners[body.mujoco_ids, 0] = number
        owners[body.mujoco_ids, 1] = np.arange(len(body.mujoco_ids))
    return owners


def creation_order(world: Engine[Body], owners: np.ndarray, model: Any) -> CreationOrder:
    """Return the order of the bodies' shapes and links. owners: (ngeom, 3) as of `owners_of_geoms`."""
    turns = np.lexsort((owners[:, 2], owners[:, 1], owners[:, 0])).astype(np.int32)
    loose = np.count_nonzero(owners[:, 0] < 0)
    turns = turns[loose:].copy()
    own = [body.mujoco_ids for body in world.body_by_id.values()]
    links = np.concatenate([np.zeros(0, np.int32), *own]).astype(np.int32)
    of_geom = model.geom_bodyid[turns]
    sizes = np.bincount(of_geom, minlength=model.nbody).astype(np.int32)
    firsts = np.zeros(model.nbody, np.int32)
    firsts[of_geom[::-1]] = np.arange(len(turns))[::-1]
    trees = model.body_treeid[links]
    first = np.full(model.ntree, len(links))
    np.minimum.at(first, trees[trees >= 0], np.flatnonzero(trees >= 0))
    places = np.empty(model.ntree, np.int32)
    places[np.argsort(first, kind="stable")] = np.arange(model.ntree)
    return CreationOrder(
        turns=np.concatenate([turns, np.full(loose, -1, np.int32)]),
        links=np.concatenate([links, np.full(model.nbody - len(links), -1, np.int32)]),
        firsts=firsts,
        sizes=sizes,
        tree_places=places,
    )
