"""Text that scripts attach to bodies, links and visual shapes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from roboyard.pybullet.face.arguments import text, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.ids import IdPool

if TYPE_CHECKING:
    from collections.abc import Iterable
    from xml.etree.ElementTree import Element

    from roboyard.pybullet.connections import Client
    from roboyard.pybullet.state.body_records import BodyRecord


@dataclass(frozen=True, slots=True)
class UserDataKey:
    """What an entry hangs on, and its key."""

    body: int
    link: int
    shape: int
    key: str


class UserData:
    """Entries by id, counted from 0; ids freed last come back first."""

    def __init__(self) -> None:
        self._ids = IdPool()
        self._values: dict[int, bytes] = {}
        self._places: dict[int, UserDataKey] = {}
        self._numbers: dict[UserDataKey, int] = {}

    def put(self, place: UserDataKey, value: str) -> int:
        """Id of the entry: the same one where the place has an entry."""
        number = self._numbers.get(place)
        if number is None:
            number = self._ids.take()
            self._numbers[place] = number
            self._places[number] = place
        self._values[number] = value.encode()
        return number

    def find(self, place: UserDataKey) -> int:
        return self._numbers.get(place, -1)

    def value(self, number: int) -> bytes | None:
        return self._values.get(number)

    def remove(self, number: int) -> bool:
        """False where there is no such entry."""
        place = self._places.pop(number, None)
        if place is None:
            return False
        del self._numbers[place], self._values[number]
        self._ids.free(number)
        return True

    def of_body(self, body: int) -> list[tuple[int, UserDataKey]]:
        """Entries of a body in the order in which their ids were given out."""
        return [(n, self._places[n]) for n in self._places if self._places[n].body == body]

    def forget_bodies(self, bodies: Iterable[int]) -> None:
        gone = set(bodies)
        for number in [n for n, place in self._places.items() if place.body in gone]:
            self.remove(number)


def attach_from_file(client: Client, record: BodyRecord) -> None:
    """Attach a URDF file's `<bullet><user-data key="...">` entries, of the robot, links and visuals."""
    description = record.model.description
    _attach(client, record.number, -1, -1, description.extra)
    for index, link in enumerate(record.model.links, start=-1):
        _attach(client, record.number, index, -1, description.link_by_name[link.name].extra)
        for shape, visual in enumerate(link.visuals):
            _attach(client, record.number, index, shape, visual.extra)


def _attach(client: Client, body: int, link: int, shape: int, extra: tuple[Element, ...]) -> None:
    for element in extra:
        for entry in element.findall("user-data") if element.tag == "bullet" else ():
            key = entry.get("key")
            if key is not None:
                client.user_data.put(UserDataKey(body, link, shape, key), entry.text or "")


@command()
def addUserData(
    client: Client, bodyUniqueId: int, key: str, value: str, linkIndex: int = -1, visualShapeIndex: int = -1
) -> int:
    """Attach text under a key to a body, link or visual shape and give its id; the key's old text goes."""
    place = UserDataKey(whole(bodyUniqueId), whole(linkIndex), whole(visualShapeIndex), text(key))
    record = client.scene.bodies.get(place.body)
    if record is None:
        raise failure("Error in addUserData command.", f"there is no body {place.body}")
    return client.user_data.put(place, text(value))


@command()
def getUserData(client: Client, userDataId: int) -> bytes | None:
    """The text of an entry, or None."""
    return client.user_data.value(whole(userDataId))


@command()
def getUserDataId(
    client: Client, bodyUniqueId: int, key: str, linkIndex: int = -1, visualShapeIndex: int = -1
) -> int:
    """Id of an entry, or -1."""
    return client.user_data.find(
        UserDataKey(whole(bodyUniqueId), whole(linkIndex), whole(visualShapeIndex), text(key))
    )


@command()
def getNumUserData(client: Client, bodyUniqueId: int) -> int:
    """How many entries a body has."""
    return len(client.user_data.of_body(whole(bodyUniqueId)))


@command()
def getUserDataInfo(
    client: Client, bodyUniqueId: int, userDataIndex: int
) -> tuple[int, bytes, int, int, int]:
    """Id, key, body, link and visual shape of a body's i-th entry."""
    entries = client.user_data.of_body(whole(bodyUniqueId))
    if not 0 <= whole(userDataIndex) < len(entries):
        raise failure(
            "Could not get user data info.", f"body {bodyUniqueId} has {len(entries)} entries of user data"
        )
    number, place = entries[userDataIndex]
    return number, place.key.encode(), place.body, place.link, place.shape


@command()
def removeUserData(client: Client, userDataId: int) -> None:
    """Remove an entry."""
    if not client.user_data.remove(whole(userDataId)):
        raise failure("Error in removeUserData command.", f"there is no user data {userDataId}")


@command(aliases={"bodyUniqueIds": "bodyUniqueId"})
def syncUserData(client: Client, bodyUniqueId: int | Iterable[int] = -1) -> None:
    """Nothing to do: a client here never has stale data."""
