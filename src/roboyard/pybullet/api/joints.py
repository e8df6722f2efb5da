"""Joints: info, state, reset, and force-torque sensors."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.pybullet.face.arguments import are_finite, check_finite, indices, number, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import is_machine_code, replace_joint_reads, replace_joints
from roboyard.pybullet.state.bodies.joint_groups import NO_REACTION, joint_group
from roboyard.pybullet.state.bodies.joint_tables import POSITION_COUNT, VELOCITY_COUNT

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord, JointGroup

reactions = lazy_module("roboyard.pybullet.state.reactions.joint_reactions")

Vector = Sequence[float]
State = tuple[Any, ...]
_PLAIN = list, tuple
OUT_OF_RANGE = "Joint index out-of-range."


@command()
def getNumJoints(client: Client, bodyUniqueId: int) -> int:
    """Return the number of joints of a body, including fixed ones; 0 for an unknown body."""
    record = client.scene.bodies.get(whole(bodyUniqueId))
    return 0 if record is None else record.joint_count


@command()
def computeDofCount(client: Client, bodyUniqueId: int) -> int:
    """Return how many hinges and slides a body has; -1 or -2 if it has a spherical or planar joint first."""
    record = client.scene.bodies.get(whole(bodyUniqueId))
    return 0 if record is None else record.dof_count


@command()
def getJointInfo(client: Client, bodyUniqueId: int, jointIndex: int) -> tuple[Any, ...]:
    """Return the properties of a joint as the file gives them.

    Returns:
        Index, name, type, first index in q, first index in u, flags, damping, friction, lower and upper limit
        (rad or m), largest force (N m or N) and velocity, name of the child link, axis in its inertial frame,
        joint origin in the parent's inertial frame (m), rotation from there to the child's inertial frame,
        index of the parent link.

    Raises:
        error: the body or joint does not exist.
    """
    record = client.scene.bodies.get(bodyUniqueId)
    if record is not None and 0 <= whole(jointIndex) < record.joint_count:
        return record.infos[jointIndex]
    if record is None:
        raise client.scene.unknown_body(bodyUniqueId, "GetJointInfo failed.")
    raise _joint_error(record, jointIndex, "GetJointInfo failed.")


@command()
def getJointState(client: Client, bodyUniqueId: int, jointIndex: int) -> State:
    """Return position (rad or m), velocity, reaction force and torque (6), and motor torque or force.

    Raises:
        error: the body or joint does not exist.
    """
    scene = client.scene
    record = scene.bodies.get(bodyUniqueId)
    if record is None or record.revision != scene.world.revision or scene.world.is_stale:
        record = _existing(client, bodyUniqueId)
    if not 0 <= jointIndex < record.joint_count:
        raise _joint_state_error(record, jointIndex)
    place = record.position_addresses[jointIndex]
    if place < 0 or jointIndex in record.sensors or not record.is_scalar[jointIndex]:
        return _state(client, record, jointIndex)
    if is_machine_code("getJointState"):
        _prepare_reads(client, record)
    dof = record.velocity_addresses[jointIndex]
    if jointIndex in record.motors_off or scene.motor_revision != record.revision:
        applied = record.applied[jointIndex]
    else:
        applied = scene.motor_forces().item(dof)
    return record.qpos.item(place), record.qvel.item(dof), NO_REACTION, applied


@command()
def getJointStates(
    client: Client, bodyUniqueId: int, jointIndices: Sequence[int]
) -> tuple[State, ...] | None:
    """Return the getJointState of several joints; None for an empty list.

    Raises:
        error: the body or a joint does not exist.
    """
    scene = client.scene
    record = scene.bodies.get(bodyUniqueId)
    if record is None or record.revision != scene.world.revision or scene.world.is_stale:
        record = _existing(client, bodyUniqueId)
    if type(jointIndices) is np.ndarray:
        jointIndices = jointIndices.tolist()  # whose numbers are hashed much faster
    try:
        group = record.joint_groups.get(tuple(jointIndices))
    except TypeError:
        group = None  # raised below, with PyBullet's text
    if group is None:
        wanted = _checked_joints(record, jointIndices)
        if not wanted:
            return None
        group = joint_group(record, wanted)
    if is_machine_code("getJointStates"):
        _prepare_reads(client, record)
    if not group.is_scalar or scene.motor_revision != record.revision:
        return tuple(_state(client, record, joint) for joint in group.joints)
    return _with_reactions(client, record, group, group.read(record, scene.motor_forces()))


@command()
def getJointStateMultiDof(client: Client, bodyUniqueId: int, jointIndex: int) -> State:
    """Return the state of a joint with any number of degrees of freedom, as tuples.

    Position has 1 number (rad or m) or 4 (a quaternion), velocity 1 or 3, motor torque 1 or 3 (N m or N);
    those of a fixed joint are empty. The reaction has 6 numbers, as in getJointState.

    Raises:
        error: the body or joint does not exist.
    """
    record = _existing(client, bodyUniqueId)
    if not 0 <= whole(jointIndex) < record.joint_count:
        raise _joint_state_error(record, jointIndex)
    if is_machine_code("getJointStateMultiDof"):
        _prepare_reads(client, record)
    return _state_of_many(client, record, jointIndex)


@command()
def getJointStatesMultiDof(
    client: Client, bodyUniqueId: int, jointIndex: Sequence[int]
) -> tuple[State, ...] | None:
    """Return the getJointStateMultiDof of several joints; None for an empty list.

    Raises:
        error: the body or a joint does not exist.
    """
    scene = client.scene
    record = scene.bodies.get(bodyUniqueId)
    if record is None or record.revision != scene.world.revision or scene.world.is_stale:
        record = _existing(client, bodyUniqueId)
    try:
        group = record.joint_groups.get(tuple(jointIndex))
    except TypeError:
        group = None
    if group is not None and is_machine_code("getJointStatesMultiDof"):
        _prepare_reads(client, record)
    if group is not None and group.is_free and scene.motor_revision == record.revision:
        return _with_reactions(client, record, group, group.read_tuples(record, scene.motor_forces()))
    wanted = _checked_joints(record, jointIndex)
    if wanted and group is None:
        joint_group(record, wanted)
    return tuple(_state_of_many(client, record, joint) for joint in wanted) if wanted else None


@command()
def resetJointState(
    client: Client, bodyUniqueId: int, jointIndex: int, targetValue: float, targetVelocity: float = 0.0
) -> None:
    """Set the position (rad or m) and velocity of a joint of one degree of freedom.

    The motor keeps its target. Other joints are left unchanged.

    Raises:
        error: the body or joint does not exist.
    """
    record = _settable(client, bodyUniqueId, jointIndex)
    place = record.position_addresses[jointIndex]
    if POSITION_COUNT[record.joint_type(jointIndex)] == 1:
        position, velocity = number(targetValue), number(targetVelocity)
        total = position + velocity
        if total - total != 0.0:  # inf and nan alike
            check_finite("resetJointState failed.", targetValue=position, targetVelocity=velocity)
        record.qpos[place] = position
        record.qvel[record.velocity_addresses[jointIndex]] = velocity
        client.scene.world.mark_moved()
        client.scene.mark_placed(record)
        if is_machine_code("resetJointState"):
            _prepare(client, record)
    else:
        number(targetValue)
        number(targetVelocity)
        client.scene.mark_placed(record)


@command()
def resetJointStateMultiDof(
    client: Client,
    bodyUniqueId: int,
    jointIndex: int,
    targetValue: Vector,
    targetVelocity: Vector | None = None,
) -> None:
    """Set the position and velocity of a joint with any number of degrees of freedom.

    Spherical joints take x, y, z, w and 3 velocities (rad/s). A list of another length is ignored.

    Raises:
        error: the body or joint does not exist, or both lists are empty.
    """
    record = _settable(client, bodyUniqueId, jointIndex)
    _reset_many(record, jointIndex, targetValue, targetVelocity)
    client.scene.world.mark_moved()
    client.scene.mark_placed(record)
    if is_machine_code("resetJointStateMultiDof"):
        _prepare(client, record)


@command()
def resetJointStatesMultiDof(
    client: Client,
    bodyUniqueId: int,
    jointIndices: Sequence[int],
    targetValues: Sequence[Vector],
    targetVelocities: Sequence[Vector] | None = None,
) -> None:
    """Set the positions and velocities of several joints; see resetJointStateMultiDof.

    Raises:
        error: the body or a joint does not exist, or the lists have different lengths.
    """
    joints = indices(jointIndices)
    values = list(targetValues)
    velocities = [] if targetVelocities is None else list(targetVelocities)
    for given in (values, velocities):
        if given and len(given) != len(joints) and joints:
            raise failure(
                "Number of targetValues and targetVelocities needs to match number of indices.",
                f"expected {len(joints)}, got {len(given)}",
            )
    nothing = [()] * len(joints)
    record = None
    if joints and values and _reset_all(client, bodyUniqueId, joints, values, velocities):
        return
    for joint, value, velocity in zip(joints, values or nothing, velocities or nothing, strict=False):
        if record is None or not 0 <= joint < record.joint_count:
            record = _settable(client, bodyUniqueId, joint)
        _reset_many(record, joint, value, velocity)
    if record is not None:
        client.scene.world.mark_moved()
        client.scene.mark_placed(record)
        if is_machine_code("resetJointStatesMultiDof"):
            _prepare(client, record)


@command()
def enableJointForceTorqueSensor(
    client: Client, bodyUniqueId: int, jointIndex: int, enableSensor: int = 1
) -> None:
    """Start (1) or stop (0) measuring the reaction force and torque in a joint.

    Raises:
        error: the body or joint does not exist.
    """
    record = client.scene.bodies.get(whole(bodyUniqueId))
    joint = whole(jointIndex)
    if bodyUniqueId < 0:
        raise failure("Error: invalid bodyUniqueId", f"body ids start at 0, got {bodyUniqueId}")
    if record is None or not 0 <= joint < record.joint_count:
        raise failure("Error: invalid jointIndex.", f"body {bodyUniqueId} has no joint {jointIndex}")
    (record.sensors.add if whole(enableSensor) else record.sensors.discard)(joint)
    (client.scene.with_sensors.add if record.sensors else client.scene.with_sensors.discard)(record.number)


# ------------------------------------------------------------------------------------------------- helpers


def joint_of(client: Client, body: int, joint: int) -> BodyRecord:
    """Return the record of a body that has this joint.

    Raises:
        error: the body or joint does not exist.
    """
    return _with_joint(client.scene.ready(body, OUT_OF_RANGE), joint)


def known_joint_of(client: Client, body: int, joint: int) -> BodyRecord:
    """Return the record of a body, as `joint_of`, without current indices while the World is not compiled."""
    record = client.scene.bodies.get(body)
    if record is None or not client.scene.world.is_stale:
        return joint_of(client, body, joint)
    return _with_joint(record, joint)


def _settable(client: Client, body: int, joint: int) -> BodyRecord:
    """Return the record of a body whose joint is set, as `joint_of`; a new one may be alone."""
    if client.scene.new_bodies:
        client.scene.note_boxes(body)
    return _with_joint(client.scene.readable(body, OUT_OF_RANGE), joint)


def _with_joint(record: BodyRecord, joint: int) -> BodyRecord:
    if not 0 <= whole(joint) < record.joint_count:
        raise _joint_error(record, joint, OUT_OF_RANGE)
    return record


def _state(client: Client, record: BodyRecord, joint: int) -> State:
    place = record.position_addresses[joint]
    if place < 0:
        return 0.0, 0.0, _reaction(client, record, joint), 0.0
    scene = client.scene
    if record.is_scalar[joint] and joint not in record.sensors:
        dof = record.velocity_addresses[joint]
        if joint in record.motors_off or scene.motor_revision != record.revision:
            applied = record.applied[joint]
        else:
            applied = scene.motor_forces().item(dof)
        return record.qpos.item(place), record.qvel.item(dof), NO_REACTION, applied
    applied = scene.applied(record, joint)
    return (
        record.qpos.item(place if POSITION_COUNT[record.joint_type(joint)] == 1 else place + 1),
        record.qvel.item(record.velocity_addresses[joint]),
        _reaction(client, record, joint),
        applied if type(applied) is float else 0.0,  # Bullet has those of spherical joints elsewhere
    )


def _state_of_many(client: Client, record: BodyRecord, joint: int) -> State:
    if record.is_scalar[joint]:
        q, v, reaction, motor = _state(client, record, joint)
        return (q,), (v,), reaction, (motor,)
    kind = record.joint_type(joint)
    if not POSITION_COUNT[kind]:
        return (), (), _reaction(client, record, joint), ()
    position = record.qpos[record.positions_of(joint)].tolist()
    if POSITION_COUNT[kind] == 4:
        position = [*position[1:], position[0]]
    velocity = record.qvel[record.velocities_of(joint)].tolist()
    applied = client.scene.applied(record, joint)
    motor = (applied,) if isinstance(applied, float) else tuple(applied)
    return tuple(position), tuple(velocity), _reaction(client, record, joint), motor


def _reaction(client: Client, record: BodyRecord, joint: int) -> tuple[float, ...]:
    """Return force (N) and torque (N m) in a joint, in the child's inertial frame; 0 without a sensor."""
    return reactions().reaction(client.scene, record, joint) if joint in record.sensors else NO_REACTION


