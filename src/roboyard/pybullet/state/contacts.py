"""The contacts of the last step, with the links of each pair in Bullet's order; kept through later edits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._records import dataclass
from roboyard.pybullet.bullet_rules.contact_order import tangents

if TYPE_CHECKING:
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.pybullet.state.state_kernels import Listed
    from roboyard.sim.queries.contacts import ContactArrays

kernels = lazy_module("roboyard.pybullet.state.state_kernels")

Point = tuple[Any, ...]
Place = tuple[int, int]
"""Body and link; link -1 is the base."""
Contact = tuple[tuple[Place, Place], Point]
"""Links in Bullet's order, and getContactPoints fields from point on A."""
ANY_LINK = -2
_NO_STARTS = np.zeros(13, np.int64)


def touching(scene: Any) -> Iterable[Contact]:
    """Return each contact's links in Bullet's order and getContactPoints fields from point on A."""
    last = scene.last_step
    kept = last.contacts
    if kept is not None:
        found: Iterable[Contact] = kept
    elif scene.world.is_stale or scene.world.live_data.ncon == 0:
        return ()
    else:
        found = _rows_of(_look_at(scene))
    if last.filtered:
        return [row for row in found if last.filtered.keys().isdisjoint(row[0])]
    return found


def contacts_between(scene: Any, wanted: tuple[int, int, int, int]) -> tuple[Point, ...] | None:
    """Return the rows of getContactPoints for bodies A and B and their links, -1 and `ANY_LINK` for all.

    None where contacts were kept, links were filtered since, or soft bodies touch something; see `touching`.
    """
    last, world = scene.last_step, scene.world
    if last.filtered or world.is_stale or last.contacts is not None:
        return None
    count = world.live_data.ncon
    if not count:
        return ()
    places = last.places()
    if places is None:
        return None
    loops = kernels()
    known = last.listed(places, count)
    if known is None:
        arrays = _copied(world, count, places, scene.shapes.contact_reaches())
        found = loops.list_contacts(arrays, float(scene.parts), *wanted)
    else:
        arrays, bundle = known
        found = loops.list_known_contacts(bundle, float(scene.parts), *wanted)
    if not found:
        return ()
    numbers, links = arrays.numbers, arrays.links
    return tuple(
        [
            (0, a, b, c, d, (e, f, g), (h, i, j), (k, m, n), o, p, q, (r, s, t), u, (v, w, x))
            for (a, b, c, d), (e, f, g, h, i, j, k, m, n, o, p, q, r, s, t, u, v, w, x) in zip(
                links[:found].tolist(), numbers[:found].tolist(), strict=True
            )
        ]
    )


def _copied(world: Any, count: int, places: np.ndarray, reaches: np.ndarray) -> Listed:
    """Return the contacts of a step whose rows MuJoCo has made, and room for what is listed of them."""
    contact, loops = world.live_data.contact, kernels()
    return loops.Listed(
        *(contact.geom, loops.NUMBERED - 3 * np.arange(count, dtype=np.int32), np.full(count, 3, np.int32)),
        *(contact.dist, contact.pos, contact.frame, np.ascontiguousarray(world.contact_forces()).ravel()),
        _NO_STARTS,
        *(places, reaches, *_room(count), np.array([count], np.int32)),
        *(np.zeros(0, np.int32), np.full(loops.ORDERED + 1, -1), world.stepping.manifolds.points.entered),
    )


_FEW = 8
"""Contacts for which there is room where there are none yet."""


def _room(count: int) -> tuple[np.ndarray, np.ndarray]:
    return np.empty((count, kernels().NUMBERS)), np.empty((count, 4), np.int64)


class KeptRows:
    """Rows of getContactPoints of contacts that were kept, which scripts read pair by pair.

    Attributes:
        contacts: all of them.
    """

    __slots__ = ("_answers", "_by_body", "contacts")

    def __init__(self, contacts: list[Contact]) -> None:
        """Take the contacts, of a list that stays as it is."""
        self.contacts = contacts
        self._by_body: dict[int, list[Contact]] | None = None
        self._answers: dict[tuple[int, int, int, int], tuple[Point, ...]] = {}

    def between(self, wanted: tuple[int, int, int, int]) -> tuple[Point, ...]:
        """Return the rows for bodies A and B and their links, -1 and `ANY_LINK` for all."""
        found = self._answers.get(wanted)
        if found is None:
            found = self._answers[wanted] = selected(self._of(max(wanted[0], wanted[1])), wanted)
        return found

    def _of(self, body: int) -> list[Contact]:
        """Return the contacts of a body; all for -1."""
        if body < 0:
            return self.contacts
        table = self._by_body
        if table is None:
            table = self._by_body = {}
            for row in self.contacts:
                for number in {place[0] for place in row[0]}:
                    table.setdefault(number, []).append(row)
        return table.get(body, [])


