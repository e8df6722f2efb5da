"""Link frames and velocities: getLinkState and getLinkStates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face.arguments import indices, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import is_machine_code, replace_links
from roboyard.pybullet.state.frames import SINGLE_READS

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord, LinkReader, MovedLinkReader
    from roboyard.pybullet.state.physics_scene import PhysicsScene
    from roboyard.sim.pool.lone_bodies import LoneBody
    from roboyard.sim.world import World

State = tuple[Any, ...]


@command()
def getLinkState(
    client: Client,
    bodyUniqueId: int,
    linkIndex: int,
    computeLinkVelocity: int = 0,
    computeForwardKinematics: int = 0,
) -> State | None:
    """Return the pose and velocity of a link.

    After a step, frames are those before its position update unless computeForwardKinematics is set.

    Returns:
        World position (m) and quaternion of the inertial frame, position and quaternion of the inertial frame
        in the link frame, world position and quaternion of the link frame, and with computeLinkVelocity the
        velocity of the centre of mass (m/s) and the angular velocity (rad/s) in world axes. None for a link
        beyond the last.

    Raises:
        error: the body does not exist, or the link is -1.
    """
    if linkIndex < 0:
        raise failure(
            "getLinkState failed; invalid linkIndex",
            f"links start at 0, got {linkIndex}; use getBasePositionAndOrientation for the base",
        )
    scene = client.scene
    record, world = scene.bodies.get(bodyUniqueId), scene.world
    if record is None or record.revision != world.revision or world.is_stale:
        lone = None if record is None else scene.alone(record)
        if record is not None and lone is not None:
            lone.kinematics()
            is_there = linkIndex < record.joint_count
            return _reader(lone, record)(linkIndex, computeLinkVelocity, True) if is_there else None
        if record is not None and linkIndex < record.joint_count and not computeLinkVelocity:
            read = record.link_reader
            if read is not None and scene.has_awaited_frames(record):
                return read(linkIndex, 0, True)
        record = _existing(scene, bodyUniqueId)
    if linkIndex >= record.joint_count:
        return None
    if is_machine_code("getLinkState"):
        _prepare(scene, record)
    if computeForwardKinematics:
        record.shown[0] = scene.step_count[0]
    is_fresh = scene.is_shown(record)
    if scene.frames_revision != world.revision and not is_fresh:
        scene.frames(fresh=True)
    elif (
        (is_fresh or computeLinkVelocity)
        and world.is_moved
        and scene.single_reads < SINGLE_READS
        and not (computeLinkVelocity and world.long_axes)
    ):
        scene.single_reads += 1
        reader = record.moved_link_reader or _moved_reader(scene, record)
        return reader(linkIndex, computeLinkVelocity, is_fresh)
    elif is_fresh:
        scene.frames(fresh=True)
    return (record.link_reader or _reader(world, record))(linkIndex, computeLinkVelocity, is_fresh)


@command()
def getLinkStates(
    client: Client,
    bodyUniqueId: int,
    linkIndices: Sequence[int],
    computeLinkVelocity: int = 0,
    computeForwardKinematics: int = 0,
) -> tuple[State | None, ...]:
    """Return the getLinkState of several links; None for a link that does not exist.

    Raises:
        error: the body does not exist.
    """
    scene = client.scene
    found = scene.bodies.get(bodyUniqueId)
    lone = None if found is None else scene.alone(found)
    if found is not None and lone is not None:
        record, world = found, lone
        whole(computeForwardKinematics)
        lone.kinematics()
        is_fresh = True
    else:
        record, world = _existing(scene, bodyUniqueId), scene.world
        if whole(computeForwardKinematics):
            record.shown[0] = scene.step_count[0]
        is_fresh = scene.is_shown(record)
        scene.frames(fresh=is_fresh)
        if is_machine_code("getLinkStates"):
            _prepare(scene, record)
    whole(computeLinkVelocity)
    try:
        group = record.link_groups.get(tuple(linkIndices))
    except TypeError:
        group = None  # raised below, with PyBullet's text
    if group is not None:
        return group.read(computeLinkVelocity, is_fresh)
    links, count = indices(linkIndices), record.joint_count
    if not all(0 <= link < count for link in links):
        read = _reader(world, record)
        return tuple(
            read(link, computeLinkVelocity, is_fresh) if 0 <= link < count else None for link in links
        )
    from roboyard.pybullet.state.bodies.link_groups import link_group

    return link_group(world, record, links).read(computeLinkVelocity, is_fresh)


def _prepare(scene: PhysicsScene, record: BodyRecord) -> None:
    from roboyard.pybullet.fast.link_entries import prepare

    prepare(scene, record)


def _existing(scene: PhysicsScene, body: int) -> BodyRecord:
    """Return the record of a body whose links are read."""
    if body not in scene.bodies and whole(body) < 0:
        raise failure("getLinkState failed; invalid bodyUniqueId", f"body ids start at 0, got {body}")
    return scene.ready(body, "getLinkState failed.")


def _moved_reader(scene: PhysicsScene, record: BodyRecord) -> MovedLinkReader:
    from roboyard.pybullet.state.bodies.link_groups import moved_link_reader

    return moved_link_reader(scene.world, record)


def _reader(world: World | LoneBody, record: BodyRecord) -> LinkReader:
    if record.link_reader is not None:
        return record.link_reader
    from roboyard.pybullet.state.bodies.link_groups import link_reader

    return link_reader(world, record)


START.later(replace_links, "getLinkState", "getLinkStates")
