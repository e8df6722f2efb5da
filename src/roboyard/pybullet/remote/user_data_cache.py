"""A remote client's copy of the server's user data: its own entries, and others as of the last sync.

PyBullet does the same, and scripts with several clients rely on it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.user_data import UserDataKey

Ask = Callable[..., Any]


@dataclass(frozen=True, slots=True)
class _Entry:
    place: UserDataKey
    value: bytes


class UserDataCache:
    """Entries by the server's ids."""

    def __init__(self, ask: Ask) -> None:
        """Start empty; `ask` sends a command to the server."""
        self._ask = ask
        self._entries: dict[int, _Entry] = {}

    def add(self, body: int, key: str, value: str, link: int, shape: int) -> int:
        """Add an entry on the server and return its id."""
        number = self._ask("addUserData", body, key, value, link, shape)
        self._entries[number] = _Entry(UserDataKey(body, link, shape, key), value.encode())
        return number

    def remove(self, number: int) -> None:
        """Remove an entry on the server."""
        self._ask("removeUserData", number)
        self._entries.pop(number, None)

    def value(self, number: int) -> bytes | None:
        """Return the text of an entry, or None."""
        entry = self._entries.get(number)
        return None if entry is None else entry.value

    def find(self, place: UserDataKey) -> int:
        """Return the id of an entry, or -1."""
        return next((number for number, entry in self._entries.items() if entry.place == place), -1)

    def of_body(self, body: int) -> list[tuple[int, UserDataKey]]:
        """Return (id, key) of a body's entries, in the order of ids."""
        return [(n, e.place) for n, e in sorted(self._entries.items()) if e.place.body == body]

    def info(self, body: int, index: int) -> tuple[int, bytes, int, int, int]:
        """Return id, key, body, link and visual shape of a body's i-th entry.

        Raises:
            error: there is no such entry.
        """
        entries = self.of_body(body)
        if not 0 <= index < len(entries):
            raise failure(
                "Could not get user data info.",
                f"body {body} has {len(entries)} cached entries, not an entry {index}; call syncUserData",
            )
        number, place = entries[index]
        return number, place.key.encode(), place.body, place.link, place.shape

    def sync(self, bodies: int | Iterable[int]) -> None:
        """Fetch the entries of bodies from the server; all for -1."""
        if bodies == -1:
            self._entries.clear()
            wanted = [self._ask("getBodyUniqueId", i) for i in range(self._ask("getNumBodies"))]
        else:
            wanted = [bodies] if isinstance(bodies, int) else list(bodies)
            self.forget(wanted)
        for body in wanted:
            for index in range(self._ask("getNumUserData", body)):
                number, key, at, link, shape = self._ask("getUserDataInfo", body, index)
                value = self._ask("getUserData", number)
                self._entries[number] = _Entry(UserDataKey(at, link, shape, key.decode()), value)

    def forget(self, bodies: Iterable[int]) -> None:
        """Drop the entries of bodies."""
        gone = set(bodies)
        self._entries = {n: e for n, e in self._entries.items() if e.place.body not in gone}

    def clear(self) -> None:
        """Drop all entries."""
        self._entries.clear()