def selected(rows: Iterable[Contact], wanted: tuple[int, int, int, int]) -> tuple[Point, ...]:
    """Return the rows of getContactPoints of those contacts that are wanted; see `contacts_between`."""
    found = [_selected(pair, point, wanted) for pair, point in rows]
    return tuple([row for row in found if row is not None])


def _selected(pair: tuple[Place, Place], point: Point, wanted: tuple[int, int, int, int]) -> Point | None:
    """Return the row of a contact with body A listed first, or None if the contact is not wanted.

    Only bodies and points are swapped, as in Bullet: friction stays that on the pair's first link.
    """
    (body_a, link_a), (body_b, link_b) = pair
    on_a, on_b, normal, *rest = point
    wanted_a, wanted_b, wanted_link_a, wanted_link_b = wanted
    if wanted_a >= 0 and wanted_a != body_a:
        if wanted_a != body_b:
            return None
        body_a, link_a, body_b, link_b = body_b, link_b, body_a, link_a
        on_a, on_b, normal = on_b, on_a, (-normal[0], -normal[1], -normal[2])
    if wanted_b >= 0 and wanted_b != body_b:
        return None
    if wanted_link_a not in (ANY_LINK, link_a) or wanted_link_b not in (ANY_LINK, link_b):
        return None
    return (0, body_a, body_b, link_a, link_b, on_a, on_b, normal, *rest)


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """The contacts of a step, as copies of MuJoCo's arrays."""

    arrays: ContactArrays
    geoms: np.ndarray
    """(k, 2) MuJoCo's geoms."""
    reaches: np.ndarray | None
    """(ngeom,) gaps (m) up to which Bullet keeps points; None where no gap is open."""
    records: dict[int, BodyRecord]
    """By id in the World."""
    parts: int
    """Parts of the step."""
    order: list[int]
    """Contacts in Bullet's order."""
    turns: list[int]
    """(ngeom,) `Points.entered`; shorter where these are not known."""


def _look_at(scene: Any) -> _Seen:
    from roboyard.sim.queries.contacts import contact_arrays

    arrays = contact_arrays(scene.world)
    is_open = (arrays.distance > 0.0) & (arrays.force[:, 0] <= 0.0)
    return _Seen(
        arrays=arrays,
        geoms=scene.world.live_data.contact.geom.copy(),
        reaches=scene.shapes.contact_reaches() if is_open.any() else None,
        records=scene.records(),
        parts=scene.parts,
        order=scene.world.stepping.forces.contact_order(len(arrays.distance)).tolist(),
        turns=scene.world.stepping.manifolds.points.entered.tolist(),
    )


def _rows_of(seen: _Seen) -> Iterator[Contact]:
    arrays, reaches, records = seen.arrays, seen.reaches, seen.records
    middles = arrays.position.tolist()
    normals = arrays.frame[:, 0].tolist()
    force = arrays.force / seen.parts if seen.parts > 1 else arrays.force
    forces = np.einsum("ij,ijk->ik", force, arrays.frame).tolist()
    pushes = force[:, 0].tolist()
    kinds: dict[Place, int] = {}
    geoms, owners = seen.geoms.tolist(), arrays.owners.tolist()
    distances = arrays.distance.tolist()
    for i in seen.order:
        distance = distances[i]
        pushing = pushes[i]
        if distance > 0.0 and pushing <= 0.0:
            a, b = geoms[i]
            if reaches is None or a < 0 or b < 0 or distance > min(reaches[a], reaches[b]):
                continue
        world_a, link_a, world_b, link_b = owners[i]
        one, other = records[world_a], records[world_b]
        a, b = (one.number, link_a - 1), (other.number, link_b - 1)
        turns = [seen.turns[geom] if 0 <= geom < len(seen.turns) else 0 for geom in geoms[i]]
        is_turned = _comes_second(one, other, a, b, kinds, turns)
        point = _point(middles[i], normals[i], distance, pushing, forces[i], is_turned=is_turned)
        yield ((b, a) if is_turned else (a, b)), point