def _with_reactions(
    client: Client, record: BodyRecord, group: JointGroup, states: tuple[State, ...]
) -> tuple[State, ...]:
    """Return the states of joints with the reactions of those that have a sensor."""
    sensors = record.sensors
    if not sensors or sensors.isdisjoint(group.joints):
        return states
    found, scene, reaction = list(states), client.scene, reactions().reaction
    for place, joint in enumerate(group.joints):
        if joint in sensors:
            q, v, _, motor = states[place]
            found[place] = q, v, reaction(scene, record, joint), motor
    return tuple(found)


def _reset_all(
    client: Client, body: int, joints: list[int], values: list[Any], velocities: list[Any]
) -> bool:
    """Set joints of one degree of freedom; return False, with no effect, for anything else.

    Args:
        client: the client.
        body: their body.
        joints: (n,) indices.
        values: (n,) lists of one position (rad or m).
        velocities: (n,) lists of one velocity (rad/s or m/s); none for joints at rest.
    """
    record = _settable(client, body, joints[0])
    try:
        numbers = tuple([position for (position,) in values])
        speeds = tuple([speed for (speed,) in velocities])
    except (TypeError, ValueError):
        return False
    if not are_finite(numbers) or (speeds and not are_finite(speeds)):
        return False
    group = record.joint_groups.get(tuple(joints))
    if group is None:
        if min(joints) < 0 or max(joints) >= record.joint_count:
            return False
        group = joint_group(record, joints)
    if not group.is_free:
        return False
    group.write(record, numbers, speeds or None)
    client.scene.world.mark_moved()
    client.scene.mark_placed(record)
    if is_machine_code("resetJointStatesMultiDof"):
        _prepare(client, record)
    return True


