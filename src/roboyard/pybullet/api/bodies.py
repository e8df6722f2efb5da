"""Bodies: list, names, base pose and velocity, removal."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from struct import Struct
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.pybullet.bullet_rules.single_precision import matrix_signed
from roboyard.pybullet.face.arguments import quaternion, vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import error, failure
from roboyard.pybullet.fast.fast_commands import is_machine_code, replace_bases
from roboyard.pybullet.state.bodies.body_records import RIGID_BODY
from roboyard.pybullet.state.frames import cross, inertial_pose, link_pose, rotated

if TYPE_CHECKING:
    from roboyard.description.model import Pose
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Vector = Sequence[float]
_PACK_POSE, _PACK_SPEED = Struct("7d").pack_into, Struct("6d").pack_into
Triple = tuple[float, ...]


@command()
def getNumBodies(client: Client) -> int:
    """Return the number of bodies."""
    return len(client.scene.bodies)


@command()
def getBodyUniqueId(client: Client, serialIndex: int) -> int:
    """Return the id of the i-th body, or -1 beyond the last."""
    order = client.scene.order
    return order[serialIndex] if 0 <= whole(serialIndex) < len(order) else -1


@command()
def getBodyInfo(client: Client, bodyUniqueId: int) -> tuple[bytes, bytes]:
    """Return the names of the base link and of the body; b"" and the link for useMaximalCoordinates.

    Raises:
        error: the body does not exist.
    """
    record = client.scene.bodies.get(whole(bodyUniqueId))
    if record is None:
        raise client.scene.unknown_body(bodyUniqueId, "Couldn't get body info")
    base = record.model.links[0].name.encode()
    return (b"", base) if record.kind == RIGID_BODY else (base, record.name.encode())


@command()
def syncBodyInfo(client: Client) -> None:
    """Do nothing: a client in this process always has current data."""


@command()
def removeBody(client: Client, bodyUniqueId: int) -> None:
    """Remove a body with its constraints and user data; an unknown id is ignored."""
    number = whole(bodyUniqueId)
    client.scene.remove(number)
    client.user_data.remove_bodies([number])


@command()
def resetSimulation(client: Client, flags: int = 0) -> None:
    """Remove everything and set gravity to 0; the time step and the search path stay unchanged."""
    whole(flags)
    client.reset()


# --------------------------------------------------------------------------------------------------- base


@command()
def getBasePositionAndOrientation(client: Client, bodyUniqueId: int) -> tuple[Triple, Triple]:
    """Return the position (m) and quaternion (x, y, z, w) of the base's inertial frame in the world.

    Raises:
        error: the body does not exist.
    """
    scene = client.scene
    record = scene.bodies.get(bodyUniqueId)
    if record is None or record.revision != scene.world.revision or scene.world.is_stale:
        if scene.world.is_stale:
            scene.compile_for_poses()
        if record is not None and record.soft is None and (placed := record.body.placed) is not None:
            position, orientation = placed
            return _as_reported(position.tolist(), orientation.tolist(), record.base_frame)
        record = scene.ready(bodyUniqueId, "GetBasePositionAndOrientation failed.")
    if record.base_is_plain and record.free is not None:
        x, y, z, qw, qx, qy, qz = record.free.tolist()
        return (x, y, z), (qx, qy, qz, qw) if qw > 0.5 else matrix_signed(qx, qy, qz, qw)
    return base_inertial_pose(record)


def base_inertial_pose(record: BodyRecord) -> tuple[Triple, Triple]:
    """Return the pose of the base's inertial frame; cached for fixed bases."""
    if record.fixed_poses is not None:
        return record.fixed_poses[0]
    if record.free is not None:
        x, y, z, w, i, j, k = record.free.tolist()
        return _as_reported((x, y, z), (i, j, k, w), record.base_frame)
    if record.soft is not None:
        position, orientation = record.soft.pose
        return tuple(position.tolist()), tuple(orientation.tolist())
    position, orientation = record.base_pose()
    at = _as_reported(position, orientation, record.base_frame)
    record.fixed_poses = at, (position, orientation)
    return at


def _as_reported(position: Any, orientation: Any, frame: Pose) -> tuple[Triple, Triple]:
    """Return the pose of an inertial frame from that of its link frame, with Bullet's sign."""
    place, turn = inertial_pose(position, orientation, frame)
    return place, matrix_signed(*turn)


