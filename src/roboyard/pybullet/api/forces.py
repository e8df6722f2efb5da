"""External forces and torques for one step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import Vector3, vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.frames import cross, inertial_pose, rotated

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Vector = Sequence[float]
_PLAIN = (tuple, list)
_BASE = -1


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
    is_plain = type(forceObj) in _PLAIN and type(posObj) in _PLAIN
    is_local = flags is c.LINK_FRAME and linkIndex is _BASE
    if is_local and is_plain and _push_base(client.scene, objectUniqueId, forceObj, posObj, None):
        return
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
    is_local = flags is c.LINK_FRAME and linkIndex is _BASE and type(torqueObj) in _PLAIN
    if is_local and _push_base(client.scene, objectUniqueId, None, None, torqueObj):
        return
    torque = vector3(torqueObj, "torque needs a 3 coordinates [x,y,z].")
    _push(client, objectUniqueId, linkIndex, (0.0, 0.0, 0.0), torque, None, flags)


def _push_base(scene: PhysicsScene, body: int, force: Any, point: Any, torque: Any) -> bool:
    """Push a free base in its own frame, if that is where its centre of mass is; return whether it did.

    Rotors and thrusters do so in every step. Unusual or wrong arguments are left to `_push`.

    Args:
        scene: the client's bodies.
        body: a body's id.
        force: three numbers (N), with `point`; None with a torque.
        point: where the force acts (m).
        torque: three numbers (N m); None with a force.
    """
    world, record = scene.world, scene.bodies.get(body)
    if type(body) is not int or record is None or record.free is None or not record.base_is_plain:
        return False
    if world.is_stale or record.revision != world.revision:
        return False
    try:
        if torque is None:
            fx, fy, fz = force
            px, py, pz = point
            total = fx + fy + fz
            tx = ty = tz = 0.0
            if not px == py == pz == 0.0:
                tx, ty, tz = py * fz - pz * fy, pz * fx - px * fz, px * fy - py * fx
                total += tx + ty + tz
        else:
            fx = fy = fz = 0.0
            tx, ty, tz = torque
            total = tx + ty + tz
        if type(total) is int:  # such as [1, 0, 0]
            fx, fy, fz, tx, ty, tz = float(fx), float(fy), float(fz), float(tx), float(ty), float(tz)
            total = float(total)
    except (TypeError, ValueError, OverflowError):
        return False
    if type(total) is not float or total - total != 0.0:
        return False
    _, _, _, w, x, y, z = record.free.tolist()
    add, start = world.wrenches.add_numbers, 6 * record.rows[0]
    if not fx == fy == 0.0:
        d, e, f = 2.0 * (y * fz - z * fy), 2.0 * (z * fx - x * fz), 2.0 * (x * fy - y * fx)
        add(start, fx + w * d + y * f - z * e, fy + w * e + z * d - x * f, fz + w * f + x * e - y * d)
    elif fz:  # thrust along the body's z axis
        d = fz + fz
        add(start, d * (x * z + w * y), d * (y * z - w * x), fz - d * (x * x + y * y))
    if not tx == ty == 0.0:
        d, e, f = 2.0 * (y * tz - z * ty), 2.0 * (z * tx - x * tz), 2.0 * (x * ty - y * tx)
        x, y, z = tx + w * d + y * f - z * e, ty + w * e + z * d - x * f, tz + w * f + x * e - y * d
        add(start + 3, x, y, z)
    elif tz:
        d = tz + tz
        add(start + 3, d * (x * z + w * y), d * (y * z - w * x), tz - d * (x * x + y * y))
    return True


def _push(
    client: Client, body: int, link: int, force: Vector3, torque: Vector3, point: Vector3 | None, flags: int
) -> None:
    """Push a link; its axes and point are those that getLinkState shows, a step old after a step.

    Args:
        client: the client.
        body: a body's id.
        link: -1 for the base.
        force: force (N).
        torque: torque (N m).
        point: where the force acts (m); None for the centre of mass.
        flags: WORLD_FRAME or LINK_FRAME, for all three.
    """
    if whole(flags) not in (c.WORLD_FRAME, c.LINK_FRAME):
        raise failure("flag has to be either WORLD_FRAME or LINK_FRAME", f"got flags={flags}")
    scene, offset = client.scene, (0.0, 0.0, 0.0)
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
        data = scene.frames(fresh=True) if scene.frames_are_old else world.kinematics()
        origin, (w, i, j, k) = data.xpos[row].tolist(), data.xquat[row].tolist()
        now, _ = inertial_pose(origin, (i, j, k, w), frame)
        offset = tuple(p - q for p, q in zip(now, data.xipos[row].tolist(), strict=True))
        positions, turns = world.kept_frames or (data.xpos, data.xquat)
        origin, (w, i, j, k) = positions[row].tolist(), turns[row].tolist()
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
    if any(offset):  # MuJoCo has the centre of mass of a massless link in the origin of its frame
        x, y, z = cross(offset, force)
        torque = (torque[0] + x, torque[1] + y, torque[2] + z)
    world.wrenches.push(row, *force, *torque)