def _prepare_reads(client: Client, record: BodyRecord) -> None:
    from roboyard.pybullet.fast.joint_states import prepare

    prepare(client.scene, record)


def _prepare(client: Client, record: BodyRecord) -> None:
    """Let machine code set the joints of a body."""
    scene = client.scene
    known, count = scene.world.prepared.get("joints"), record.joint_count
    if (
        known is None
        or record.number in known
        or scene.world.is_stale
        or record.revision != scene.world.revision
    ):
        return
    places = [record.position_addresses[k] if record.is_scalar[k] else -1 for k in range(count)]
    known[record.number] = (
        *(scene, scene.world, record.qpos, record.qvel, np.array(places, dtype=np.int64)),
        *(np.array(record.velocity_addresses, dtype=np.int64), np.zeros((count, 3))),
        *(scene.step_count, record.shown),
    )


def _reset_many(record: BodyRecord, joint: int, value: Vector, velocity: Vector | None) -> None:
    is_plain = type(value) in _PLAIN and (velocity is None or type(velocity) in _PLAIN)
    if is_plain and record.is_scalar[joint] and len(value) == 1 and not velocity:
        (position,) = value
        if type(position) is float and position - position == 0.0:
            record.qpos[record.position_addresses[joint]] = position
            record.qvel[record.velocity_addresses[joint]] = 0.0
            return
    kind = record.joint_type(joint)
    count, speed = POSITION_COUNT[kind], VELOCITY_COUNT[kind]
    given, speeds = _numbers(value, 4), _numbers(velocity, 3)
    check_finite("resetJointStateMultiDof failed.", targetValue=given, targetVelocity=speeds)
    if not given and not speeds:
        raise failure(
            "Expected an position and/or velocity list.",
            f"joint {joint} needs {count} numbers, got {value!r}",
        )
    if len(given) == count:
        if count == 4:
            length = sqrt(sum(v * v for v in given)) or 1.0
            x, y, z, w = (v / length for v in given)
            given = [w, x, y, z]
        record.qpos[record.positions_of(joint)] = given
        record.qvel[record.velocities_of(joint)] = 0.0
    if len(speeds) == speed:
        record.qvel[record.velocities_of(joint)] = speeds


