"""Which links may collide: groups and masks as in Bullet, and single pairs that override them.

PyBullet's worlds let two links collide where the group of either shares a bit with the mask of the other, as
MuJoCo's contype and conaffinity; Bullet's own default requires both.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING

from roboyard._records import NamedTuple
from roboyard.pybullet.face import constants as c

if TYPE_CHECKING:
    from roboyard.pybullet.bullet_rules.models import BodyModel
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.sim.link import Link
    from roboyard.sim.world import World

Place = tuple[int, int]
"""Body and link; link -1 is the base."""
STATIC_GROUP, DEFAULT_GROUP = 2, 1
_MOVING, _STATIC = (DEFAULT_GROUP, -1), (STATIC_GROUP, ~STATIC_GROUP)
"""Group and mask of links to which scripts gave none."""


class SelfCollisions(NamedTuple):
    """Which links of a body collide with each other."""

    are_on: bool = False
    """Whether any do."""
    exclude_ancestors: bool = False
    """Whether none does with its parent, the parent of that, and so on."""
    include_parents: bool = False
    """Whether they do with their parents, too."""


NO_SELF_COLLISIONS = SelfCollisions()


def self_collisions(flags: int) -> SelfCollisions:
    """Return what the flags of loadURDF say."""
    return SelfCollisions(
        are_on=bool(flags & c.URDF_USE_SELF_COLLISION),
        exclude_ancestors=bool(flags & c.URDF_USE_SELF_COLLISION_EXCLUDE_ALL_PARENTS),
        include_parents=bool(flags & c.URDF_USE_SELF_COLLISION_INCLUDE_PARENT),
    )


class PairFilters:
    """The filters that scripts set for links and pairs of links, applied to the World's own filters."""

    def __init__(self, world: World, bodies: Mapping[int, BodyRecord]) -> None:
        """Start without filters for the bodies (by id) of a world."""
        self._world, self._bodies = world, bodies
        self.groups: dict[Place, tuple[int, int]] = {}
        """Group and mask of links for which scripts gave them."""
        self.changes = 0
        """How often `groups` has changed."""
        self.alone: int | None = None
        """The body of all links in `groups`, if these are of one, whose own links do not touch."""
        self._filtered: set[int] = set()
        """Bodies of which any link has a group."""
        self._pairs: dict[tuple[Place, Place], bool] = {}
        self._self_colliding: set[int] = set()
        """Bodies whose own links may touch one another."""
        self._never: set[tuple[Place, Place]] = set()
        """Pairs of links that no filter lets collide."""
        self._splits_bases = False
        """Whether any group meets fixed bases and not links that move, or the other way."""
        self._taken_for_static: set[Place] = set()
        """Moving links that Bullet takes for parts of a fixed base."""

    def group_of(self, body: int, link: int) -> int:
        """Return the filter group of a link: the script's, else 2 for a fixed base and 1 for other links."""
        given = self.groups.get((body, link))
        if given is not None:
            return given[0]
        return STATIC_GROUP if self._is_static(body, link) else DEFAULT_GROUP

    def shows(self, body: int, link: int, mask: int) -> bool:
        """Return whether the group of a link shares a bit with a mask."""
        return self.shows_all(mask) or bool(self.group_of(body, link) & mask)

    def shows_all(self, mask: int) -> bool:
        """Return whether the groups of all links share a bit with a mask."""
        return mask == -1 and not self.groups

    def set_group(self, place: Place, group: int, mask: int, *, is_first: bool = False) -> None:
        """Set the filter group and mask of a link. is_first: whether it is made with them."""
        if not is_first:
            self.refresh(*place)
        given = group, mask
        if self.groups.get(place) == given:
            return
        self.groups[place] = given
        self.changes += 1
        if place[0] not in self._filtered:
            self._filtered.add(place[0])
            self._find_alone()
        if not self._splits_bases:
            meets_moving, meets_static = _collides(given)
            if meets_moving != meets_static:
                self._splits_bases = True
                for body in self._bodies:
                    self._apply_to((body, -1))
        self._apply_to(place)

    def set_pair(self, a: Place, b: Place, collide: bool) -> None:
        """Enable or disable collisions of one pair of links; this overrides their groups."""
        self._pairs[(min(a, b), max(a, b))] = collide
        self._set(a, b, collide)

    def refresh(self, body: int, link: int | None = None) -> None:
        """Let the pairs of a link, or of all links of a body, come last in the order of solution."""
        first = self._link(body, -1 if link is None else link)
        if first is not None:
            self._world.stepping.manifolds.refresh(first.body.id, None if link is None else first.index)

    def add_body(self, record: BodyRecord, own: SelfCollisions) -> None:
        """Apply Bullet's filters to the links of a new body; `own`: which may touch one another."""
        if own.are_on:
            self._self_colliding.add(record.number)
            self._find_alone()
            if own.exclude_ancestors or not own.include_parents:
                self._exclude_ancestors(record, only_parents=not own.exclude_ancestors)
        self._exclude_static(record)
        if self._splits_bases:
            self._apply_to((record.number, -1))

    def _exclude_ancestors(self, record: BodyRecord, *, only_parents: bool) -> None:
        links, number = record.model.links, record.number
        for link, part in enumerate(links[1:]):
            above = part.parent
            while part.collisions:
                if links[above + 1].collisions:
                    self._never.add(((number, above), (number, link)))
                    self._set((number, above), (number, link), False)
                if above < 0 or only_parents:
                    break
                above = links[above + 1].parent

    def _exclude_static(self, record: BodyRecord) -> None:
        """Let links that Bullet takes for static pass through each other, and through fixed bases."""
        number = record.number
        new = [(number, link) for link in taken_for_static(record.model)]
        self._taken_for_static.update(new)
        if not self._taken_for_static:
            return
        bases = [(body, -1) for body in self._bodies if self._is_static(body, -1)]
        ours = [*new, (number, -1)] if self._is_static(number, -1) else new
        for one in ours:
            others = [*bases, *self._taken_for_static] if one in new else self._taken_for_static
            for other in others:
                if one != other and (one[0] != other[0] or number in self._self_colliding):
                    self._never.add((min(one, other), max(one, other)))
                    self._set(one, other, False)

    def take_for_static(self, body: int) -> None:
        """Let a base that was fixed and now moves pass through fixed bases, as before."""
        place = body, -1
        for other in (*((number, -1) for number in self._bodies), *self._taken_for_static):
            if other != place and (other in self._taken_for_static or self._is_static(*other)):
                self._never.add((min(place, other), max(place, other)))
                self._set(place, other, False)
        self._taken_for_static.add(place)

    def remove_body(self, body: int) -> None:
        """Drop the filters of a body that was removed."""
        self._never = {pair for pair in self._never if body not in (pair[0][0], pair[1][0])}
        self._taken_for_static = {place for place in self._taken_for_static if place[0] != body}
        self._self_colliding.discard(body)
        self.groups = {place: given for place, given in self.groups.items() if place[0] != body}
        self.changes += 1
        self._filtered.discard(body)
        self._find_alone()
        self._pairs = {pair: on for pair, on in self._pairs.items() if body not in (pair[0][0], pair[1][0])}

    def _find_alone(self) -> None:
        one = next(iter(self._filtered)) if len(self._filtered) == 1 else None
        before, self.alone = self.alone, None if one in self._self_colliding else one
        if before is not None and self.alone is None:  # whose groups may have changed since, without effect
            for place in self.groups:
                if place[0] == before:
                    self._apply_to(place)

    def _apply_to(self, place: Place) -> None:
        """Give the World the group and mask of a link; fixed bases differ where any group depends on that."""
        link = self._link(*place)
        if link is not None:
            given = self.groups.get(place)
            if given is None:
                given = _STATIC if self._splits_bases and self._is_static(*place) else _MOVING
            self._world.filters.set_group(link, *given)

    def _is_static(self, body: int, link: int) -> bool:
        return self._bodies[body].model.fixed_base and link == -1

    def _set(self, a: Place, b: Place, collide: bool) -> None:
        if (min(a, b), max(a, b)) in self._never:
            collide = False
        first, second = self._link(*a), self._link(*b)
        if first is not None and second is not None:
            self._world.filters.set(first, second, collide=collide)

    def _link(self, body: int, link: int) -> Link | None:
        record = self._bodies.get(body)
        return None if record is None else record.link(link)


def _collide(one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Return whether two groups with masks let their links collide."""
    return bool(one[0] & other[1] or other[0] & one[1])


@lru_cache(1024)
def _collides(given: tuple[int, int]) -> tuple[bool, bool]:
    """Return whether a group with its mask collides with moving links, and with fixed bases, without ones."""
    return _collide(given, _MOVING), _collide(given, _STATIC)


def taken_for_static(model: BodyModel) -> list[int]:
    """Return the moving links with shapes that Bullet takes for static, and so solves no contacts of.

    On a fixed base, Bullet looks whether all joints between a link and the base are fixed, but not at that of
    link 0: what is fixed to link 0 counts as static, although it moves with it.

    Source:
        Bullet, URDF2Bullet.cpp, ConvertURDF2BulletInternal.
    """
    links = model.links
    if not model.fixed_base or len(links) < 2 or links[1].joint is None or links[1].joint.type == "fixed":
        return []
    found: set[int] = set()
    for link, part in enumerate(links[2:], start=1):
        if (
            part.joint is not None
            and part.joint.type == "fixed"
            and (part.parent == 0 or part.parent in found)
        ):
            found.add(link)
    return [link for link in sorted(found) if links[link + 1].collisions]
