"""Mesh files from which no triangles can be read: Bullet warns and loads the rest of the robot."""

from __future__ import annotations

from dataclasses import replace
from operator import is_
from os.path import isfile, join
from typing import TYPE_CHECKING

from roboyard._lazy import LazyLogger
from roboyard.description.model import Collision, Mesh, Visual
from roboyard.errors import DescriptionError, MeshError
from roboyard.pybullet.bullet_rules.mesh_objects import is_known
from roboyard.shapes.mesh import NO_TRIANGLES
from roboyard.untrusted.files import read_head

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from roboyard.description.model import Link, RobotDescription

_log = LazyLogger("roboyard")
_POINTER = b"version https://git-lfs"
_TYPES = (".obj", ".stl", ".dae", ".cdf", ".vtk")
_LONGEST_BLANK = 80
"""Size (bytes) up to which a file that begins with blanks is empty; longer ones have an STL file's header."""


def without_unreadable_meshes(description: RobotDescription) -> RobotDescription:
    """Return the description without collision meshes that cannot be read, and with empty visual ones.

    Visual meshes are not read before something shows them: only files that are empty, or pointers of git-lfs,
    are found here. Each file skipped is logged as a warning that says why.
    """
    links = tuple(_readable(link) for link in description.links)
    return description if all(map(is_, links, description.links)) else replace(description, links=links)


def skips_meshes(description: RobotDescription) -> bool:
    """Return whether meshes are skipped that the description may not read; each is logged as a warning."""
    skipped = dict.fromkeys(uri for link in description.links for uri in _without_file(link))
    for uri in skipped:
        _log.warning(
            "%s: mesh %r is outside the robot's folders, links resolved, and skipped; "
            "setAdditionalSearchPath lets its folder be read",
            description.source.file or description.name,
            uri,
        )
    return bool(skipped)


def lacks_meshes(description: RobotDescription, folder: Path) -> bool:
    """Return whether mesh files are missing; those that are there, but may not be read, do not count.

    Args:
        description: of which these files were looked for.
        folder: of its file.
    """
    return any(not _is_there(uri, folder) for link in description.links for uri in _without_file(link))


def _without_file(link: Link) -> Iterator[str]:
    """Yield what a link's file calls meshes for which no file was found that may be read."""
    for shape in (*link.collisions, *link.visuals):
        mesh = shape.geometry
        if isinstance(mesh, Mesh) and mesh.path is None and mesh.data is None:
            yield mesh.uri


def _is_there(uri: str, folder: Path) -> bool:
    return isfile(join(folder, uri.removeprefix("file://")))  # noqa: PTH113, PTH118 - False for any text


def refuse_unknown_types(description: RobotDescription) -> None:
    """Refuse mesh files whose names do not end as Bullet's do.

    Raises:
        DescriptionError: there is such a file.
    """
    for link in description.links:
        for shape in (*link.collisions, *link.visuals):
            file = _mesh_file(shape)
            if file is not None and not file.name.lower().endswith(_TYPES):
                raise DescriptionError(
                    f"mesh {file.name!r} is of an unknown type; use {', '.join(_TYPES)}",
                    element=f'link "{link.name}"',
                )


def _readable(link: Link) -> Link:
    collisions = tuple(shape for shape in link.collisions if _loads(shape))
    visuals = tuple(_emptied(shape) if _is_stand_in(shape) else shape for shape in link.visuals)
    if len(collisions) == len(link.collisions) and all(map(is_, visuals, link.visuals)):
        return link
    return replace(link, collisions=collisions, visuals=visuals)


def _loads(shape: Collision) -> bool:
    from roboyard.shapes.load import load_mesh

    file = _mesh_file(shape)
    if file is None or is_known(file):
        return True
    try:
        load_mesh(file)
    except MeshError as problem:
        _log.warning("%s; the collision shape is skipped", problem)
        return False
    return True


def _mesh_file(shape: Collision | Visual) -> Path | None:
    """Return the file that the triangles of a shape are still to be read from."""
    geometry = shape.geometry
    return geometry.path if isinstance(geometry, Mesh) and geometry.data is None else None


def _is_stand_in(shape: Visual) -> bool:
    file = _mesh_file(shape)
    if file is None:
        return False
    try:
        beginning = read_head(file, len(_POINTER))
        is_blank = not beginning.strip() and file.stat().st_size <= _LONGEST_BLANK
    except OSError:
        return False
    if not is_blank and beginning != _POINTER:
        return False
    _log.warning("%s: no mesh (empty, or a git-lfs pointer: git lfs pull); shown as nothing", file)
    return True


def _emptied(shape: Visual) -> Visual:
    if not isinstance(shape.geometry, Mesh):
        return shape
    return replace(shape, geometry=replace(shape.geometry, data=NO_TRIANGLES))
