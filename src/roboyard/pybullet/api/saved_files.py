"""Saving states and worlds to files: saveBullet, saveWorld, loadBullet."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from roboyard.pybullet.face.arguments import text
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.file_search import find_file, not_found_remedy
from roboyard.untrusted.arrays import ArraysError, read_arrays

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.physics_scene import PhysicsScene

_NOT_SAVED, _NOT_RESTORED = "Couldn't save .bullet file.", "Couldn't restore state."
_FORMAT = 1
_MAX_BYTES = 256 << 20


@command()
def saveBullet(client: Client, bulletFileName: str) -> None:
    """Write the positions and velocities of all bodies to a file that restoreState reads.

    Raises:
        error: the file cannot be written.
    """
    scene = client.scene
    arrays: dict[str, np.ndarray] = {
        "format": np.array(_FORMAT),
        "bodies": np.array(scene.order, dtype=np.int64),
    }
    moment = scene.world.save_state()
    arrays["values"] = moment.values
    arrays["static_positions"] = moment.static_positions
    arrays["static_quaternions"] = moment.static_quaternions
    arrays["joints"] = _joint_counts(scene)
    try:
        with client.output_files.path(text(bulletFileName)).open("wb") as file:
            np.savez(file, allow_pickle=False, **arrays)
    except OSError as problem:
        raise failure(_NOT_SAVED, str(problem)) from None


def restore_from_file(client: Client, file_name: str) -> None:
    """Restore the positions and velocities of all bodies from a file of saveBullet.

    Raises:
        error: the file does not exist, is of another kind, or was saved with other bodies.
    """
    path = find_file(client.search_path, text(file_name), client.mounts)
    if path is None:
        raise failure(_NOT_RESTORED, not_found_remedy(client.search_path, file_name))
    try:
        arrays = read_arrays(path, _MAX_BYTES)
    except (OSError, ArraysError) as problem:
        raise failure(_NOT_RESTORED, f"{path.name} was not written by saveBullet: {problem}") from None
    scene = client.scene
    scene.world.ensure_compiled()
    if arrays.get("bodies") is None or arrays["bodies"].tolist() != scene.order:
        raise failure(_NOT_RESTORED, f"{path.name} was saved with other bodies; load the same bodies first")
    present = scene.world.save_state()
    fits = arrays.get("joints") is not None and np.array_equal(arrays["joints"], _joint_counts(scene))
    for name in ("values", "static_positions", "static_quaternions"):
        there = arrays.get(name)
        like = getattr(present, name)
        fits = fits and there is not None and there.shape == like.shape and there.dtype == like.dtype
    if not fits:
        raise failure(
            _NOT_RESTORED,
            f"{path.name} was saved with other bodies of the same ids; load the same bodies first",
        )
    scene.world.restore_state(
        replace(
            present,
            values=arrays["values"],
            static_positions=arrays["static_positions"],
            static_quaternions=arrays["static_quaternions"],
        )
    )
    for record in scene.bodies.values():
        record.fixed_poses = record.placed = None
    scene.mark_moved()


def _joint_counts(scene: PhysicsScene) -> np.ndarray:
    """Return the number of joints of each body, in the order of getBodyUniqueId."""
    return np.array([scene.bodies[number].joint_count for number in scene.order], dtype=np.int64)


@command()
def saveWorld(client: Client, worldFileName: str) -> None:
    """Write a Python script that loads the same files at the current poses and sets joints and gravity.

    Bodies of createMultiBody are skipped, and changes after loading are not saved.

    Raises:
        error: the file cannot be written.
    """
    from roboyard.pybullet.logs.world_scripts import world_script

    try:
        client.output_files.path(text(worldFileName)).write_text(world_script(client), encoding="utf-8")
    except OSError as problem:
        raise failure("saveWorld command execution failed.", str(problem)) from None


@command()
def loadBullet(client: Client, bulletFileName: str) -> tuple[int, ...]:
    """Raise an error: Bullet's binary files contain its internal structures and cannot be read.

    Raises:
        error: always.
    """
    path = find_file(client.search_path, text(bulletFileName), client.mounts)
    remedy = (
        not_found_remedy(client.search_path, bulletFileName)
        if path is None
        else "load bodies from their own files; restoreState(fileName=...) reads what saveBullet wrote"
    )
    raise failure("Couldn't load .bullet file.", remedy)
