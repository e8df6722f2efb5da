"""How ids are given out: counting up from a start, and again from those that became free."""

from __future__ import annotations


class IdPool:
    """Ids from 0; the one freed last is given out first."""

    __slots__ = ("_free", "_next")

    def __init__(self) -> None:
        self._next = 0
        self._free: list[int] = []

    def take(self) -> int:
        if self._free:
            return self._free.pop()
        self._next += 1
        return self._next - 1

    def free(self, number: int) -> None:
        self._free.append(number)


class Counter:
    """Ids that only count up."""

    __slots__ = ("_next",)

    def __init__(self, start: int = 0) -> None:
        self._next = start

    def take(self) -> int:
        self._next += 1
        return self._next - 1


def drop_from_order(order: list[int], number: int) -> None:
    """Remove an id from a listing, the last one taking its place (PyBullet's order after removals)."""
    place = order.index(number)
    order[place] = order[-1]
    order.pop()
