"""Link frames and velocities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.arguments import indices, whole
from roboyard.pybullet.commands import command
from roboyard.pybullet.errors import failure
from roboyard.pybullet.frames import inertial_pose
from roboyard.pybullet.transforms import rounded

if TYPE_CHECKING:
    from roboyard.pybullet.clients import Client
    from roboyard.pybullet.records import BodyRecord
    from roboyard.pybullet.scene import Scene

State = tuple[Any, ...]


@command()
def getLinkState(
    client: Client,
    bodyUniqueId: int,
    linkIndex: int,
    computeLinkVelocity: int = 0,
    computeForwardKinematics: int = 0,
) -> State | None:
    """Where a link is.

    After a step, frames are those of before its position update unless computeForwardKinematics is set.

    Returns:
        world position and quaternion of the inertial frame, position and quaternion of the inertial frame in
        the link frame, world position and quaternion of the link frame, and with computeLinkVelocity the
        velocity of the centre of mass and the angular velocity in world axes. None for a link beyond the
        last.
    """
    if linkIndex < 0:
        raise failure(
            "getLinkState failed; invalid linkIndex", "the base is no link: use getBasePositionAndOrientation"
        )
    scene = client.scene
    record = scene.ready(bodyUniqueId, "getLinkState failed.")
    if whole(linkIndex) >= record.joint_count:
        return None
    data = scene.frames(fresh=bool(computeForwardKinematics))
    return _state(scene, record, data, linkIndex, bool(computeLinkVelocity))


@command()
def getLinkStates(
    client: Client,
    bodyUniqueId: int,
    linkIndices: Sequence[int],
    computeLinkVelocity: int = 0,
    computeForwardKinematics: int = 0,
) -> tuple[State | None, ...]:
    """`getLinkState` of several links."""
    scene = client.scene
    record = scene.ready(bodyUniqueId, "getLinkState failed.")
    data = scene.frames(fresh=bool(whole(computeForwardKinematics)))
    with_velocity = bool(whole(computeLinkVelocity))
    return tuple(
        _state(scene, record, data, link, with_velocity) if 0 <= link < record.joint_count else None
        for link in indices(linkIndices)
    )


def _state(scene: Scene, record: BodyRecord, data: Any, link: int, with_velocity: bool) -> State:
    row = record.rows[link + 1]
    x, y, z = data.xpos[row].tolist()
    w, i, j, k = data.xquat[row].tolist()
    frame = record.links[link + 1].frame
    position, orientation = inertial_pose((x, y, z), (i, j, k, w), frame)
    rounded_frame = rounded(x, y, z, i, j, k, w)
    state = (position, orientation, frame.position, frame.quaternion, rounded_frame[:3], rounded_frame[3:])
    if not with_velocity:
        return state
    linear, angular = scene.world.object_velocity(row, at_inertial=True)
    return (*state, tuple(linear.tolist()), tuple(angular.tolist()))