def _comes_second(
    one: BodyRecord, other: BodyRecord, a: Place, b: Place, kinds: dict[Place, int], turns: list[int]
) -> bool:
    """Return whether Bullet lists b first.

    Args:
        one: body of the first link.
        other: body of the second one.
        a: the first link.
        b: the second one.
        kinds: of links that were looked up before; more are added.
        turns: of both, in which they entered the broad phase; the same where these are not known.
    """
    for record, place in ((one, a), (other, b)):
        if place not in kinds:
            kinds[place] = record.shapes.contact_kind(place[1])
    if kinds[a] != kinds[b]:
        return kinds[a] < kinds[b]
    if turns[0] != turns[1]:
        return turns[0] > turns[1]
    age = one.body.id - other.body.id
    return age > 0 or (age == 0 and a[1] > b[1])


def _point(
    middle: list[float],
    normal: list[float],
    distance: float,
    pushing: float,
    force: list[float],
    *,
    is_turned: bool,
) -> tuple[Any, ...]:
    """Return point on A, point on B (m), normal on B, distance (m), and the forces on A (N).

    Middle, normal and force are MuJoCo's: the normal points to its second geom, on which the force acts.
    """
    half, sign = 0.5 * distance, 1.0 if is_turned else -1.0
    on_b = (sign * normal[0], sign * normal[1], sign * normal[2])
    first, second = tangents(on_b)
    on_a = tuple(m + half * n for m, n in zip(middle, on_b, strict=True))
    across = (sum(f * t for f, t in zip(force, way, strict=True)) * sign for way in (first, second))
    first_force, second_force = across
    return (
        on_a, tuple(m - half * n for m, n in zip(middle, on_b, strict=True)), on_b, distance, pushing,
        first_force, first, second_force, second,
    )  # fmt: skip


