"""Gives back the memory of worlds that a program no longer uses.

A world and its parts refer to each other, so only Python's garbage collector frees it. The collector counts
objects of Python's and knows nothing of MuJoCo's memory: programs that make a world for each episode would
grow without end.
"""

from __future__ import annotations

import gc
import weakref
from _thread import allocate_lock
from collections.abc import Callable

EVERY = 8
"""New worlds between two looks at the memory."""
LEAST = 128 * 2**20
"""Bytes of worlds below which nothing is collected."""
MARGIN = 2.0
"""Factor by which the worlds grow beyond those in use until the next collection."""
PER_WORLD = 2**19
"""Bytes of a world beside its MuJoCo arrays: MuJoCo's spec and Python's objects."""


class DiscardedWorlds:
    """Counts the worlds in memory and runs Python's collector once they take twice what is in use."""

    def __init__(self, collect: Callable[[], object] = gc.collect) -> None:
        self._collect = collect
        self._lock = allocate_lock()
        self._sizes: dict[int, Callable[[], int]] = {}
        self._number = 0
        self._limit = LEAST

    def add(self, world: object, size: Callable[[object], int]) -> None:
        """Count a new world, and collect the discarded ones where they take too much.

        Args:
            world: the new world; only a weak reference is kept.
            size: returns the bytes of MuJoCo's arrays of a world.
        """
        with self._lock:
            self._number += 1
            number = self._number
            self._sizes[number] = _Sized(world, size)
            looks = number % EVERY == 0
        weakref.finalize(world, self._sizes.pop, number, None).atexit = False
        if looks and self._bytes() > self._limit:
            self._collect()
            self._limit = max(LEAST, int(MARGIN * self._bytes()))

    def __len__(self) -> int:
        """Return the number of worlds in memory."""
        return len(self._sizes)

    def _bytes(self) -> int:
        """Return the bytes of all worlds in memory."""
        return sum(size() for size in list(self._sizes.values()))


class _Sized:
    """The bytes of one world, asked for by a weak reference."""

    __slots__ = ("_size", "_world")

    def __init__(self, world: object, size: Callable[[object], int]) -> None:
        self._world, self._size = weakref.ref(world), size

    def __call__(self) -> int:
        world = self._world()
        return 0 if world is None else PER_WORLD + self._size(world)


WORLDS = DiscardedWorlds()
"""The worlds of this process."""
