"""Groups of links: bits of MuJoCo's masks, and pairs that are excluded where bits do not suffice."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import field
from functools import reduce
from operator import or_
from typing import Any

from roboyard._records import dataclass
from roboyard.sim.build.group_masks import BITS, WITHOUT, Group, Masks, code_masks, group_masks, meet
from roboyard.sim.build.masks import ALL_MASKS
from roboyard.sim.protocols import EngineBody

LinkKey = tuple[int, int]
"""Id of a body and index of its link."""
Key = tuple[LinkKey, LinkKey]
"""Two links, in order."""


@dataclass(kw_only=True, slots=True)
class GroupChange:
    """Changes that follow from a new group of a link."""

    added: set[Key] = field(default_factory=set)
    """Pairs that are excluded for their groups now."""
    removed: set[Key] = field(default_factory=set)
    """Pairs that are no longer."""
    links: list[LinkKey] = field(default_factory=list)
    """Links with other masks."""


class LinkGroups:
    """Group and mask of links, the bits of MuJoCo's masks for them, and the pairs that are excluded for them.

    A link by bits has those of its group beside the mask that its body has without one. Links whose group got
    no bits, and those that collide with a link although their groups do not, are excluded pair by pair.
    """

    def __init__(self, bodies: dict[int, Any], codes: dict[int, int]) -> None:
        """Start without groups.

        Args:
            bodies: of the world, by id.
            codes: of bodies without self-collision, by id; see `CollisionFilters`.
        """
        self._bodies, self._codes = bodies, codes
        self._groups: dict[LinkKey, Group] = {}
        self._counts: dict[Group, int] = {}
        """Number of links of each group, in the order in which groups came."""
        self._masks: dict[Group, Masks | None] = {}
        self._apart: dict[LinkKey, None] = {}
        """Links with a group that are excluded pair by pair."""
        self._enabled: dict[LinkKey, set[LinkKey]] = {}
        """Links that collide in spite of their groups."""
        self._partners: dict[LinkKey, set[LinkKey]] = {}
        """Links that a link is excluded with."""
        self._in_spec: dict[LinkKey, tuple[int, int]] = {}
        """Masks in the spec, where they are of a group."""

    def __bool__(self) -> bool:
        return bool(self._groups or self._in_spec)

    def set(self, link: LinkKey, group: Group) -> GroupChange:
        """Set the group of a link."""
        old = self._groups.get(link, WITHOUT)
        if old == group:
            return GroupChange()
        is_new = self._count(group, 1) | self._count(old, -1)
        if group == WITHOUT:
            del self._groups[link]
        else:
            self._groups[link] = group
        changed = [link]
        if is_new:
            before, self._masks = self._masks, group_masks(self._counts)
            others = {one for one in self._counts if before.get(one, ()) != self._masks.get(one, ())}
            changed += [key for key, one in self._groups.items() if one in others and key != link]
        return self._update(changed)

    def enable(self, one: LinkKey, other: LinkKey, *, collide: bool) -> GroupChange:
        """Let two links collide in spite of their groups, or as these say."""
        for key, partner in ((one, other), (other, one)):
            known = self._enabled.setdefault(key, set())
            (known.add if collide else known.discard)(partner)
            if not known:
                del self._enabled[key]
        changed = [key for key in (one, other) if key in self._groups]
        if any(self._is_apart(key) != (key in self._apart) for key in changed):
            return self._update(changed)
        return self._update_pair(one, other, changed)

    def add(self, body: EngineBody) -> set[Key]:
        """Return the pairs of a new body that are excluded."""
        added: set[Key] = set()
        for link in self._apart:
            for index in range(len(body.form.links)):
                if self._is_excluded(link, (body.id, index)):
                    self._join(link, (body.id, index))
                    added.add(in_order(link, (body.id, index)))
        return added

    def forget(self, body: EngineBody) -> None:
        """Drop the groups of a body that is removed."""
        for index in range(len(body.form.links)):
            link = body.id, index
            for other in list(self._partners.get(link, ())):
                self._part(link, other)
            for other in self._enabled.pop(link, ()):
                self._enabled.get(other, set()).discard(link)
            self._apart.pop(link, None)
            if self._in_spec.pop(link, None) is not None:
                _write_spec(body, index, self._usual(body.id))
            group = self._groups.pop(link, None)
            if group is not None:
                self._count(group, -1)

    def write(self, model: Any, links: Collection[LinkKey] | None = None) -> None:
        """Write masks into MuJoCo's arrays, by default of all links that may have others in the spec."""
        for link in {**self._groups, **self._in_spec} if links is None else links:
            number, index = link
            body = self._bodies[number]
            if body.form.links[index].link is None:
                continue
            rows = body.geom_rows[index]
            if rows:
                _write_masks(model, rows, self._masks_of(link))

    def write_spec(self) -> bool:
        """Write the masks into the spec, which others read; return whether any were others."""
        usual = {link: self._usual(link[0]) for link in self._in_spec}
        wanted = {link: self._masks_of(link) for link in self._groups if self._bits(link) is not None}
        if wanted == self._in_spec:
            return False
        for link, masks in {**usual, **wanted}.items():
            _write_spec(self._bodies[link[0]], link[1], masks)
        self._in_spec = wanted
        return True

    def _count(self, group: Group, change: int) -> bool:
        """Count a link of a group; return whether the group is new."""
        if group == WITHOUT:
            return False
        is_new = group not in self._counts
        if is_new and len(self._counts) >= BITS:
            self._counts = {one: count for one, count in self._counts.items() if count}
        self._counts[group] = self._counts.get(group, 0) + change
        return is_new

    def _update(self, links: list[LinkKey]) -> GroupChange:
        for link in links:
            if self._is_apart(link):
                self._apart[link] = None
            else:
                self._apart.pop(link, None)
        added: set[Key] = set()
        removed: set[Key] = set()
        for link in links:
            wanted = {other for other in self._candidates(link) if self._is_excluded(link, other)}
            known = self._partners.get(link, set())
            removed |= {in_order(link, other) for other in known - wanted}
            added |= {in_order(link, other) for other in wanted - known}
            for other in known - wanted:
                self._part(link, other)
            for other in wanted - known:
                self._join(link, other)
        return GroupChange(added=added - removed, removed=removed - added, links=links)

    def _update_pair(self, one: LinkKey, other: LinkKey, changed: list[LinkKey]) -> GroupChange:
        """Exclude one pair or not, after it was enabled or disabled; `changed`: those that have a group."""
        known = other in self._partners.get(one, ())
        if not changed or known == self._is_excluded(one, other):
            return GroupChange()
        (self._part if known else self._join)(one, other)
        pair = {in_order(one, other)}
        return GroupChange(removed=pair) if known else GroupChange(added=pair)

    def _candidates(self, link: LinkKey) -> Iterator[LinkKey]:
        """Return the links that a link may have to be excluded with."""
        bodies = self._bodies.values() if link in self._apart else [self._bodies[link[0]]]
        for body in bodies:
            for index in range(len(body.form.links)):
                yield body.id, index
        if link not in self._apart:
            yield from (other for other in self._apart if other[0] != link[0])

    def _is_apart(self, link: LinkKey) -> bool:
        """Return whether a link with a group is excluded pair by pair."""
        group = self._groups.get(link)
        if group is None:
            return False
        if group not in self._masks or self._bodies[link[0]].form.links[link[1]].link is None:
            return True
        return link in self._enabled and self._masks[group] is not None

    def _bits(self, link: LinkKey) -> Masks | None:
        group = self._groups.get(link)
        return None if group is None or link in self._apart else self._masks[group]

    def _is_excluded(self, one: LinkKey, other: LinkKey) -> bool:
        """Return whether two links are excluded for their groups, as their masks let them collide."""
        if one == other or not (self._has_shapes(one) and self._has_shapes(other)):
            return False
        does = meet(self._groups.get(one, WITHOUT), self._groups.get(other, WITHOUT))
        by_code = one[0] == other[0] and one[0] in self._codes
        if self._bits(one) is not None and self._bits(other) is not None:
            return does and by_code
        is_apart = one in self._apart or other in self._apart
        return is_apart and not (does or by_code or other in self._enabled.get(one, ()))

    def _has_shapes(self, link: LinkKey) -> bool:
        part = self._bodies[link[0]].form.links[link[1]].link
        return part is None or bool(part.collisions)

    def _usual(self, body: int) -> tuple[int, int]:
        """Return the masks of a body's links without groups."""
        code = self._codes.get(body)
        return (1, ALL_MASKS) if code is None else code_masks(code)

    def _masks_of(self, link: LinkKey) -> tuple[int, int]:
        """Return contype and conaffinity of a link."""
        usual, bits = self._usual(link[0]), self._bits(link)
        return usual if bits is None else ((usual[0] if bits[0] else 0) | bits[1], bits[2])

    def _join(self, one: LinkKey, other: LinkKey) -> None:
        self._partners.setdefault(one, set()).add(other)
        self._partners.setdefault(other, set()).add(one)

    def _part(self, one: LinkKey, other: LinkKey) -> None:
        for key, partner in ((one, other), (other, one)):
            self._partners[key].discard(partner)
            if not self._partners[key]:
                del self._partners[key]


def in_order(one: LinkKey, other: LinkKey) -> Key:
    """Return two links in order."""
    return (one, other) if one <= other else (other, one)


def _write_masks(model: Any, rows: Sequence[int], masks: tuple[int, int]) -> None:
    """Write contype and conaffinity of the geoms of a link that collide, and those of its body."""
    kinds, affinities = model.geom_contype, model.geom_conaffinity
    for row in rows:
        if kinds.item(row) or affinities.item(row):
            kinds[row], affinities[row] = masks
    body = model.geom_bodyid.item(rows[0])
    first = model.body_geomadr.item(body)
    every = slice(first, first + model.body_geomnum.item(body))
    model.body_contype[body] = reduce(or_, kinds[every].tolist(), 0)
    model.body_conaffinity[body] = reduce(or_, affinities[every].tolist(), 0)


def _write_spec(body: EngineBody, index: int, masks: tuple[int, int]) -> None:
    for geom in body.built.links[index].geoms:
        if geom.contype or geom.conaffinity:
            geom.contype, geom.conaffinity = masks
