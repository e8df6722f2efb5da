"""Text that scripts attach to bodies, links and visual shapes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard.pybullet.face.arguments import text, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import replace_user_data
from roboyard.pybullet.state.user_data import UserDataKey

if TYPE_CHECKING:
    from collections.abc import Iterable
    from xml.etree.ElementTree import Element

    from roboyard.pybullet.bullet_rules.models import BodyModel
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord


def attach_from_file(client: Client, record: BodyRecord) -> None:
    """Add the `<bullet><user-data key="...">` entries of a URDF file: of the robot, links and visuals."""
    for link, shape, key, content in record.model.once("user_data", _entries):
        client.user_data.put(UserDataKey(record.number, link, shape, key), content)


def _entries(model: BodyModel) -> list[tuple[int, int, str, str]]:
    """Return link, visual shape (-1 for none), key and text of each entry."""
    description = model.description
    found = _entries_of(-1, -1, description.extra)
    for index, link in enumerate(model.links, start=-1):
        found += _entries_of(index, -1, description.link_by_name[link.name].extra)
        for shape, visual in enumerate(link.visuals):
            found += _entries_of(index, shape, visual.extra)
    return found


def _entries_of(link: int, shape: int, extra: tuple[Element, ...]) -> list[tuple[int, int, str, str]]:
    entries = (
        entry for element in extra if element.tag == "bullet" for entry in element.findall("user-data")
    )
    return [
        (link, shape, key, entry.text or "") for entry in entries if (key := entry.get("key")) is not None
    ]


@command()
def addUserData(
    client: Client, bodyUniqueId: int, key: str, value: str, linkIndex: int = -1, visualShapeIndex: int = -1
) -> int:
    """Attach text to a body, link or visual shape and return its id; an entry of the same key is replaced.

    Raises:
        error: the body does not exist.
    """
    place = whole(bodyUniqueId), whole(linkIndex), whole(visualShapeIndex), text(key)
    if place[0] not in client.scene.bodies:
        raise failure("Error in addUserData command.", f"there is no body {bodyUniqueId}")
    return client.user_data.put(place, text(value))


@command()
def getUserData(client: Client, userDataId: int) -> bytes | None:
    """Return the text of an entry, or None."""
    return client.user_data.value(whole(userDataId))


@command()
def getUserDataId(
    client: Client, bodyUniqueId: int, key: str, linkIndex: int = -1, visualShapeIndex: int = -1
) -> int:
    """Return the id of an entry, or -1."""
    return client.user_data.find((whole(bodyUniqueId), whole(linkIndex), whole(visualShapeIndex), text(key)))


@command()
def getNumUserData(client: Client, bodyUniqueId: int) -> int:
    """Return the number of entries of a body."""
    return len(client.user_data.of_body(whole(bodyUniqueId)))


@command()
def getUserDataInfo(
    client: Client, bodyUniqueId: int, userDataIndex: int
) -> tuple[int, bytes, int, int, int]:
    """Return id, key, body, link and visual shape of a body's i-th entry.

    Raises:
        error: there is no such entry.
    """
    entries = client.user_data.of_body(whole(bodyUniqueId))
    if not 0 <= whole(userDataIndex) < len(entries):
        raise failure(
            "Could not get user data info.", f"body {bodyUniqueId} has {len(entries)} entries of user data"
        )
    number, place = entries[userDataIndex]
    return number, place.key.encode(), place.body, place.link, place.shape


@command()
def removeUserData(client: Client, userDataId: int) -> None:
    """Remove an entry.

    Raises:
        error: there is no such entry.
    """
    if not client.user_data.remove(whole(userDataId)):
        raise failure("Error in removeUserData command.", f"there is no user data {userDataId}")


@command(aliases={"bodyUniqueIds": "bodyUniqueId"})
def syncUserData(client: Client, bodyUniqueId: int | Iterable[int] = -1) -> None:
    """Do nothing: a client in this process always has current data."""


START.later(replace_user_data, "addUserData", "getUserDataId", "getUserData", "removeUserData")
