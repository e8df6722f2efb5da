"""Saving states and worlds to files: saveBullet, saveWorld, loadBullet."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from roboyard.pybullet.face.arguments import text
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.readers.saved_arrays import write_arrays
from roboyard.pybullet.state.file_search import find_file, not_found_remedy
from roboyard.sim.stepping.impulses.point_arrays import tree_of_boxes
from roboyard.sim.stepping.impulses.records import HIDDEN
from roboyard.sim.stepping.points.kept_points import KeptPoints, MetPairs
from roboyard.untrusted.arrays import ArraysError, read_arrays

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.physics_scene import PhysicsScene

_NOT_SAVED, _NOT_RESTORED = "Couldn't save .bullet file.", "Couldn't restore state."
_FORMAT = 1
_MAX_BYTES = 256 << 20
_CONTACTS = ("contact_owners", "contact_counts", "contact_points")
"""Names of the arrays of `KeptPoints`."""
_PAIRS = ("pair_links", "pair_states", "ranked_owners", "pair_checked", "updated_links", "link_boxes")
"""Names of the arrays of `MetPairs`, with the boxes of its links instead of the tree."""


@command()
def saveBullet(client: Client, bulletFileName: str) -> None:
    """Write positions, velocities and kept contact points of all bodies to a file that restoreState reads.

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
    if moment.contacts is not None:
        arrays |= _arrays_of(moment.contacts, _places(scene))
    file = BytesIO()
    write_arrays(file, arrays)
    try:
        client.output_files.write(text(bulletFileName), file.getbuffer())
    except OSError as problem:
        raise failure(_NOT_SAVED, str(problem)) from None


def restore_from_file(client: Client, file_name: str) -> None:
    """Restore positions, velocities and kept contact points of all bodies from a file of saveBullet.

    Raises:
        error: the file does not exist, is of another kind, or was saved with other bodies.
    """
    path = find_file(client.search.folder, text(file_name), client.mounts)
    if path is None:
        raise failure(_NOT_RESTORED, not_found_remedy(client.search.folder, file_name))
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
    state = replace(
        present,
        values=arrays["values"],
        static_positions=arrays["static_positions"],
        static_quaternions=arrays["static_quaternions"],
        contacts=_contacts_in(arrays, list(_places(scene)), _joint_counts(scene) + 1),
    )
    scene.world.restore_state(state, keeps_points=True)
    for record in scene.bodies.values():
        record.fixed_poses = record.placed = None
    scene.mark_moved()


def _places(scene: PhysicsScene) -> dict[int, int]:
    """Return the place among the scene's bodies of each body of the World, in that order."""
    return {scene.bodies[number].body.id: place for place, number in enumerate(scene.order)}


def _arrays_of(contacts: KeptPoints, places: dict[int, int]) -> dict[str, np.ndarray]:
    """Return the points that pairs keep as arrays of a file, with places of bodies instead of numbers."""
    most = max((*places, 0)) + 1
    place_of = np.full(most + 1, -1)  # the last is that of bodies that are not the scene's
    place_of[list(places)] = list(places.values())
    met = contacts.met
    named = [array.copy() for array in (contacts.owners, met.pairs, met.ranked, met.links)]
    for array in named:
        array[..., 0] = place_of[np.minimum(array[..., 0], most)]
    owners, pairs, ranked, links = named
    order = pairs, met.states, ranked, np.array(met.checked), links, met.nodes[met.leaves, :6]
    names: tuple[str, ...] = (*_CONTACTS, *_PAIRS)
    return dict(zip(names, (owners, contacts.counts, contacts.points, *order), strict=True))