class LastStep:
    """The contacts, motor efforts and reactions of the last step, from the first later edit on."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._contacts: list[Contact] | None = None
        self._seen: _Seen | None = None
        """Kept contacts, until they are looked at."""
        self._removed: set[int] = set()
        """Bodies that were removed since then."""
        self._kept = KeptRows([])
        self._places: np.ndarray | None = None
        """Links of the world's geoms, which are written again where bodies came or went."""
        self._places_of: tuple[int, Any] = (-1, None)
        """Revision of the world, and MjModel, that they are of."""
        self._placed: dict[int, list[int]] = {}
        """Geoms of the bodies whose links were written, by their ids in the World."""
        self._listed: tuple[Listed, Any] | None = None
        self.filtered: dict[Place, None] = {}
        """Links whose contacts are forgotten: a new filter lets Bullet find their pairs again in the next
        step."""

    @property
    def contacts(self) -> list[Contact] | None:
        """Kept contacts; None where MuJoCo's arrays have them."""
        seen, self._seen = self._seen, None
        if seen is not None:
            removed = self._removed
            rows = _rows_of(seen)
            self._contacts = [row for row in rows if not (row[0][0][0] in removed or row[0][1][0] in removed)]
        return self._contacts

    @contacts.setter
    def contacts(self, rows: list[Contact] | None) -> None:
        self._contacts, self._seen = rows, None
        self._removed.clear()

    @property
    def kept_rows(self) -> KeptRows | None:
        """Rows of kept contacts; None where MuJoCo's arrays have them, or links were filtered since."""
        kept = self.contacts
        if kept is None or self.filtered:
            return None
        if self._kept.contacts is not kept:
            self._kept = KeptRows(kept)
        return self._kept

    def places(self) -> np.ndarray | None:
        """Return body, link, kind and id in the World of all geoms, (ngeom, 4); None with soft bodies."""
        world = self._scene.world
        if self._places_of[0] != world.revision:
            model = world.live_model
            if self._places is None or self._places_of[1] is not model:
                self._places, self._placed = np.full((model.ngeom, 4), -1, np.int32), {}
            self._places_of = world.revision, model
            self._write_places(self._places, self._scene.records())
        return None if self._places_of[1].nflex else self._places

    def _write_places(self, places: np.ndarray, records: dict[int, BodyRecord]) -> None:
        """Write the links of the geoms of bodies that came, and none for those that went."""
        placed = self._placed
        for key in [key for key in placed if key not in records]:
            places[placed.pop(key)] = -1
        for key, record in records.items():
            if key not in placed:
                geoms = record.body.geom_rows
                for link, (rows, kinds) in enumerate(zip(geoms, record.shapes.kinds(geoms), strict=True)):
                    places[rows] = record.number, link - 1, 0, key
                    places[rows, 2] = kinds
                placed[key] = [row for rows in geoms for row in rows]

    def listed(self, places: np.ndarray, count: int) -> tuple[Listed, Any] | None:
        """Return the contacts as arrays that stay from step to step, and their bundle.

        Args:
            places: (ngeom, 4) of geoms, see `places`.
            count: number of contacts, for which there is room.

        Returns:
            None where they are nowhere in memory that is known.
        """
        in_place = self._scene.world.stepping.forces.contacts_in_place()
        if in_place is None:
            return None
        contacts, force, counts, starts = in_place
        reaches, known = self._scene.shapes.contact_reaches(), self._listed
        points = self._scene.world.stepping.manifolds.points
        if known is not None:
            arrays = known[0]
            if (
                arrays.geom is contacts.geom
                and arrays.force is force
                and arrays.starts is starts
                and arrays.places is places
                and arrays.reaches is reaches
                and arrays.order is points.listing
                and arrays.turns is points.entered
                and count <= len(arrays.links)
            ):
                return known
        loops, c = kernels(), contacts
        arrays = loops.Listed(
            *(c.geom, c.address, c.dim, c.dist, c.position, c.frame, force, starts, places, reaches),
            *(*_room(2 * count), counts, points.listing, points.notes, points.entered),
        )
        self._listed = arrays, loops.LISTED.of(arrays)
        return self._listed

    def prepare(self) -> None:
        """Let machine code list the contacts of steps, where they are in arrays that stay."""
        scene = self._scene
        world = scene.world
        prepared, places = world.prepared.get("contacts"), self.places()
        if prepared is None or world.is_stale or places is None:
            return
        known = self._listed or self.listed(places, _FEW)
        if known is None:
            return
        arrays, bundle = known
        if (
            arrays.places is places
            and arrays.reaches is scene.shapes.contact_reaches()
            and arrays.order is world.stepping.manifolds.points.listing
        ):
            prepared[0] = (
                *(scene, self, *world.stepping.forces.known_rows, kernels().list_known_contacts, bundle),
                *(arrays.numbers, arrays.links.reshape(-1)),
            )

    def keep(self) -> None:
        """Keep what MuJoCo's arrays hold of the last step, before these are replaced."""
        scene = self._scene
        world = scene.world
        if world.is_stale or world.body_by_id.keys() != scene.world_ids():
            return  # kept before the first of several edits
        if scene.motor_revision == world.revision:
            self._keep_efforts(scene)
        if self._contacts is None and self._seen is None:
            if self.filtered or not world.live_data.ncon:
                self.contacts = self._present()
            else:
                self._removed.clear()
                self._seen = _look_at(scene)

    def involves(self, record: BodyRecord) -> bool:
        """Return whether MuJoCo's arrays hold contacts or reactions that the removal of a body affects."""
        scene, world = self._scene, self._scene.world
        if scene.has_sensors:
            return True
        if world.is_stale or self._contacts is not None or self._seen is not None:
            return False
        count = world.live_data.ncon
        if not count:
            return False
        in_place = world.stepping.forces.contacts_in_place()
        pairs = (world.live_data.contact if in_place is None else in_place[0]).geom[:count]
        own = [geom for link in record.body.geom_rows for geom in link]
        found = pairs == own[0] if len(own) == 1 else np.isin(pairs, own)
        return bool(np.count_nonzero(found))

    def _present(self) -> list[Contact]:
        return list(touching(self._scene))

    def _keep_efforts(self, scene: Any) -> None:
        forces: list[float] | None = None
        for number, record in scene.bodies.items():
            if not record.joint_count:
                continue
            scene.ready(number, "")
            for joint in record.sensors:
                from roboyard.pybullet.state.reactions.joint_reactions import reaction

                record.reactions[joint] = reaction(scene, record, joint)
            if forces is None:
                forces = scene.motor_forces().tolist()
            record.keep_applied(forces)
        scene.motor_revision = -1

    def drop(self) -> None:
        """Forget kept contacts: MuJoCo's arrays have newer ones."""
        if self._contacts is None and self._seen is None and not self.filtered:
            return  # after almost every step
        self.contacts = None
        self.filtered.clear()

    def restore(self, saved: Sequence[Contact]) -> None:
        """Take the contacts of a saved state; without any, Bullet leaves the present ones."""
        if not saved:
            self.contacts = self._present()
            return
        self.filtered.clear()
        bodies = self._scene.bodies
        self.contacts = [row for row in saved if row[0][0][0] in bodies and row[0][1][0] in bodies]

    def remove_body(self, number: int) -> None:
        """Forget the contacts of a body."""
        if self._seen is not None:
            self._removed.add(number)
        elif self._contacts:
            self._contacts = [row for row in self._contacts if number not in (row[0][0][0], row[0][1][0])]
