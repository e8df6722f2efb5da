"""Text that scripts attach to bodies, links and visual shapes."""

from __future__ import annotations

from collections.abc import Iterable

from roboyard._records import NamedTuple
from roboyard.pybullet.state.ids import IdPool


class UserDataKey(NamedTuple):
    """The body, link or visual shape that an entry belongs to, and the entry's key."""

    body: int
    """Body id."""
    link: int
    """Link index; -1 for the base."""
    shape: int
    """Index of the visual shape; -1 for the link itself."""
    key: str
    """Name of the entry."""


class UserData:
    """Entries by id, counted from 0; the id freed last is reused first."""

    def __init__(self) -> None:
        """Start without entries."""
        self._ids = IdPool()
        self._values: dict[int, bytes] = {}
        self._keys: dict[int, UserDataKey | tuple[int, int, int, str]] = {}
        """By id; machine code stores plain tuples."""
        self._numbers: dict[UserDataKey | tuple[int, int, int, str], int] = {}
        self._known: tuple[tuple[int, int, tuple[int, int, int, str]], set[int]] | None = None
        """Number of entries, the last one, and the bodies that had any then."""

    def put(self, place: tuple[int, int, int, str], value: str) -> int:
        """Set an entry, whose key may be a plain tuple, and return its id.

        The id stays the same when the value is replaced.
        """
        number = self._numbers.get(place)
        if number is None:
            number, key = self._ids.take(), UserDataKey(*place)
            self._numbers[key] = number
            self._keys[number] = key
        self._values[number] = value.encode()
        return number

    def find(self, key: tuple[int, int, int, str]) -> int:
        """Return the id of an entry, or -1."""
        return self._numbers.get(key, -1)

    def value(self, number: int) -> bytes | None:
        """Return the text of an entry, or None."""
        return self._values.get(number)

    def remove(self, number: int) -> bool:
        """Remove an entry; return False if there is none."""
        key = self._keys.pop(number, None)
        if key is None:
            return False
        del self._numbers[key], self._values[number]
        self._ids.free(number)
        return True

    def of_body(self, body: int) -> list[tuple[int, UserDataKey]]:
        """Return (id, key) of a body's entries, oldest first."""
        return [(number, UserDataKey(*key)) for number, key in self._keys.items() if key[0] == body]

    def remove_bodies(self, bodies: Iterable[int]) -> None:
        """Remove all entries of some bodies."""
        if not self._keys:
            return
        removed = set(bodies)
        if removed.isdisjoint(self._bodies()):
            return
        for number in [number for number, key in self._keys.items() if key[0] in removed]:
            self.remove(number)

    def _bodies(self) -> set[int]:
        """Return the bodies with entries, which are looked through again once there are others.

        Machine code adds and removes entries, too. A new one is the last.
        """
        number, key = next(reversed(self._keys.items()))
        state = len(self._keys), number, key
        known = self._known
        if known is None or known[0][:2] != state[:2] or known[0][2] is not key:
            known = self._known = state, {key[0] for key in self._keys.values()}
        return known[1]