@command()
def resetBasePositionAndOrientation(
    client: Client, bodyUniqueId: int, posObj: Vector, ornObj: Vector
) -> None:
    """Set the pose of the base's inertial frame and zero the base velocity; joints keep their positions.

    An unknown body is ignored.

    Raises:
        error: posObj does not have 3 numbers, ornObj not 4, or ornObj is zero.
    """
    p = vector3(posObj, "position needs a 3 coordinates [x,y,z].")
    q = quaternion(ornObj, "orientation needs a 4 coordinates, quaternion [x,y,z,w].")
    scene = client.scene
    record = scene.bodies.get(whole(bodyUniqueId))
    if record is None:
        return
    if scene.new_bodies:
        scene.note_boxes(record.number)
    is_prepared = is_machine_code("resetBasePositionAndOrientation")
    if record.placed is not None and record.placed == (p, q) and record.body.is_fixed:
        scene.mark_placed(record)
        if is_prepared:
            _prepare(scene, record)
        return
    x, y, z, w = q
    length = sqrt(x * x + y * y + z * z + w * w)
    if length == 0.0:
        raise failure(
            "orientation needs a 4 coordinates, quaternion [x,y,z,w].",
            f"the quaternion {tuple(ornObj)} has length 0; give a unit quaternion",
        )
    if length != 1.0:
        q = (x / length, y / length, z / length, w / length)
    if record.soft is not None:
        record.soft.set_pose(p, q)
        scene.frames_are_old = True
        return
    wanted = p, q
    if record.placed == wanted and record.body.is_fixed:
        scene.mark_placed(record)
        return
    if not record.base_is_plain:
        p, q = link_pose(p, q, record.base_frame)
    world = scene.world
    if world.is_stale:
        scene.compile_for_poses()
    if record.revision != world.revision and not world.is_stale:
        scene.ready(record.number, "")
    free = record.free
    x, y, z = p
    total = x + y + z + length
    speed = record.free_velocity
    if (
        free is None
        or speed is None
        or world.is_stale
        or record.revision != world.revision
        or total - total != 0.0
    ):
        record.body.set_pose(p, q)
        record.placed = wanted
        if is_prepared and speed is None:
            _prepare(scene, record)
        if speed is not None and record.revision != world.revision:
            speed[:] = 0.0  # of a new body alone
    else:
        i, j, k, w = q
        positions, speeds = record.words
        _PACK_POSE(positions, record.base_bytes, x, y, z, w, i, j, k)
        _PACK_SPEED(speeds, record.base_speed_bytes, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        world.mark_moved()
        if is_prepared:
            _prepare(scene, record)
    record.fixed_poses = None
    scene.mark_placed(record)


@command()
def getBaseVelocity(client: Client, bodyUniqueId: int) -> tuple[Triple, Triple]:
    """Return the velocity of the base's centre of mass (m/s) and its angular velocity (rad/s), world frame.

    Raises:
        error: the body does not exist.
    """
    scene = client.scene
    record = scene.bodies.get(bodyUniqueId)
    if record is None or record.revision != scene.world.revision or scene.world.is_stale:
        record = scene.readable(bodyUniqueId, "getBaseVelocity failed.")
    if record.soft is not None:
        mean = np.average(record.soft.velocities, axis=0, weights=record.soft.free_masses)
        return tuple(mean.tolist()), (0.0, 0.0, 0.0)
    if is_machine_code("getBaseVelocity"):
        read = scene.world.prepared.get("velocities", {})
        if record.number in read:  # to prepare what is read once between edits would take longer
            _prepare(scene, record)
        read[record.number] = None
    if record.free_velocity is None:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    linear, angular = _center_velocity(record)
    return linear, angular


@command()
def resetBaseVelocity(
    client: Client,
    objectUniqueId: int,
    linearVelocity: Vector | None = None,
    angularVelocity: Vector | None = None,
) -> None:
    """Set the velocity of the base's centre of mass (m/s) and its angular velocity (rad/s), world frame.

    A fixed base then moves with this velocity, which nothing changes, and takes along what is on it. A list
    of another length than 3 counts as three zeros. An unknown body is ignored.

    Raises:
        error: neither velocity is given.
    """
    if linearVelocity is None and angularVelocity is None:
        raise failure("expected at least linearVelocity and/or angularVelocity.", "both are None")
    linear, angular = _three(linearVelocity), _three(angularVelocity)
    scene = client.scene
    record = scene.bodies.get(whole(objectUniqueId))
    if record is None:
        return
    if scene.new_bodies:
        scene.note_boxes(record.number)
    if record.revision != scene.world.revision or scene.world.is_stale:
        record = scene.readable(objectUniqueId, "error in resetJointState.")
    if record.soft is not None and linear is not None:
        record.soft.velocities = np.broadcast_to(linear, (len(record.soft.masses), 3))
        scene.frames_are_old = True
    if record.free_velocity is None:
        if record.kind == RIGID_BODY or record.soft is not None or record.shapes.has_plane:
            return
        if not any(linear or ()) and not any(angular or ()):
            scene.mark_placed(record)
            return
        scene.carry_base(record)
        record = scene.ready(objectUniqueId, "error in resetJointState.")
    if linear is None or angular is None:
        old_linear, old_angular = _center_velocity(record)
        linear = old_linear if linear is None else linear
        angular = old_angular if angular is None else angular
    total = sum(linear) + sum(angular)
    if total - total != 0.0:  # inf and nan alike
        raise RoboyardError(f"body {record.name!r}: a velocity must be finite, got {linear} and {angular}")
    if total == 0.0 and not any(linear) and not any(angular):
        if is_machine_code("resetBaseVelocity"):
            _prepare(scene, record)
        _PACK_SPEED(record.words[1], record.base_speed_bytes, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        scene.world.mark_moved()
        scene.mark_placed(record)
        return
    if is_machine_code("resetBaseVelocity"):
        _prepare(scene, record)
    x, y, z, w = _orientation(record)
    if not record.base_is_plain:
        lever = cross(angular, rotated((x, y, z, w), record.base_frame.position))
        linear = tuple(v - c for v, c in zip(linear, lever, strict=True))
    turned = rotated((-x, -y, -z, w), angular)
    _PACK_SPEED(record.words[1], record.base_speed_bytes, *linear, *turned)
    scene.world.mark_moved()
    scene.mark_placed(record)


def _prepare(scene: PhysicsScene, record: BodyRecord) -> None:
    """Let machine code put and move a base."""
    world, body = scene.world, record.body
    known = world.prepared.get("bases")
    if (
        known is None
        or record.number in known
        or record.soft is not None
        or world.is_stale
        or record.revision != world.revision
    ):
        return
    if record.free is not None and record.free_velocity is not None:
        kept = np.zeros(7)
        arrays = record.free[:3], record.free[3:], kept[:3], kept[3:], record.free_velocity
    elif body.is_fixed and not body.built.is_ground and not world.is_sleeping:
        element, model, row = body.built.links[0].element, world.live_model, body.mujoco_ids[0]
        arrays = model.body_pos[row], model.body_quat[row], element.pos, element.quat, np.zeros(0)
    else:
        return
    frame = record.base_frame
    numbers = np.array([*frame.position, *frame.quaternion], dtype=float)
    known[record.number] = scene, world, record, *arrays, numbers, scene.step_count, record.shown


def _orientation(record: BodyRecord) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of a floating base's link frame."""
    assert record.free is not None
    w, x, y, z = record.free[3:].tolist()
    return x, y, z, w


def _center_velocity(record: BodyRecord) -> tuple[Triple, Triple]:
    """Return the velocity of a floating base's centre of mass (m/s) and its angular velocity (rad/s)."""
    assert record.free_velocity is not None
    vx, vy, vz, wx, wy, wz = record.free_velocity.tolist()
    turn = _orientation(record)
    angular = rotated(turn, (wx, wy, wz))
    if record.base_is_plain:
        return (vx, vy, vz), angular
    x, y, z = cross(angular, rotated(turn, record.base_frame.position))
    return (vx + x, vy + y, vz + z), angular


def _three(velocity: Vector | None) -> Triple | None:
    """Return three numbers; zeros for a list of another length, None for None."""
    if velocity is None:
        return None
    try:
        return vector3(velocity, "")
    except error:
        return 0.0, 0.0, 0.0


START.later(replace_bases, "resetBasePositionAndOrientation", "resetBaseVelocity", "getBaseVelocity")