def _contacts_in(
    arrays: dict[str, np.ndarray], bodies: list[int], counts_of_links: np.ndarray
) -> KeptPoints | None:
    """Return the points in a file; None where it has none, or such as saveBullet does not write.

    Args:
        arrays: of the file.
        bodies: numbers of the World's bodies by their places.
        counts_of_links: (n,) how many links each has.
    """
    owners, counts, points = (arrays.get(name) for name in _CONTACTS)
    if owners is None or counts is None or points is None:
        return None
    shapes = (owners.shape, counts.shape, points.shape)
    types = (owners.dtype, counts.dtype, points.dtype)
    if (
        counts.ndim != 1
        or shapes != ((len(counts), 2, 3), (len(counts),), (len(counts), 4, 17))
        or types
        != (
            np.dtype(np.int64),
            np.dtype(np.int32),
            np.dtype(np.float64),
        )
    ):
        return None
    met = _pairs_in(arrays, bodies, counts_of_links)
    if met is None:
        return None
    sensible = _are_named(owners, bodies).all(axis=1) & (counts >= 0) & (counts <= 4)
    sensible &= np.isfinite(points).all(axis=(1, 2))
    return KeptPoints(_numbered(owners[sensible], bodies), counts[sensible], points[sensible], met)


def _pairs_in(
    arrays: dict[str, np.ndarray], bodies: list[int], counts_of_links: np.ndarray
) -> MetPairs | None:
    """Return the order of pairs in a file; None where it has none, or one that saveBullet does not write."""
    if not all(name in arrays for name in _PAIRS):
        return None
    found = [arrays[name] for name in _PAIRS]
    pairs, states, ranked, checked, links, boxes = found
    wanted = (
        ((states.size, 2, 2), np.int64),
        ((states.size,), np.int32),
        ((len(ranked) if ranked.ndim else 0, 2, 3), np.int64),
        ((), np.int64),
        ((len(boxes) if boxes.ndim else 0, 2), np.int64),
        ((len(boxes) if boxes.ndim else 0, 6), np.float64),
    )
    if any(a.shape != shape or a.dtype != dtype for a, (shape, dtype) in zip(found, wanted, strict=True)):
        return None
    if not np.isfinite(boxes).all() or len(np.unique(links, axis=0)) < len(links):
        return None
    kept = [_are_named(pairs, bodies).all(axis=1), _are_named(ranked, bodies).all(axis=1)]
    known = _are_named(links, bodies)
    known[known] = (links[known, 1] >= 0) & (links[known, 1] < counts_of_links[links[known, 0]])
    leaves, nodes, ties, tree = tree_of_boxes(boxes[known])
    return MetPairs(
        pairs=_numbered(pairs[kept[0]], bodies),
        states=np.where(states[kept[0]] == HIDDEN, HIDDEN, -1).astype(np.int32),
        ranked=_numbered(ranked[kept[1]], bodies),
        ends=np.arange(np.count_nonzero(kept[1]), dtype=np.int32),
        checked=int(checked),
        links=_numbered(links[known], bodies),
        leaves=leaves,
        nodes=nodes,
        ties=ties,
        tree=tree,
    )


def _are_named(owners: np.ndarray, bodies: list[int]) -> np.ndarray:
    """Return which of (..., k) body, link and more are of one of the bodies."""
    return (owners[..., 0] >= 0) & (owners[..., 0] < len(bodies))


def _numbered(owners: np.ndarray, bodies: list[int]) -> np.ndarray:
    """Return (..., k) body, link and more with the numbers of the World's bodies for places."""
    owners = owners.copy()
    owners[..., 0] = np.array(bodies, dtype=np.int64)[owners[..., 0]]
    return owners


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

    name, script = text(worldFileName), world_script(client).encode()
    try:
        client.output_files.write(name, script)
    except OSError as problem:
        raise failure("saveWorld command execution failed.", str(problem)) from None


@command()
def loadBullet(client: Client, bulletFileName: str) -> tuple[int, ...]:
    """Raise an error: Bullet's binary files contain its internal structures and cannot be read.

    Raises:
        error: always.
    """
    path = find_file(client.search.folder, text(bulletFileName), client.mounts)
    remedy = (
        not_found_remedy(client.search.folder, bulletFileName)
        if path is None
        else "load bodies from their own files; restoreState(fileName=...) reads what saveBullet wrote"
    )
    raise failure("Couldn't load .bullet file.", remedy)