def _numbers(values: Vector | None, most: int) -> list[float]:
    """Return the first numbers of a sequence; none for anything else."""
    return (
        [number(v) for v in list(values)[:most]] if hasattr(values, "__iter__") and values is not None else []
    )


def _checked_joints(record: BodyRecord, wanted: Sequence[int]) -> list[int]:
    joints = indices(wanted)
    for joint in joints:
        if not 0 <= joint < record.joint_count:
            raise _joint_error(record, joint, OUT_OF_RANGE)
    return joints


def _existing(client: Client, body: int) -> BodyRecord:
    """Return the record of a body whose joints are read."""
    if body not in client.scene.bodies and whole(body) < 0:
        raise failure("getJointState failed; invalid bodyUniqueId", f"body ids start at 0, got {body}")
    return client.scene.readable(body, "getJointState failed.")


def _joint_state_error(record: BodyRecord, joint: int) -> Exception:
    is_negative = whole(joint) < 0
    return _joint_error(
        record,
        joint,
        "getJointState failed; invalid jointIndex" if is_negative else "getJointState failed (2).",
    )


def _joint_error(record: BodyRecord, joint: int, message: str) -> Exception:
    whole(joint)
    return failure(message, f"body {record.number} has the joints 0 to {record.joint_count - 1}, not {joint}")


START.later(replace_joints, "resetJointState", "resetJointStateMultiDof", "resetJointStatesMultiDof")
START.later(
    replace_joint_reads,
    "getJointState",
    "getJointStates",
    "getJointStateMultiDof",
    "getJointStatesMultiDof",
)
