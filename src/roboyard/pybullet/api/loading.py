"""Loading robots and scenes from files: loadURDF, loadSDF, loadMJCF and the search path."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from os import stat
from pathlib import Path
from posixpath import dirname, expanduser
from typing import TYPE_CHECKING

from roboyard._lazy import lazy_module
from roboyard.description.urdf.xml_repair import TEXT_NOTE
from roboyard.errors import DescriptionError, RoboyardError
from roboyard.pybullet.api.user_data import attach_from_file
from roboyard.pybullet.bullet_rules.materials import shared_materials
from roboyard.pybullet.bullet_rules.mesh_objects import mesh_contents
from roboyard.pybullet.bullet_rules.models import BodyModel, bullet_model
from roboyard.pybullet.bullet_rules.unreadable_meshes import (
    lacks_meshes,
    refuse_unknown_types,
    skips_meshes,
    without_unreadable_meshes,
)
from roboyard.pybullet.face.arguments import check_finite, number, quaternion, text, vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.bodies.body_records import MULTIBODY, RIGID_BODY
from roboyard.pybullet.state.file_search import (
    find_file,
    folders_above,
    is_as_named,
    is_file,
    not_found_remedy,
    program_folders,
)
from roboyard.pybullet.state.pair_filters import self_collisions
from roboyard.pybullet.state.soft_records import add_soft_body
from roboyard.transforms import conjugate, multiply, quaternion_from_matrix, rotate
from roboyard.untrusted.files import is_inside

if TYPE_CHECKING:
    from roboyard.description.model import RobotDescription
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord

Vector = Sequence[float]
_NO_URDF, _NO_SDF, _NO_MJCF = "Cannot load URDF file.", "Cannot load SDF file.", "Couldn't load .mjcf file."
_soft_reader = lazy_module("roboyard.pybullet.readers.deformable")
_BEGINNING = 65536
"""Bytes of a URDF file in which soft bodies are looked for."""
_CACHE_SIZE = 64
_NAMED_FOLDERS = 64
"""Folders of files that a client remembers."""
_cache: dict[tuple[Path, int, int], RobotDescription] = {}
"""Parsed files by path, modification time and size."""
_models: dict[tuple[int, int, float, bool], tuple[RobotDescription, tuple[object, ...], BodyModel]] = {}
"""Bullet's models by id of a description and arguments; with the description and its meshes."""


_folder = lru_cache(maxsize=16)(Path)


@command()
def setAdditionalSearchPath(client: Client, path: str) -> None:
    """Set the folder where files are searched after the working directory; it replaces the previous one.

    As in Bullet, it holds for all clients of the process, also for those that connect later.
    """
    search = client.search
    if path is search.given and search.folder is client.searched is not None:
        return
    search.folder = folder = _folder(text(path))
    search.given = path
    if folder is not client.searched:
        client.searched = folder
        _note_folder(client, folder)


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
    """Load a robot and return its id; all calling forms of loadURDF end here.

    Raises:
        error: the file does not exist or cannot be loaded.
    """
    position = vector3(basePosition, "Cannot convert basePosition.")
    orientation = quaternion(baseOrientation, "Cannot convert baseOrientation.")
    given_flags, scale = whole(flags), number(globalScaling)
    check_finite(_NO_URDF, basePosition=position, baseOrientation=orientation, globalScaling=scale)
    path = _existing(client, fileName, _NO_URDF)
    try:
        description = _cached_description(client, path)
        if description is None and _mentions_deformable(path) and _soft_reader().describes_deformable(path):
            find = partial(_beside, client, path.parent)
            soft = _soft_reader().read_deformable(path, find, scale if scale > 0 else 1.0)
            made = add_soft_body(client.scene, soft, position, orientation, link_name="", file=str(path))
            return made.number
        model = _model_of(
            description or read_description(client, path),
            given_flags,
            scale if scale > 0 else 1.0,
            bool(whole(useFixedBase)),
        )
        record = client.scene.add(
            model,
            position,
            orientation,
            self_collisions=self_collisions(given_flags),
            file=str(path),
            kind=RIGID_BODY if whole(useMaximalCoordinates) == 1 else MULTIBODY,
        )
    except RoboyardError as problem:
        raise failure(_NO_URDF, *str(problem).splitlines()) from problem
    if is_as_named(path, text(fileName)):
        record.folder = dirname(fileName)
    attach_from_file(client, record)
    _apply_file_filters(client, record)
    return record.number


