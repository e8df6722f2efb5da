"""Which links may touch: self-collision by bit masks, single pairs by exclusion."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any

from roboyard.urdf.model import RobotDescription

if TYPE_CHECKING:
    from roboyard.sim.body import Body
    from roboyard.sim.link import Link
    from roboyard.sim.world import World

ALL = 0x7FFFFFFF
BITS = tuple(1 << k for k in range(1, 31))
"""One bit for each robot whose links must not touch one another; bit 0 is everybody else's."""

Key = tuple[tuple[int, int], tuple[int, int]]


class CollisionFilters:
    """Keeps a world's exclusions in its spec.

    MuJoCo lets two geoms touch if `contype` of one meets `conaffinity` of the other. A robot without
    self-collision owns a bit k: its geoms have contype k and conaffinity all-but-k, so they meet
    everything but themselves. When all thirty bits are taken, pairs are excluded one by one.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._bit_users: dict[int, int] = dict.fromkeys(BITS, 0)
        self._disabled: set[Key] = set()
        self._elements: dict[Key, Any] = {}
        self._owned: dict[int, int] = {}
        self._next: int | None = None

    def masks(self, description: RobotDescription, self_collision: bool) -> tuple[int, int]:
        """Contype and conaffinity for the geoms of the body that is added next."""
        self._next = None
        parts = sum(bool(link.collisions) for link in description.links)
        if self_collision or parts < 2:
            return 1, ALL
        free = [bit for bit in BITS if self._bit_users[bit] == 0]
        if not free:
            self._next = 0
            return 1, ALL
        self._next = free[0]
        return free[0], ALL & ~free[0]

    def set(self, a: Link, b: Link, *, collide: bool) -> None:
        """Let two links touch, or not."""
        key = _key(a, b)
        if collide:
            self._disabled.discard(key)
        else:
            self._disabled.add(key)
        self._world.mark_stale()

    def collides(self, a: Link, b: Link) -> bool:
        """Whether this pair was not switched off."""
        return _key(a, b) not in self._disabled

    def claim(self, body: Body) -> None:
        """The body whose masks were handed out last now exists."""
        if self._next == 0:
            touching = [link for link in body.links if link._built.geoms]
            for a, b in combinations(touching, 2):
                self._disabled.add(_key(a, b))
        elif self._next is not None:
            self._bit_users[self._next] = 1
            self._owned[body.id] = self._next
        self._next = None

    def forget(self, body: Body) -> None:
        """A body goes: its bit is free again, its exclusions vanish."""
        bit = self._owned.pop(body.id, None)
        if bit is not None:
            self._bit_users[bit] = 0
        self._disabled = {key for key in self._disabled if body.id not in (key[0][0], key[1][0])}
        self._sync()

    def write(self) -> None:
        """Bring the spec's exclusions up to date (called before each compile)."""
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
