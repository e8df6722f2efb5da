"""External forces and torques for one step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import Vector3, vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.transforms import rotate

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

Vector = Sequence[float]


@command()
def applyExternalForce(
    client: Client, objectUniqueId: int, linkIndex: int, forceObj: Vector, posObj: Vector, flags: int
) -> None:
    """Apply a force to a point of a link (-1: the base) during the next step.

    With WORLD_FRAME, force (N) and point (m) are in the world frame; with LINK_FRAME, they are in the link's
    inertial frame. An unknown body or link is ignored.

    Raises:
        error: a vector does not have three numbers, or the flag is unknown.
    """
    force = vector3(forceObj, "force needs a 3 coordinates [x,y,z].")
    point = vector3(posObj, "position needs a 3 coordinates [x,y,z].")
    _push(client, objectUniqueId, linkIndex, force, (0.0, 0.0, 0.0), point, flags)


@command()
def applyExternalTorque(
    client: Client, objectUniqueId: int, linkIndex: int, torqueObj: Vector, flags: int
) -> None:
    """Apply a torque (N m) to a link (-1: the base) during the next step; flags as in applyExternalForce.

    Raises:
        error: the torque does not have three numbers, or the flag is unknown.
    """
    torque = vector3(torqueObj, "torque needs a 3 coordinates [x,y,z].")
    _push(client, objectUniqueId, linkIndex, (0.0, 0.0, 0.0), torque, None, flags)


def _push(
    client: Client, body: int, link: int, force: Vector3, torque: Vector3, point: Vector3 | None, flags: int
) -> None:
    if whole(flags) not in (c.WORLD_FRAME, c.LINK_FRAME):
        raise failure("flag has to be either WORLD_FRAME or LINK_FRAME", f"got flags={flags}")
    scene = client.scene
    if whole(body) not in scene.bodies:
        return
    record = scene.ready(body, "")
    if not -1 <= whole(link) < record.joint_count:
        return
    handle = record.body.links[link + 1]
    f, t = np.array(force), np.array(torque)
    at = None if point is None else np.array(point)
    if flags == c.LINK_FRAME:
        position, quaternion = handle.pose
        position, quaternion = record.to_inertial(position, quaternion, link)
        f, t = rotate(quaternion, f), rotate(quaternion, t)
        at = None if at is None else position + rotate(quaternion, at)
    handle.apply_wrench(f, t, point=at)
