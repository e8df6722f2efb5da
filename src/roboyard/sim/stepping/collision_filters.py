"""Collision filters: self-collision by bit masks, single pairs by exclusion."""

from __future__ import annotations

from typing import Any

from roboyard.description.model import RobotDescription
from roboyard.sim.body import Body
from roboyard.sim.build.records import ALL_MASKS
from roboyard.sim.engine import Engine
from roboyard.sim.link import Link

Key = tuple[tuple[int, int], tuple[int, int]]


class CollisionFilters:
    """Keeps the exclusions of a world in its spec.

    MuJoCo lets two geoms touch if a bit of one's `contype` is in the other's `conaffinity`. A robot without
    self-collision owns a code, a set of bits: its geoms have the code as contype and all other bits as
    conaffinity. So they do not collide with one another, but with all others: of two different sets, one is
    not within the other.
    """

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self._free_codes: list[int] = []
        """Codes of removed robots, in order."""
        self._codes = 0
        """Number of codes in use or free."""
        self._disabled: set[Key] = set()
        self._elements: dict[Key, Any] = {}
        self._owned: dict[int, int] = {}
        self._next: int | None = None

    def masks(self, description: RobotDescription, self_collision: bool) -> tuple[int, int]:
        """Return contype and conaffinity for the geoms of the body that is added next."""
        self._next = None
        parts = sum(bool(link.collisions) for link in description.links)
        if self_collision or parts < 2:
            return 1, ALL_MASKS
        self._next = self._free_codes[0] if self._free_codes else self._codes + 1
        return self._next << 1, ALL_MASKS & ~(self._next << 1)

    def set(self, a: Link, b: Link, *, collide: bool) -> None:
        """Let two links collide, or not."""
        key = _key(a, b)
        if collide:
            self._disabled.discard(key)
        else:
            self._disabled.add(key)
        self._world.mark_stale()

    def collides(self, a: Link, b: Link) -> bool:
        """Return whether a pair is not excluded."""
        return _key(a, b) not in self._disabled

    def assign_masks(self, body: Body) -> None:
        """Assign the masks returned last to the body that was added."""
        if self._next is not None:
            self._owned[body.id] = self._next
            if self._free_codes:
                self._free_codes.pop(0)
            else:
                self._codes += 1
        self._next = None

    def forget(self, body: Body) -> None:
        """Free the code of a body that is removed and delete its exclusions."""
        code = self._owned.pop(body.id, None)
        if code is not None:
            self._free_codes.append(code)
            self._free_codes.sort()
        self._disabled = {key for key in self._disabled if body.id not in (key[0][0], key[1][0])}
        self._sync()

    def write(self) -> None:
        """Update the spec's exclusions, before each compile."""
        self._sync()

    def _sync(self) -> None:
        bodies, spec = self._world.body_by_id, self._world.raw_spec
        for key in [key for key in self._elements if key not in self._disabled]:
            spec.delete(self._elements.pop(key))
            self._world.mark_stale()
        for key in self._disabled - self._elements.keys():
            (body_a, link_a), (body_b, link_b) = key
            self._elements[key] = spec.add_exclude(
                bodyname1=bodies[body_a].built.links[link_a].element.name,
                bodyname2=bodies[body_b].built.links[link_b].element.name,
            )


def _key(a: Link, b: Link) -> Key:
    one, two = (a.body.id, a.index), (b.body.id, b.index)
    return (one, two) if one <= two else (two, one)
