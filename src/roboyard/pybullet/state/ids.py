"""Id counters: counting up, or reusing freed ids first."""

from __future__ import annotations


class IdPool:
    """Ids from 0; the id freed last is reused first."""

    __slots__ = ("_free", "_next")

    def __init__(self) -> None:
        """Start at 0."""
        self._next = 0
        self._free: list[int] = []

    def take(self) -> int:
        """Return the next id."""
        if self._free:
            return self._free.pop()
        self._next += 1
        return self._next - 1

    def free(self, number: int) -> None:
        """Make an id available again."""
        self._free.append(number)


class Counter:
    """Ids that only count up."""

    __slots__ = ("_next",)

    def __init__(self, start: int = 0) -> None:
        """Start at `start`."""
        self._next = start

    def take(self) -> int:
        """Return the next id."""
        self._next += 1
        return self._next - 1


def drop_from_order(order: list[int], number: int) -> None:
    """Remove an id from a list; the last id takes its place (PyBullet's order after removals)."""
    place = order.index(number)
    order[place] = order[-1]
    order.pop()
