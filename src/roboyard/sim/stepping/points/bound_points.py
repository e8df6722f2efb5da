"""Points of contacts in arrays that follow the bodies of a world, and saved ones."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard._records import dataclass
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.impulses.point_arrays import (
    Content,
    CreationOrder,
    content_of,
    forget_points,
    has_room,
    make_points,
    no_points,
    start_again,
    write_content,
)
from roboyard.sim.stepping.impulses.records import (
    CHECKED,
    FULL,
    GIVEN,
    LINKS,
    LISTED,
    PAIRS,
    RANKED,
    REFRESHED,
    RENUMBERED,
    SORTED,
    TABLE,
    Points,
)  # fmt: skip
from roboyard.sim.stepping.narrow_phase.fields import Fields
from roboyard.sim.stepping.narrow_phase.kept_fields import kept_fields
from roboyard.sim.stepping.points.kept_points import (
    KeptPoints,
    MetPairs,
    creation_order,
    owners_of_geoms,
    owners_of_links,
    without,
)
from roboyard.sim.stepping.triangle_windows import TriangleWindows
from roboyard.transforms import Array

changes = lazy_module("roboyard.sim.stepping.manifold_changes")
renumbering = lazy_module("roboyard.sim.stepping.broad_phase.renumbering")
face_contacts = lazy_module("roboyard.sim.stepping.face_contacts")

FIRST_CONTACTS = 24
"""Contacts for which a world has room before it has more."""
_MULTIPLE = int(mujoco.mjtDisableBit.mjDSBL_MULTICCD)
_OWNERS, _SETS = "owners of geoms", 4
"""Name in `Engine.of_arrays`, and number of sets of bodies that are kept."""
_POINTS = "points of contacts"
"""Name in `Engine.of_arrays`."""
_STATES = 8
"""Saved states of which it is kept what was written, for programs that restore the same again and again."""
_NO_GEOMS = np.zeros(0, np.int32)
_MOST = 2**30
"""Largest place that is taken from a file."""
_REFRESHES = 1024
"""Changes of filters between two steps that are followed in their order at least; of more, the last ones."""


class BoundPoints:
    """The points that pairs keep, bound to MuJoCo's arrays, as bodies come and go and states are restored."""

    def __init__(self, world: Engine[Body], windows: TriangleWindows) -> None:
        self._world, self._windows = world, windows
        self._bound: _Bound | None = None
        self._former: _Bound | None = None
        """The arrays that were bound, where only a state was restored since."""
        self._kept: KeptPoints | None = None
        """The points until arrays are bound again, where bodies were added or removed."""
        self._written: dict[int, tuple[KeptPoints | None, _Written]] = {}
        """Saved points by their id, with what was written of them into the arrays that are bound."""
        self._refreshed: deque[tuple[int, int | None]] = deque(maxlen=_REFRESHES)
        """Bodies and links whose filters changed since the last step, in order; None for all links."""
        self._ended = set[tuple[int, int | None]]()
        """Those of them whose points have ended."""
        self._ranges: dict[tuple[int, int | None], tuple[int, int]] = {}
        """Of bodies and links, until others come or go."""
        self.points = no_points()
        """The points, as arguments of compiled loops."""
        self._has_old_turns = False
        """Whether links came, went or got filters since their turns were written."""
        self._new = dict[int, np.ndarray]()
        """Links of bodies, by id, that may not have been in a step, as MuJoCo's bodies."""

    @property
    def keeps(self) -> bool:
        """Whether points are kept in this world, once `prepare` has been called."""
        return self._bound is not None and self._bound.keeps

    @property
    def pair_count(self) -> int:
        """Number of pairs with points, once `prepare` has been called."""
        return self.points.notes.item(PAIRS)

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new, or that bodies were added or removed."""
        if self._bound is not None:
            self._kept = self.save()
            self._bound = None
            self._ended.clear()
            self._ranges.clear()
            if not self.points.notes[REFRESHED]:
                self._refreshed.clear()
        self._former = None

    def refresh(self, body: int, link: int | None = None) -> None:
        """Note that a filter of a link, or of all links of a body (by id), was set.

        Their points end. Their pairs get a new place in the order of solution, at the next step.
        """
        bound, points, refreshed = self._bound, self.points, self._refreshed
        if bound is None:
            refreshed.append((body, link))
            if self._kept is not None and (body, link) not in self._ended:
                self._kept = without(self._kept, body, link)
                self._ended.add((body, link))
            return
        if not points.notes[REFRESHED]:
            refreshed.clear()
            self._ended.clear()
        refreshed.append((body, link))
        self._add_refreshed((body, link))
        if (body, link) in self._ended:
            return
        self._ended.add((body, link))
        table, count = points.notes.item(TABLE), points.notes.item(PAIRS)
        if not count:
            return
        found = self._ranges.get((body, link))
        if found is None:
            found = self._ranges[(body, link)] = self._range_of(body, link)
        first, stop = found
        if first < stop:
            kept = points.keys, points.counts, points.points, points.ages
            points.notes[PAIRS] = changes().end_points(*kept, table, count, first, stop)

    def _add_refreshed(self, entry: tuple[int, int | None]) -> None:
        """Write one more link, or all of a body, whose filters changed."""
        added, points = self._links_of(*entry), self.points
        count, room = points.notes.item(REFRESHED), points.refreshed
        if count + len(added) > len(room):
            kept = room[max(count - _REFRESHES, 0) : count].copy()
            count = len(kept)
            if len(room) < 2 * (count + len(added)):
                room = np.zeros(max(2 * (count + len(added)), 16), np.int32)
                self.points = points._replace(refreshed=room)
            room[:count] = kept
        room[count : count + len(added)] = added
        points.notes[REFRESHED] = count + len(added)
        self._has_old_turns = True

    def _links_of(self, body: int, link: int | None) -> np.ndarray:
        """Return one or all links of a body as MuJoCo's bodies."""
        links = self._world.body_by_id[body].mujoco_ids
        return links if link is None else links[link : link + 1]

    def _range_of(self, body: int, link: int | None) -> tuple[int, int]:
        """Return the first and the last place, plus 1, of a link's geoms in the order of creation."""
        rows, ages = self._world.body_by_id[body].geom_rows, self.points.ages
        geoms = [row for of_link in rows for row in of_link] if link is None else rows[link]
        return (ages.item(geoms[0]), ages.item(geoms[-1]) + 1) if geoms else (0, 0)

    def _write_refreshed(self) -> None:
        """Write the links whose filters changed, for the next step; of very many the last ones."""
        there = self._world.body_by_id
        links = [self._links_of(*entry) for entry in self._refreshed if entry[0] in there]
        found = np.concatenate([_NO_GEOMS, *links]).astype(np.int32)[-_REFRESHES:]
        self.points = self.points._replace(refreshed=found)
        self.points.notes[REFRESHED] = len(found)

    def change(self, body: Body, *, is_there: bool) -> None:
        """Note that rows of MuJoCo's arrays, which stay, became a body's or are no longer one's.

        Args:
            body: the body.
            is_there: whether the rows are its own from now on.
        """
        bound = self._bound
        self._former = None
        self._written.clear()
        if bound is None:
            return
        if not bound.keeps:
            self.invalidate()
            return
        owners, geoms = bound.owners, list[int]()
        for link, rows in enumerate(body.geom_rows):
            for place, geom in enumerate(rows):
                owners[geom] = (body.id, link, place) if is_there else -1
            geoms += rows
        ids = body.mujoco_ids.tolist()
        for link, row in enumerate(ids):
            bound.link_owners[row] = (body.id, link) if is_there else -1
        links, rows = np.array(ids, np.int32), np.array(geoms, np.int32)
        changed = (_NO_GEOMS, rows, _NO_GEOMS, links) if is_there else (rows, _NO_GEOMS, links, _NO_GEOMS)
        renumbering().renumber(self.points, bound.body_trees, bound.geoms[1], *changed)
        self._has_old_turns = True
        self._ranges.clear()
        if is_there:
            self._new[body.id] = links
        else:
            self._new.pop(body.id, None)
        if self.points.notes[REFRESHED]:
            self._write_refreshed()

    def save(self) -> KeptPoints | None:
        """Return a copy of all points; None where there are none."""
        bound = self._bound
        if bound is None:
            return self._kept
        now = self.points
        count, table, listed, ranked, links = now.notes[[PAIRS, TABLE, LISTED, RANKED, LINKS]].tolist()
        order = now.links[:links]
        order = order[now.leaves[order] >= 0]
        if not count and not len(order):
            return None
        keys = now.keys[table, :count]
        pairs = np.stack([keys // len(bound.owners), keys % len(bound.owners)], axis=1)
        return KeptPoints(
            owners=bound.owners[pairs],
            counts=now.counts[table, :count].copy(),
            points=now.points[table, :count].copy(),
            met=MetPairs(
                pairs=bound.link_owners[now.pairs[:2, :listed].T],
                states=now.pairs[2, :listed].copy(),
                ranked=bound.owners[now.ranked[:2, :ranked].T],
                ends=now.ranked[2, :ranked].copy(),
                checked=int(now.notes[CHECKED]),
                links=bound.link_owners[order],
                leaves=now.leaves[order],
                nodes=now.nodes.copy(),
                ties=now.ties.copy(),
                tree=now.tree.copy(),
            ),
        )

    def restore(self, kept: KeptPoints | None) -> None:
        """Go on with the points that were saved, or with none."""
        if self._bound is not None:
            self._former = self._bound
        self._kept, self._bound = kept, None

    def grow(self, contacts: int) -> None:
        """Make room for the points of so many contacts, and for more pairs where there was none left."""
        points = self.points
        room, meeting = points.keys.shape[1], points.pairs.shape[1]
        is_full = bool(points.notes[FULL])
        if room >= contacts and not is_full:
            return
        order = CreationOrder(*(getattr(points, name) for name in CreationOrder._fields))
        grown = make_points(order, max(2 * contacts, room), 2 * meeting if is_full else meeting)
        for old, new in (
            (points.keys, grown.keys),
            (points.counts, grown.counts),
            (points.points, grown.points),
            (points.pairs, grown.pairs),
            (points.ranked, grown.ranked),
        ):
            new[:, : old.shape[1]] = old
        grown.slots[: len(points.slots)] = points.slots
        kept = ("entered", "tight", "written", "bounds", "seats", "leaves", "nodes", "ties", "tree", "stack")
        grown = grown._replace(**{name: getattr(points, name) for name in kept})
        if len(points.refreshed):
            grown = grown._replace(refreshed=points.refreshed)
        grown.notes[:] = points.notes
        grown.notes[[FULL, RENUMBERED, SORTED]] = 0, 2, 0
        self.points = self._world.of_arrays[_POINTS] = grown
        self._world.drop_prepared()

    def _bind(self, model: Any, data: Any) -> None:
        former, keeps = self._former, not self._windows.shows_slots
        self._former = None
        if former is not None and former.keeps == keeps:
            self._bind_again(former)
        else:
            self._bind_new(model, data, keeps=keeps)

    def _bind_new(self, model: Any, data: Any, *, keeps: bool) -> None:
        """Bind MuJoCo's arrays and make new ones for the points."""
        world = self._world
        self._written.clear()
        self._has_old_turns = True
        if keeps:
            model.opt.disableflags |= _MULTIPLE
            if model.nmesh:
                face_contacts().install(model, data)
        else:
            model.opt.disableflags &= ~_MULTIPLE
        owners, link_owners, order = self._orders_of(model)
        self._bound = _Bound(
            keeps=keeps,
            geoms=(model.geom_type, model.geom_bodyid),
            frames=(data.xpos, data.xmat),
            fields=kept_fields(world),
            owners=owners,
            link_owners=link_owners,
            body_trees=model.body_treeid,
            seen=2 * world.profile.contact_margin,
        )
        kept, self._kept = self._kept, None
        self._new = {}
        old, items = self.points, max(len(order.links), len(order.turns))
        met = (0, 0, 0) if kept is None else (*map(len, (kept.met.states, kept.met.ranked, kept.met.nodes)),)
        every = items * (items - 1) // 2  # of all links or shapes, those of no body yet, too
        meeting = min(every, max(16 * items, 4096))
        pairs = max(old.keys.shape[1], min(every, FIRST_CONTACTS))
        room = pairs, max(meeting, old.pairs.shape[1], *met[:2], 16)
        made: Points | None = world.of_arrays.get(_POINTS)
        if made is None or not has_room(made, *room, nodes=met[2]):
            self.points = make_points(order.copy(), *room, met[2])
        else:  # of other bodies, or of the world that this one replaces
            start_again(made, order)
            self.points = made
        world.of_arrays[_POINTS] = self.points
        if kept is not None:
            self._take(kept, self._bound)
        if keeps:
            self._note_new(link_owners)
        if self._refreshed:
            self._write_refreshed()

    def _bind_again(self, bound: _Bound) -> None:
        """Write a restored state's points into the arrays that were bound before."""
        kept, self._kept, self._bound = self._kept, None, bound
        self._has_old_turns = True
        known = self._written.get(id(kept))
        if known is None:
            forget_points(self.points)
            if kept is not None:
                self._take(kept, bound)
            if bound.keeps:
                self._note_new(bound.link_owners)
            written = _Written(content_of(self.points), self._new)
            self._written[id(kept)] = kept, written
            while len(self._written) > _STATES:
                del self._written[next(iter(self._written))]
        else:
            write_content(self.points, known[1].content)
            self._new = known[1].new
        self._new = self._new.copy()
        if self._refreshed:
            self._write_refreshed()

    def _note_new(self, owners: np.ndarray) -> None:
        """Note the bodies some of whose links have no boxes yet."""
        bodies = self._world.body_by_id
        found = set(owners[self.points.leaves < 0, 0].tolist()) - {-1}
        self._new = {key: bodies[key].mujoco_ids.astype(np.int32) for key in sorted(found)}

    def _orders_of(self, model: Any) -> tuple[np.ndarray, np.ndarray, CreationOrder]:
        """Return owners of geoms and links and their order, kept for the last few sets of bodies."""
        world = self._world
        kept = world.of_arrays.setdefault(_OWNERS, {})
        bodies = tuple(body.mujoco_ids.tobytes() for body in world.body_by_id.values())
        found = kept.get(bodies)
        if found is None:
            places = owners_of_geoms(world, model.ngeom)
            found = kept[bodies] = (
                places,
                owners_of_links(world, model.nbody),
                creation_order(world, places, model),
            )
            while len(kept) > _SETS:
                del kept[next(iter(kept))]
        owners, link_owners = found[0].copy(), found[1].copy()
        if bodies:
            numbers = np.array(list(world.body_by_id))
            for named in owners, link_owners:
                has_owner = named[:, 0] >= 0
                named[has_owner, 0] = numbers[named[has_owner, 0]]
        return owners, link_owners, found[2]

    def _take(self, kept: KeptPoints, bound: _Bound) -> None:
        """Write points under the present numbers of their geoms; those of bodies that are gone end."""
        number = {tuple(o): geom for geom, o in enumerate(bound.owners.tolist()) if o[0] >= 0}
        self.grow(len(kept.counts))
        points = self.points
        for row, (one, two) in enumerate(kept.owners.tolist() if bound.keeps else []):
            a, b = number.get(tuple(one)), number.get(tuple(two))
            if a is None or b is None:
                continue
            at = points.notes[PAIRS]
            points.keys[0, at] = a * len(bound.owners) + b
            points.counts[0, at], points.points[0, at] = kept.counts[row], kept.points[row]
            points.notes[PAIRS] += 1
        self._take_order(kept.met, number, bound)

    def _take_order(self, met: MetPairs, number: dict[tuple[int, ...], int], bound: _Bound) -> None:
        """Write the order of pairs and the tree of boxes, under the numbers of their links and geoms."""
        points = self.points
        links = {tuple(o): link for link, o in enumerate(bound.link_owners.tolist()) if o[0] >= 0}
        gone, left = met.ended(set(links))
        points.nodes[: len(met.nodes)], points.ties[: len(met.ties)] = met.nodes, met.ties
        points.tree[:] = met.tree
        nodes = dict(zip(map(tuple, met.links.tolist()), met.leaves.tolist(), strict=True))
        renumbering().take_leaves(
            points,
            np.array([nodes[link] for link in (*gone, *left.links)], np.int32),
            np.array([-1] * len(gone) + [links[link] for link in left.links], np.int32),
            bound.body_trees,
        )
        # a file may name links and shapes that are not there, and pairs twice
        pairs = {
            (*sorted((links[one], links[two])),): state
            for one, two, state in left.pairs
            if one != two and one in nodes and two in nodes and one in links and two in links
        }
        ranked = {
            (*sorted((number[one], number[two])),): end
            for one, two, end in left.ranked
            if one != two and one in number and two in number
        }
        points.pairs[:, : len(pairs)] = np.reshape(
            [(*pair, state) for pair, state in pairs.items()], (-1, 3)
        ).T
        points.ranked[:2, : len(ranked)] = np.reshape([*ranked], (-1, 2)).T
        points.ranked[2, : len(ranked)] = [*ranked.values()]
        points.notes[[LISTED, RANKED, RENUMBERED]] = len(pairs), len(ranked), 2
        points.notes[GIVEN] = max(ranked.values(), default=-1) + 1
        points.notes[CHECKED] = min(max(met.checked, 0), _MOST)  # pairs end before it without moving it


@dataclass(frozen=True, slots=True)
class _Bound:
    """MuJoCo's arrays, which hold until the next compile."""

    keeps: bool
    """Whether points are kept in this world."""
    geoms: tuple[np.ndarray, ...]
    frames: tuple[Array, ...]
    fields: Fields
    owners: np.ndarray
    """(ngeom, 3) body, link and place in the link of each geom."""
    link_owners: np.ndarray
    """(nbody, 2) body and link of MuJoCo's bodies, -1 for none."""
    body_trees: np.ndarray
    """(nbody,) tree of each of MuJoCo's bodies, -1 for what is fixed."""
    seen: float
    """Gap (m) up to which MuJoCo finds contacts."""


@dataclass(frozen=True, slots=True)
class _Written:
    """The numbers of a saved state that were written."""

    content: Content
    new: dict[int, np.ndarray]
    """Links of bodies, by id, that had no boxes, as MuJoCo's bodies."""
