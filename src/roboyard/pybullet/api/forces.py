"""External forces and torques for one step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import Vector3, vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.frames import cross, inertial_pose, rotated

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
    world, row = scene.world, record.rows[link + 1]
    frame = record.links[link + 1].frame
    if link < 0 and record.free is not None:
        x, y, z, w, i, j, k = record.free.tolist()
        origin, turn = (x, y, z), (i, j, k, w)
    else:
        data = world.kinematics()
        origin, (w, i, j, k) = data.xpos[row].tolist(), data.xquat[row].tolist()
        turn = (i, j, k, w)
    centre, turn = inertial_pose(origin, turn, frame)
    if flags == c.LINK_FRAME:
        force, torque = rotated(turn, force), rotated(turn, torque)
        lever = None if point is None else rotated(turn, point)
    else:
        lever = None if point is None else tuple(p - q for p, q in zip(point, centre, strict=True))
    if lever is not None:
        x, y, z = cross(lever, force)
        torque = (torque[0] + x, torque[1] + y, torque[2] + z)
    world.wrenches.push(row, (*force, *torque))
