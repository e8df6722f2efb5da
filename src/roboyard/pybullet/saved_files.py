"""Saving the moment to disk and going back to it: saveBullet and restoreState(fileName=...)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING
from zipfile import BadZipFile

import numpy as np

from roboyard.pybullet.arguments import text
from roboyard.pybullet.commands import command
from roboyard.pybullet.errors import failure
from roboyard.pybullet.joint_tables import POSITION_COUNT
from roboyard.pybullet.search import find_file, not_found_remedy

if TYPE_CHECKING:
    from roboyard.pybullet.clients import Client
    from roboyard.pybullet.records import BodyRecord

_NOT_SAVED, _NOT_RESTORED = "Couldn't save .bullet file.", "Couldn't restore state."
_FORMAT = 1


@command()
def saveBullet(client: Client, bulletFileName: str) -> None:
    """Write positions and velocities of all bodies to a file that restoreState reads."""
    scene = client.scene
    arrays: dict[str, np.ndarray] = {
        "format": np.array(_FORMAT),
        "bodies": np.array(scene.order, dtype=np.int64),
    }
    for number in scene.order:
        record = scene.ready(number, _NOT_SAVED)
        position, orientation = record.body.pose
        linear, angular = record.body.velocity
        positions, velocities = _joint_places(record)
        arrays[f"base{number}"] = np.concatenate([position, orientation, linear, angular])
        arrays[f"positions{number}"] = record.qpos[positions]
        arrays[f"velocities{number}"] = record.qvel[velocities]
    try:
        with Path(text(bulletFileName)).open("wb") as file:
            np.savez(file, allow_pickle=False, **arrays)
    except OSError as problem:
        raise failure(_NOT_SAVED, str(problem)) from None


def restore_from_file(client: Client, file_name: str) -> None:
    """Put all bodies where a file of saveBullet has them.

    Raises:
        error: the file is not there, is no such file, or was saved with other bodies.
    """
    path = find_file(client, text(file_name))
    if path is None:
        raise failure(_NOT_RESTORED, not_found_remedy(client, file_name))
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
    except (OSError, ValueError, BadZipFile, EOFError) as problem:
        raise failure(_NOT_RESTORED, f"{path.name} was not written by saveBullet: {problem}") from None
    scene = client.scene
    if arrays.get("bodies") is None or arrays["bodies"].tolist() != scene.order:
        raise failure(_NOT_RESTORED, "the file was saved with other bodies in the world")
    for number in scene.order:
        record = scene.ready(number, _NOT_RESTORED)
        positions, velocities = _joint_places(record)
        base, q, v = (arrays.get(f"{name}{number}") for name in ("base", "positions", "velocities"))
        if (
            base is None
            or q is None
            or v is None
            or (len(base), len(q), len(v)) != (13, len(positions), len(velocities))
        ):
            raise failure(_NOT_RESTORED, f"body {number} was another one when the file was saved")
        record.body.set_pose(base[:3], base[3:7])
        record.body.set_velocity(base[7:10], base[10:13])
        record.qpos[positions], record.qvel[velocities] = q, v
    scene.mark_moved()


def _joint_places(record: BodyRecord) -> tuple[list[int], list[int]]:
    """Places of a body's joints in qpos and in qvel."""
    joints = [info[0] for info in record.infos if POSITION_COUNT[info[2]]]
    positions = [i for j in joints for i in range(record.positions_of(j).start, record.positions_of(j).stop)]
    velocities = [
        i for j in joints for i in range(record.velocities_of(j).start, record.velocities_of(j).stop)
    ]
    return positions, velocities


@command()
def saveWorld(client: Client, worldFileName: str) -> None:
    """Write a script that loads the same files at the present poses, and sets joints and gravity.

    Bodies made by createMultiBody come from no file and are left out, as is what was changed after loading.
    """
    from roboyard.pybullet.world_scripts import world_script

    try:
        Path(text(worldFileName)).write_text(world_script(client), encoding="utf-8")
    except OSError as problem:
        raise failure("saveWorld command execution failed.", str(problem)) from None


@command()
def loadBullet(client: Client, bulletFileName: str) -> tuple[int, ...]:
    """Bullet's own files hold its internal structures and cannot be read; always raises."""
    path = find_file(client, text(bulletFileName))
    remedy = (
        not_found_remedy(client, bulletFileName)
        if path is None
        else "load bodies from their own files; restoreState(fileName=...) reads what saveBullet wrote"
    )
    raise failure("Couldn't load .bullet file.", remedy)
