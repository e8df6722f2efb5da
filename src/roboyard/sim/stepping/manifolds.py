"""Contact points that pairs of convex shapes keep from step to step, as an impulse engine does.

MuJoCo finds all points of such a pair in each step, in the direction of a face where it finds several. Bullet
finds the deepest point only and keeps up to four of earlier steps: a robot that touches an edge is first
pushed at one point, straight away from the surface, and a body that comes to rest has all its points after a
few steps.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard._records import dataclass
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.face_corners import SCRATCH
from roboyard.sim.stepping.impulses.records import (
    CHECKED,
    EXTRA,
    FULL,
    HELD,
    LISTED,
    NOTES,
    PAIRS,
    RANKED,
    REFRESHED,
    RENUMBERED,
    SHAPES,
    SORTED,
    TABLE,
    WORK,
    Points,
)  # fmt: skip
from roboyard.sim.stepping.narrow_phase.field_kernels import WORK as SEARCHED
from roboyard.sim.stepping.narrow_phase.fields import Fields
from roboyard.sim.stepping.narrow_phase.kept_fields import kept_fields
from roboyard.sim.stepping.shape_forms import ShapeForms
from roboyard.sim.stepping.step_rows import StepRows
from roboyard.sim.stepping.triangle_windows import TriangleWindows
from roboyard.transforms import Array

kernels = lazy_module("roboyard.sim.stepping.manifold_kernels")
edge_kernels = lazy_module("roboyard.sim.stepping.narrow_phase.edge_kernels")
boxes = lazy_module("roboyard.sim.stepping.first_boxes")
meeting_pairs = lazy_module("roboyard.sim.stepping.impulses.meeting_pairs")
face_contacts = lazy_module("roboyard.sim.stepping.face_contacts")

_MULTIPLE = int(mujoco.mjtDisableBit.mjDSBL_MULTICCD)
_OWNERS, _SETS = "owners of geoms", 4
"""Name in `Engine.of_arrays`, and number of sets of bodies that are kept."""
_NO_GEOMS = np.zeros(0, np.int32)
_REFRESHES = 1024
"""Most changes of filters between two steps that are followed in their order; of more, the last half."""
_BLANK = mujoco.MjContact()
"""Given to MuJoCo for contacts that are written then."""


FirstBoxes = Callable[[int], "tuple[Array, Array] | None"]
"""Returns the (n, 4, 3) boxes around the shapes of a body, by its id, in the base's frame, and the (7,) pose
of the base when the body was made, as for `write_first_boxes`; None where these are not known."""


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


class Manifolds:
    """The points that pairs of hulls, cylinders and boxes keep in a world with rigid contacts.

    Worlds where triangles of concave meshes have slots are left as they are: each has points of its own.
    """

    def __init__(self, world: Engine[Body], windows: TriangleWindows) -> None:
        self._world, self._windows = world, windows
        self._bound: _Bound | None = None
        self._kept: KeptPoints | None = None
        """The points until arrays are bound again, where bodies were added or removed."""
        self._refreshed: deque[tuple[int, int | None]] = deque(maxlen=_REFRESHES)
        """Bodies and links whose filters changed since the last step, in order; None for all links."""
        self._ended = set[tuple[int, int | None]]()
        """Those of them whose points have ended."""
        self._ranges: dict[tuple[int, int | None], tuple[int, int]] = {}
        """Of bodies and links, until others come or go."""
        self.points = _no_points()
        """The points, as arguments of compiled loops."""
        self.first_boxes: FirstBoxes | None = None
        """Looks up the boxes in which the shapes of bodies were made; without it, these are where the shapes
        are at the first step."""
        self._new = dict[int, np.ndarray]()
        """Geoms of bodies, by id, that may not have been in a step."""

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

    def refresh(self, body: int, link: int | None = None) -> None:
        """Note that a filter of a link, or of all links of a body (by id), was set.

        Their points end. Their pairs get a new place in the order of solution, at the next step.
        """
        bound, points, refreshed = self._bound, self.points, self._refreshed
        if bound is None:
            refreshed.append((body, link))
            if self._kept is not None and (body, link) not in self._ended:
                self._kept = _without(self._kept, body, link)
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
        keys = points.keys[table, :count]
        ended = bound.owners[:, 0] == body
        if link is not None:
            ended &= bound.owners[:, 1] == link
        left = np.flatnonzero(~(ended[keys // len(ended)] | ended[keys % len(ended)]))
        if len(left) < count:
            for rows in (points.keys, points.counts, points.points):
                rows[table, : len(left)] = rows[table, left]
            points.notes[PAIRS] = len(left)

    def _add_refreshed(self, entry: tuple[int, int | None]) -> None:
        """Write the range of geoms of one more link, or body, whose filters changed."""
        found = self._ranges.get(entry)
        if found is None:
            found = self._ranges[entry] = self._range_of(*entry)
        if found[0] == found[1]:
            return
        points = self.points
        count, room = points.notes.item(REFRESHED), points.refreshed
        if count == len(room):
            if count < _REFRESHES:
                grown = np.zeros((max(2 * count, 16), 2), np.int32)
                grown[:count] = room
                self.points, room = points._replace(refreshed=grown), grown
            else:
                count //= 2
                room[:count] = room[-count:]
        room[count] = found
        points.notes[REFRESHED] = count + 1

    def _range_of(self, body: int, link: int | None) -> tuple[int, int]:
        """Return the first and the last place, plus 1, of a link's geoms in the order of creation."""
        rows, ages = self._world.body_by_id[body].geom_rows, self.points.ages
        geoms = [row for of_link in rows for row in of_link] if link is None else rows[link]
        return (ages.item(geoms[0]), ages.item(geoms[-1]) + 1) if geoms else (0, 0)

    def _write_refreshed(self, bound: _Bound) -> None:
        """Write the ranges of geoms whose filters changed, for the next step."""
        owners, turns = bound.owners, self.points.turns[: self.points.notes[SHAPES]]
        ranges = list[tuple[int, int]]()
        for body, link in self._refreshed:
            among = owners[turns, 0] == body
            if link is not None:
                among &= owners[turns, 1] == link
            places = np.flatnonzero(among)
            if len(places):
                ranges.append((int(places[0]), int(places[-1]) + 1))
        if len(ranges) > len(self.points.refreshed):
            room = np.zeros((2 * len(ranges), 2), np.int32)
            self.points = self.points._replace(refreshed=room)
        self.points.refreshed[: len(ranges)] = np.reshape(np.array(ranges, np.int32), (-1, 2))
        self.points.notes[REFRESHED] = len(ranges)

    def change(self, body: Body, *, is_there: bool) -> None:
        """Note that rows of MuJoCo's arrays, which stay, became a body's or are no longer one's.

        Args:
            body: the body.
            is_there: whether the rows are its own from now on.
        """
        bound = self._bound
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
        rows = np.array(geoms, np.int32)
        meeting_pairs().renumber(
            self.points, bound.trees, *((_NO_GEOMS, rows) if is_there else (rows, _NO_GEOMS))
        )
        self._ranges.clear()
        if is_there:
            self._new[body.id] = rows
        else:
            self._new.pop(body.id, None)
        if self.points.notes[REFRESHED]:
            self._write_refreshed(bound)

    def save(self) -> KeptPoints | None:
        """Return a copy of all points; None where there are none."""
        bound = self._bound
        if bound is None:
            return self._kept
        now = self.points
        count, table, listed = now.notes[[PAIRS, TABLE, LISTED]].tolist()
        if not count and not listed:
            return None
        keys = now.keys[table, :count]
        pairs = np.stack([keys // len(bound.owners), keys % len(bound.owners)], axis=1)
        return KeptPoints(
            owners=bound.owners[pairs],
            counts=now.counts[table, :count].copy(),
            points=now.points[table, :count].copy(),
            met=MetPairs(
                owners=bound.owners[now.pairs[:2, :listed].T],
                ranks=now.pairs[2, :listed].copy(),
                checked=int(now.notes[CHECKED]),
                shapes=bound.owners[bound.owners[:, 0] >= 0],
                boxes=now.wide[bound.owners[:, 0] >= 0],
            ),
        )

    def restore(self, kept: KeptPoints | None) -> None:
        """Go on with the points that were saved, or with none."""
        self._kept, self._bound = kept, None

    def prepare(self, model: Any, data: Any) -> None:
        """Let MuJoCo find one point of a pair where points are kept, before mj_step1."""
        if self._bound is None:
            self._bind(model, data)
        if self._new:
            self._write_first_boxes()

    @property
    def is_prepared(self) -> bool:
        """Whether `prepare` has nothing to do."""
        return self._bound is not None and not self._new

    def _write_first_boxes(self) -> None:
        """Write the boxes in which new shapes were made, for the next step."""
        first_boxes, points = self.first_boxes, self.points
        if first_boxes is not None:
            for body, geoms in self._new.items():
                found = first_boxes(body)
                if found is not None:
                    boxes().write_first_boxes(geoms, *found, points.wide, points.tight)
        self._new.clear()

    def move(
        self,
        model: Any,
        data: Any,
        found: StepRows,
        margins: Array,
        forms: ShapeForms,
    ) -> bool:
        """Move contacts to where shapes are closest, and those across gaps that do not count.

        Args:
            model: MjModel.
            data: MjData.
            found: the contacts, of which there are some.
            margins: (ngeom,) widths (m) by which surfaces lie outside MuJoCo's shapes.
            forms: of the shapes; see the loops `place_contacts` and `drop_gaps`.

        Returns:
            Whether a contact was moved, so that constraints have to be made again.
        """
        contacts = found.contacts, found.counts[0], model.geom_type, model.geom_bodyid, data.xpos, data.xmat
        moved = edge_kernels().place_contacts(
            *contacts, forms.boxes, forms.rounding, forms.hulls, forms.spans, forms.compound,
            self.points.ages, int(self.keeps), self.points.fresh,
        )  # fmt: skip
        kernels().drop_gaps(*contacts, margins, forms.boxes, forms.compound, int(self.keeps))
        return moved == 1

    def update(
        self,
        model: Any,
        data: Any,
        found: StepRows,
        margins: Array,
        reaches: Array,
        anchors: np.ndarray,
        forms: ShapeForms,
    ) -> bool:
        """Keep the points of the contacts found and add those of earlier steps, after mj_collision.

        Args:
            model: MjModel.
            data: MjData.
            found: the contacts, of which there are some.
            margins: (ngeom,) widths (m) by which surfaces lie outside MuJoCo's shapes.
            reaches: (ngeom,) gaps (m) from which on the geom's contacts do not push.
            anchors: (ngeom,) 1 for surfaces with anchors.
            forms: of the shapes, of none where gaps do not matter.

        Returns:
            Whether contacts were added or moved to anchors, so that constraints have to be made again.
        """
        bound = self._bound
        if bound is None or not bound.keeps:
            return False
        count = found.counts[0]
        self.grow(count)
        points = self.points
        now = int(points.notes[TABLE])
        before, after = ((points.keys[k], points.counts[k], points.points[k]) for k in (now, 1 - now))
        extra = kernels().keep_points(
            *(found.contacts, count, points.kinds, *bound.geoms, *bound.frames, margins, reaches),
            *(anchors, bound.seen),
            *(int(points.notes[PAIRS]), *before, *after, points.fresh, points.source, points.extra),
            *(points.slots, points.notes, forms.boxes, forms.compound, points.ages),
            *(forms.rounding, forms.hulls, forms.spans, bound.fields),
        )
        points.notes[TABLE], points.notes[EXTRA] = 1 - now, extra
        held = bool(points.notes[HELD])
        return (extra > 0 and self.add(model, data, found)) or held

    def add(self, model: Any, data: Any, found: StepRows) -> bool:
        """Add the points that the last update found besides MuJoCo's contacts, which they are copies of."""
        points, contacts = self.points, None if found.is_direct else data.contact
        added = 0
        for source in points.source[: points.notes[EXTRA]].tolist():
            if mujoco.mj_addContact(model, data, _BLANK if contacts is None else contacts[source]):
                break  # MuJoCo's memory is full; it has warned, and grows before the next step
            added += 1
        total = found.look()[0]
        if contacts is None:
            kernels().copy_contacts(found.words, found.search.contact // 4, total, added, points.source)
        kernels().write_points(found.contacts, total, added, points.extra)
        return True

    def forget(self) -> None:
        """Forget all points: in this step there are no contacts."""
        if self._bound is not None:
            self.points.notes[PAIRS] = 0

    def grow(self, contacts: int) -> None:
        """Make room for the points of so many contacts, and for more pairs where there was none left."""
        points = self.points
        room, meeting = points.keys.shape[1], points.pairs.shape[1]
        is_full = bool(points.notes[FULL])
        if room >= contacts and not is_full:
            return
        grown = _points(
            points.turns,
            points.tree_places,
            max(2 * contacts, room),
            2 * meeting if is_full else meeting,
        )
        for old, new in (
            (points.keys, grown.keys),
            (points.counts, grown.counts),
            (points.points, grown.points),
            (points.pairs, grown.pairs),
        ):
            new[:, : old.shape[1]] = old
        grown.ranked[:meeting], grown.slots[: len(points.slots)] = points.ranked, points.slots
        grown.tight[:], grown.wide[:], grown.seats[:] = points.tight, points.wide, points.seats
        if len(points.refreshed):
            grown = grown._replace(refreshed=points.refreshed)
        grown.notes[:] = points.notes
        grown.notes[[FULL, RENUMBERED, SORTED]] = 0, 1, 0
        self.points = grown
        self._world.drop_prepared()

    def _bind(self, model: Any, data: Any) -> None:
        world = self._world
        keeps = not self._windows.shows_slots
        if keeps:
            model.opt.disableflags |= _MULTIPLE
            if model.nmesh:
                face_contacts().install(model, data)
        else:
            model.opt.disableflags &= ~_MULTIPLE
        owners, turns, places = self._orders_of(model)
        self._bound = _Bound(
            keeps=keeps,
            geoms=(model.geom_type, model.geom_bodyid),
            frames=(data.xpos, data.xmat),
            fields=kept_fields(world),
            owners=owners,
            trees=model.body_treeid[model.geom_bodyid].astype(np.int32),
            seen=2 * world.profile.contact_margin,
        )
        kept, self._kept = self._kept, None
        self._new = {}
        old = self.points
        met = 0 if kept is None else len(kept.met.ranks)
        every = len(turns) * (len(turns) - 1) // 2  # of all geoms, those that have no body yet, too
        meeting = min(every, max(16 * len(turns), 4096))
        room = old.keys.shape[1], max(meeting, old.pairs.shape[1], met, 16)
        self.points = _points(turns.copy(), places.copy(), *room)
        if kept is not None:
            self._take(kept, self._bound)
        if keeps:
            self._note_new(owners)
        if self._refreshed:
            self._write_refreshed(self._bound)

    def _note_new(self, owners: np.ndarray) -> None:
        """Note the bodies some of whose geoms have no boxes yet."""
        wide, bodies = self.points.wide, self._world.body_by_id
        found = set(owners[wide[:, 0] > wide[:, 3], 0].tolist()) - {-1}
        self._new = {
            key: np.array([row for rows in bodies[key].geom_rows for row in rows], np.int32)
            for key in sorted(found)
        }

    def _orders_of(self, model: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return owners and orders of geoms, kept for the last few sets of bodies, which may come again."""
        world = self._world
        kept = world.of_arrays.setdefault(_OWNERS, {})
        bodies = tuple(body.mujoco_ids.tobytes() for body in world.body_by_id.values())
        found = kept.get(bodies)
        if found is None:
            places = _owners(world, model.ngeom)
            turns, tree_places = _creation_order(places, model)
            found = kept[bodies] = places, turns, tree_places
            while len(kept) > _SETS:
                del kept[next(iter(kept))]
        owners: np.ndarray = found[0].copy()
        if bodies:
            has_owner = owners[:, 0] >= 0
            owners[has_owner, 0] = np.array(list(world.body_by_id))[owners[has_owner, 0]]
        return owners, found[1], found[2]

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
        self._take_order(kept.met, number)

    def _take_order(self, met: MetPairs, number: dict[tuple[int, ...], int]) -> None:
        """Write the order of pairs, under the numbers of their geoms by body, link and place in the link."""
        points = self.points
        for owner, box in zip(met.shapes.tolist(), met.boxes, strict=True):
            geom = number.get(tuple(owner))
            if geom is not None:
                points.wide[geom] = box
        left = [
            (*sorted((number[tuple(one)], number[tuple(two)])), rank)
            for (one, two), rank in zip(met.owners.tolist(), met.ranks.tolist(), strict=True)
            if tuple(one) in number and tuple(two) in number
        ][: points.pairs.shape[1]]
        by_rank = sorted((rank, place) for place, (_, _, rank) in enumerate(left) if rank >= 0)
        points.pairs[:, : len(left)] = np.reshape(np.array(left, np.int32), (-1, 3)).T
        for rank, (_, place) in enumerate(by_rank):
            points.pairs[2, place], points.ranked[rank] = rank, place
        points.notes[[LISTED, RANKED, RENUMBERED]] = len(left), len(by_rank), 1
        points.notes[CHECKED] = min(max(met.checked, 0), max(len(left) - 1, 0))


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
    trees: np.ndarray
    """(ngeom,) tree of each geom, -1 for what is fixed."""
    seen: float
    """Gap (m) up to which MuJoCo finds contacts."""


def _without(kept: KeptPoints, body: int, link: int | None) -> KeptPoints:
    """Return kept points but for those of a link, or of all links of a body (by id)."""
    ended = kept.owners[:, :, 0] == body
    if link is not None:
        ended &= kept.owners[:, :, 1] == link
    left = ~ended.any(axis=1)
    return KeptPoints(kept.owners[left], kept.counts[left], kept.points[left], kept.met)


@cache
def _no_points() -> Points:
    """Return room for no points, which nothing is written into."""
    return _points(np.zeros(0, np.int32), np.zeros(0, np.int32), 0, 0)


def _points(turns: np.ndarray, tree_places: np.ndarray, pairs: int, meeting: int) -> Points:
    """Return room for the points of so many pairs, and for so many pairs whose boxes meet."""
    geoms, shapes, notes = len(turns), np.count_nonzero(turns >= 0), np.zeros(NOTES, np.int64)
    new, ages = np.zeros((geoms, 6)), np.zeros(geoms, np.int32)
    new[:, 0], ages[turns[:shapes]], notes[SHAPES] = 1.0, np.arange(shapes), shapes
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


def _owners(world: Engine[Body], count: int) -> np.ndarray:
    """Return (ngeom, 3) body, as a number from 0 on, link and place in the link of each geom; -1 for none."""
    owners, geoms, places = np.full((count, 3), -1), list[int](), list[tuple[int, int, int]]()
    for number, body in enumerate(world.body_by_id.values()):
        for link, rows in enumerate(body.geom_rows):
            geoms += rows
            places += [(number, link, place) for place in range(len(rows))]
    if geoms:
        owners[geoms] = places
    return owners


def _creation_order(owners: np.ndarray, model: Any) -> tuple[np.ndarray, np.ndarray]:
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