def _model_of(description: RobotDescription, flags: int, scale: float, fixed_base: bool) -> BodyModel:
    """Return `bullet_model` of a description; cached, so that bodies of one file share their description."""
    key = id(description), flags, scale, fixed_base
    known, meshes = _models.get(key), mesh_contents(description)
    if known is None or list(map(id, known[1])) != list(map(id, meshes)):
        model = bullet_model(description, flags=flags, scale=scale, fixed_base=fixed_base)
        known = _models[key] = description, meshes, model
        while len(_models) > _CACHE_SIZE:
            del _models[next(iter(_models))]
    return known[2].copied()  # a base that is freed is noted there


def _mentions_deformable(file: Path) -> bool:
    """Return whether a URDF file has the word, without which it describes no soft body."""
    with file.open("rb") as stream:
        return b"deformable" in stream.read(_BEGINNING)


def _beside(client: Client, folder: Path, name: str) -> Path | None:
    """Return the mesh of a soft body: a file in the folder of its URDF, or where scripts' files are."""
    beside = folder / name
    if is_file(beside) and is_inside(beside, [folder]):
        return beside
    return find_file(client.search.folder, name, client.mounts)


def _apply_file_filters(client: Client, record: BodyRecord) -> None:
    """Apply the collision groups and masks of the file; the last collision of a link counts."""
    filters = client.scene.filters
    for link, given in record.model.once("filters", _file_filters):
        group = given.get("group", filters.group_of(record.number, link))
        filters.set_group((record.number, link), group, given.get("mask", -1), is_first=True)


def _file_filters(model: BodyModel) -> list[tuple[int, dict[str, int]]]:
    """Return the links with a collision group or mask in the file."""
    found = []
    for link, part in enumerate(model.links, start=-1):
        given = {
            key: int(value)
            for shape in part.collisions
            for key, value in shape.attributes
            if key in ("group", "mask") and value.strip().lstrip("-").isdigit()
        }
        if given:
            found.append((link, given))
    return found


def _key_of(file: Path) -> tuple[Path, int, int]:
    stamp = stat(file)  # noqa: PTH116 - faster than the path's own
    return file, stamp.st_mtime_ns, stamp.st_size


def _cached_description(client: Client, file: Path) -> RobotDescription | None:
    """Return the description of a URDF file that was read before and has not changed, of no soft body."""
    return _cache.get(_key_of(file)) if _cache and client.parameters.file_caching else None


def read_description(client: Client, path: Path) -> RobotDescription:
    """Return the description of a URDF file, parsed as leniently as Bullet does; cached by file.

    Raises:
        DescriptionError: the file is not usable, or a joint lacks the limit that Bullet requires.
    """
    from roboyard.description import load_description

    found = _cached_description(client, path)
    if found is None:
        key = _key_of(path)
        search, readable = _search_paths(client), _readable_folders(client)
        load = partial(load_description, path, readable=readable, words_are_zero=True)
        found = load(search_paths=search, missing_meshes="note")
        if lacks_meshes(found, path.parent):
            found = load(search_paths=[*search, *folders_above(path)], missing_meshes="note")
            if lacks_meshes(found, path.parent):
                load(search_paths=search)  # raises the error that says which, and where they were looked for
        if any(TEXT_NOTE in note for note in found.notes):
            raise DescriptionError("text behind the root element; remove it", file=path)
        for joint in found.joints:
            if joint.type in ("revolute", "prismatic") and joint.limit is None:
                raise DescriptionError(
                    f'a {joint.type} joint needs a <limit>; add one, or use type="continuous"',
                    file=path,
                    line=joint.source.line,
                    element=f'joint "{joint.name}"',
                )
        refuse_unknown_types(found)
        found = shared_materials(found)
        complete = without_unreadable_meshes(found)
        if skips_meshes(found) or complete is not found:  # not cached: the files may be fetched meanwhile
            return complete
        _cache[key] = found
        while len(_cache) > _CACHE_SIZE:
            del _cache[next(iter(_cache))]
    return found


