"""Which links may collide: groups and masks as in Bullet, and single pairs that overrule them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from roboyard.pybullet.state.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Place = tuple[int, int]
"""Body and link, -1 for the base."""


class PairFilters:
    """What scripts said of links and pairs of links, brought to the World's own filters."""

    def __init__(self, scene: PhysicsScene) -> None:
        self._scene = scene
        self._groups: dict[Place, tuple[int, int]] = {}
        self._pairs: dict[tuple[Place, Place], bool] = {}

    def group_of(self, body: int, link: int) -> int:
        """Filter group of a link: what a script gave it, else 2 for what cannot move and 1 for what can."""
        given = self._groups.get((body, link))
        if given is not None:
            return given[0]
        return 2 if self._scene.bodies[body].model.fixed_base and link == -1 else 1

    def set_group(self, place: Place, group: int, mask: int) -> None:
        """Give a link a filter group and mask, and bring its pairs with all other links up to date."""
        self._groups[place] = (group, mask)
        for body, record in self._scene.bodies.items():
            if body != place[0]:
                self._apply_to(place, record)

    def set_pair(self, a: Place, b: Place, collide: bool) -> None:
        """Switch one pair of links on or off, whatever their groups say."""
        self._pairs[(min(a, b), max(a, b))] = collide
        self._set(a, b, collide)

    def add(self, record: BodyRecord) -> None:
        """A body came: what was said of others holds towards its links too."""
        for place in self._groups:
            self._apply_to(place, record)

    def forget(self, body: int) -> None:
        """A body went."""
        self._groups = {place: given for place, given in self._groups.items() if place[0] != body}
        self._pairs = {pair: on for pair, on in self._pairs.items() if body not in (pair[0][0], pair[1][0])}

    def _apply_to(self, place: Place, record: BodyRecord) -> None:
        for link, part in enumerate(record.model.links, start=-1):
            if part.collisions:
                self._apply(place, (record.number, link))

    def _apply(self, a: Place, b: Place) -> None:
        pair = self._pairs.get((min(a, b), max(a, b)))
        both = self.group_of(*a) & self._mask_of(*b) and self.group_of(*b) & self._mask_of(*a)
        self._set(a, b, bool(both) if pair is None else pair)

    def _mask_of(self, body: int, link: int) -> int:
        given = self._groups.get((body, link))
        return -1 if given is None else given[1]

    def _set(self, a: Place, b: Place, collide: bool) -> None:
        first, second = self._scene.link(*a), self._scene.link(*b)
        filters = self._scene.world.filters
        if first is not None and second is not None and filters.collides(first, second) != collide:
            filters.set(first, second, collide=collide)
