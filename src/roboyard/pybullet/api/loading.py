"""loadURDF: finding, reading and placing robots."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard.errors import DescriptionError, RoboyardError
from roboyard.pybullet.api.user_data import attach_from_file
from roboyard.pybullet.bullet_rules.materials import shared_materials
from roboyard.pybullet.bullet_rules.models import bullet_model
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import number, quaternion, text, vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.body_records import MULTIBODY, RIGID_BODY
from roboyard.pybullet.state.file_search import find_file, not_found_remedy

if TYPE_CHECKING:
    from roboyard.description.model import RobotDescription
    from roboyard.pybullet.connections import Client
    from roboyard.pybullet.state.body_records import BodyRecord

Vector = Sequence[float]
_NOT_LOADED = "Cannot load URDF file."
_SELF_COLLISION = c.URDF_USE_SELF_COLLISION | c.URDF_USE_SELF_COLLISION_INCLUDE_PARENT


def loadURDF(fileName: str, *args: Any, **kwargs: Any) -> int:
    """Load a robot and give its id.

    loadURDF(fileName, basePosition, baseOrientation, useMaximalCoordinates, useFixedBase, flags,
    globalScaling, physicsClientId), or in the old form loadURDF(fileName, x, y, z) with a quaternion (x, y,
    z, w) after it or not.
    """
    if args and _is_number(args[0]):
        return _load_from_numbers(fileName, args, kwargs)
    if "startPosX" in kwargs:
        numbers = [kwargs.pop(name) for name in _OLD_NAMES if name in kwargs]
        return _load_from_numbers(fileName, (*args, *numbers), kwargs)
    return _load_urdf(fileName, *args, **kwargs)


_OLD_NAMES = ("startPosX", "startPosY", "startPosZ", "startOrnX", "startOrnY", "startOrnZ", "startOrnW")


def _is_number(value: Any) -> bool:
    return hasattr(value, "__float__") and getattr(value, "ndim", 0) == 0


def _load_from_numbers(file_name: str, numbers: tuple[Any, ...], kwargs: dict[str, Any]) -> int:
    if kwargs or len(numbers) not in (3, 7):
        raise TypeError("loadURDF(fileName, x, y, z) takes three numbers, or seven with a quaternion")
    return _load_urdf(file_name, numbers[:3], numbers[3:] or (0.0, 0.0, 0.0, 1.0))


def _load_urdf(
    fileName: str,
    basePosition: Vector = (0.0, 0.0, 0.0),
    baseOrientation: Vector = (0.0, 0.0, 0.0, 1.0),
    useMaximalCoordinates: int = -1,
    useFixedBase: int = 0,
    flags: int = 0,
    globalScaling: float = -1.0,
    physicsClientId: int = 0,
) -> int:
    client: Any = CLIENTS[physicsClientId]
    return client.loadURDF(
        fileName, basePosition, baseOrientation, useMaximalCoordinates, useFixedBase, flags, globalScaling
    )


@command(name="loadURDF", is_public=False)
def _load_urdf_command(
    client: Client,
    fileName: str,
    basePosition: Vector,
    baseOrientation: Vector,
    useMaximalCoordinates: int,
    useFixedBase: int,
    flags: int,
    globalScaling: float,
) -> int:
    """The one form behind all calling forms of loadURDF."""
    position = vector3(basePosition, "Cannot convert basePosition.")
    orientation = quaternion(baseOrientation, "Cannot convert baseOrientation.")
    given_flags, scale = whole(flags), number(globalScaling)
    path = find_file(client, text(fileName))
    if path is None:
        raise failure(_NOT_LOADED, not_found_remedy(client, fileName))
    try:
        description = read_description(client, path)
        model = bullet_model(
            description,
            flags=given_flags,
            scale=scale if scale > 0 else 1.0,
            fixed_base=bool(whole(useFixedBase)),
        )
        record = client.scene.add(
            model,
            position,
            orientation,
            self_collision=bool(given_flags & _SELF_COLLISION),
            file=str(path),
            kind=RIGID_BODY if whole(useMaximalCoordinates) == 1 else MULTIBODY,
        )
    except RoboyardError as problem:
        raise failure(_NOT_LOADED, *str(problem).splitlines()) from problem
    attach_from_file(client, record)
    _filter_as_said(client, record)
    return record.number


def _filter_as_said(client: Client, record: BodyRecord) -> None:
    """Filter groups and masks that collisions of the file have as attributes; a link's last one holds."""
    filters = client.scene.filters
    for link, part in enumerate(record.model.links, start=-1):
        said = {
            key: int(value)
            for shape in part.collisions
            for key, value in shape.attributes
            if key in ("group", "mask") and value.strip().lstrip("-").isdigit()
        }
        if said:
            group = said.get("group", filters.group_of(record.number, link))
            filters.set_group((record.number, link), group, said.get("mask", -1))


def read_description(client: Client, path: Path) -> RobotDescription:
    """A URDF file, read as leniently as Bullet does; kept for the next body from the same file.

    Raises:
        DescriptionError: it cannot be used, or a joint lacks the limit that Bullet demands.
    """
    from roboyard.description import load_description

    stamp = path.stat()
    key = (path, stamp.st_mtime_ns, stamp.st_size)
    found = _read.get(key) if client.parameters.file_caching else None
    if found is None:
        search = [client.search_path.absolute()] if client.search_path else []
        found = load_description(path, search_paths=search, missing_meshes="note", words_are_zero=True)
        for joint in found.joints:
            if joint.type in ("revolute", "prismatic") and joint.limit is None:
                raise DescriptionError(
                    'a revolute or prismatic joint needs a <limit>; add one, or use type="continuous"',
                    file=path,
                    line=joint.source.line,
                    element=f'joint "{joint.name}"',
                )
        found = _read[key] = shared_materials(found)
        while len(_read) > _KEPT:
            del _read[next(iter(_read))]
    return found


_KEPT = 64
_read: dict[tuple[Path, int, int], RobotDescription] = {}