@command()
def loadSDF(
    client: Client, sdfFileName: str, useMaximalCoordinates: int = 0, globalScaling: float = -1.0
) -> tuple[int, ...]:
    """Load every model of an SDF file and return their ids.

    Raises:
        error: the file does not exist or cannot be loaded.
    """
    from roboyard.pybullet.readers.sdf import read_models

    path = _existing(client, sdfFileName, _NO_SDF)
    scale = number(globalScaling) if number(globalScaling) > 0 else 1.0
    check_finite(_NO_SDF, globalScaling=scale)
    rigid = whole(useMaximalCoordinates) == 1
    ids = []
    try:
        uses_cache = bool(client.parameters.file_caching)
        folders = _search_paths(client), _readable_folders(client)
        for part in read_models(path, *folders, uses_cache=uses_cache):
            model = _model_of(part.description, 0, scale, part.is_static)
            record = client.scene.add(
                model,
                part.pose[:3, 3] * scale,
                quaternion_from_matrix(part.pose[:3, :3]),
                file=str(path),
                kind=RIGID_BODY if rigid and len(model.links) == 1 else MULTIBODY,
            )
            if is_as_named(path, text(sdfFileName)):
                record.folder = dirname(sdfFileName)
            ids.append(record.number)
    except RoboyardError as problem:
        raise failure(_NO_SDF, *str(problem).splitlines()) from problem
    return tuple(ids)


@command()
def loadMJCF(client: Client, mjcfFileName: str, flags: int = 0, useMultiBody: int = 1) -> tuple[int, ...]:
    """Load every top-level body of an MJCF file, and each fixed shape, and return their ids.

    Bullet reads a subset of MJCF and makes a link of its own for every joint; this function does the same.
    `World.add_mjcf` reads the whole format.

    Raises:
        error: the file does not exist or cannot be loaded.
    """
    from roboyard.pybullet.readers.mjcf_models import read_models

    path = _existing(client, mjcfFileName, _NO_MJCF)
    given = whole(flags)
    ids = []
    scene = client.scene
    try:
        uses_cache = bool(client.parameters.file_caching)
        for part, model, names in read_models(path, _search_paths(client), given, uses_cache=uses_cache):
            frame = model.links[0].frame
            orientation = multiply(part.orientation, conjugate(frame.quaternion))
            record = scene.add(
                model,
                part.position - rotate(orientation, frame.position),
                orientation,
                self_collisions=self_collisions(given),
                file=str(path),
                kind=RIGID_BODY if not whole(useMultiBody) and len(model.links) == 1 else MULTIBODY,
            )
            record.shapes.is_mjcf = True
            if names:
                record.rename_joints(names)
            ids.append(record.number)
            for name, (group, mask) in part.filters.items():
                place = record.number, model.index_by_name[name]
                scene.filters.set_group(place, group, mask, is_first=True)
    except RoboyardError as problem:
        raise failure(_NO_MJCF, *str(problem).splitlines()) from problem
    return tuple(ids)


def _existing(client: Client, name: str, message: str) -> Path:
    path = find_file(client.search.folder, text(name), client.mounts)
    if path is None:
        raise failure(message, not_found_remedy(client.search.folder, name))
    _note_folder(client, path.parent)
    return path


def _search_paths(client: Client) -> list[Path]:
    """Return the folders whose meshes a file may name, by absolute paths too.

    Programs write files into a temporary folder that name the meshes of others, which they loaded before.
    """
    given = [client.search.folder.absolute()] if client.search.folder else []
    return [*given, *client.named_folders]


def _readable_folders(client: Client) -> tuple[Path, ...]:
    """Return the folders whose files may be named besides; none for what strangers load through a server."""
    return program_folders() if client.output_files.is_free else ()


def _note_folder(client: Client, folder: Path) -> None:
    """Remember a folder that the script has named, unless all of the user's files are below it."""
    named = client.named_folders
    if folder in named:
        return
    folder = folder.absolute()
    if folder in named or Path(expanduser("~")).is_relative_to(folder):
        return
    while len(named) >= _NAMED_FOLDERS:
        del named[next(iter(named))]
    named[folder] = None
