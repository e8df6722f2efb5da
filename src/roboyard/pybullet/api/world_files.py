"""loadSDF and loadMJCF: files that hold several bodies."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from roboyard.errors import RoboyardError
from roboyard.pybullet.bullet_rules.models import bullet_model
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import number, text, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.body_records import MULTIBODY, RIGID_BODY
from roboyard.pybullet.state.file_search import find_file, not_found_remedy
from roboyard.transforms import conjugate, multiply, quaternion_from_matrix, rotate

if TYPE_CHECKING:
    from roboyard.pybullet.connections import Client

_NO_SDF, _NO_MJCF = "Cannot load SDF file.", "Couldn't load .mjcf file."
_SELF_COLLISION = c.URDF_USE_SELF_COLLISION | c.URDF_USE_SELF_COLLISION_INCLUDE_PARENT


@command()
def loadSDF(
    client: Client, sdfFileName: str, useMaximalCoordinates: int = 0, globalScaling: float = -1.0
) -> tuple[int, ...]:
    """Load every model of an SDF file and give their ids."""
    from roboyard.pybullet.readers.sdf import load_sdf

    path = _found(client, sdfFileName, _NO_SDF)
    scale = number(globalScaling) if number(globalScaling) > 0 else 1.0
    rigid = whole(useMaximalCoordinates) == 1
    ids = []
    try:
        for part in load_sdf(path, _search_paths(client)):
            model = bullet_model(part.description, scale=scale, fixed_base=part.is_static)
            record = client.scene.add(
                model,
                part.pose[:3, 3] * scale,
                quaternion_from_matrix(part.pose[:3, :3]),
                file=str(path),
                kind=RIGID_BODY if rigid and len(model.links) == 1 else MULTIBODY,
            )
            ids.append(record.number)
    except RoboyardError as problem:
        raise failure(_NO_SDF, *str(problem).splitlines()) from problem
    return tuple(ids)


@command()
def loadMJCF(client: Client, mjcfFileName: str, flags: int = 0, useMultiBody: int = 1) -> tuple[int, ...]:
    """Load every body at the top of an MJCF file, and each of its fixed shapes, and give their ids.

    Bullet reads a part of MJCF only and makes of every joint a link of its own; so does this.
    `World.add_mjcf` reads all of it.
    """
    from roboyard.pybullet.readers.mjcf import load_mjcf
    from roboyard.pybullet.readers.mjcf_inertia import boxes_as_bullet_has_them, shapes_as_bullet_has_them

    path = _found(client, mjcfFileName, _NO_MJCF)
    given = whole(flags)
    ids = []
    scene = client.scene
    try:
        for part in load_mjcf(path, _search_paths(client), colors=bool(given & c.MJCF_COLORS_FROM_FILE)):
            model = bullet_model(
                part.description,
                flags=given,
                moments_of=shapes_as_bullet_has_them(given),
                bounds_of=boxes_as_bullet_has_them(given),
            )
            frame = model.links[0].frame
            orientation = multiply(part.orientation, conjugate(frame.quaternion))
            record = scene.add(
                model,
                part.position - rotate(orientation, frame.position),
                orientation,
                self_collision=bool(given & _SELF_COLLISION),
                file=str(path),
                kind=RIGID_BODY if not whole(useMultiBody) and len(model.links) == 1 else MULTIBODY,
            )
            ids.append(record.number)
            for name, (group, mask) in part.filters.items():
                if (group, mask) != (1, 1):
                    scene.filters.set_group((record.number, model.index_by_name[name]), group, mask)
    except RoboyardError as problem:
        raise failure(_NO_MJCF, *str(problem).splitlines()) from problem
    return tuple(ids)


def _found(client: Client, name: str, message: str) -> Path:
    path = find_file(client, text(name))
    if path is None:
        raise failure(message, not_found_remedy(client, name))
    return path


def _search_paths(client: Client) -> list[Path]:
    return [client.search_path.absolute()] if client.search_path else []
