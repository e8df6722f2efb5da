"""Joint motors: setJointMotorControl2 and its array and multi-degree-of-freedom forms."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import partial
from math import inf, nan
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.api.joints import OUT_OF_RANGE, joint_of, known_joint_of
from roboyard.pybullet.bullet_rules.motor_commands import DEFAULT_MAX_FORCE, MotorCommands
from roboyard.pybullet.bullet_rules.spherical_motors import IDENTITY, set_spherical_target
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import check_finite, floats, indices, number, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import is_machine_code, replace_motors
from roboyard.pybullet.state.bodies.joint_tables import VELOCITY_COUNT

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Vector = Sequence[float]
KP, KD = 0.1, 1.0
_FAILED = "setJointMotorControl failed."
_MODES = (c.VELOCITY_CONTROL, c.TORQUE_CONTROL, c.POSITION_CONTROL, c.PD_CONTROL)
_OLD_BODY = {"bodyIndex": "bodyUniqueId"}
_MOTORED = (0, 1, 2)
_NUMBERS = float, int
_FIXED = -2
"""In place of the degree of freedom of a joint that has no torque."""


@command(aliases=_OLD_BODY)
def setJointMotorControl2(
    client: Client,
    bodyUniqueId: int,
    jointIndex: int,
    controlMode: int,
    targetPosition: float = 0.0,
    targetVelocity: float = 0.0,
    force: float = DEFAULT_MAX_FORCE,
    positionGain: float = KP,
    velocityGain: float = KD,
    maxVelocity: float = -1.0,
) -> None:
    """Set the command of a joint's motor.

    Args:
        bodyUniqueId: body.
        jointIndex: joint of one degree of freedom.
        controlMode: VELOCITY_CONTROL and POSITION_CONTROL aim at the velocity kp (q* - q) / dt + v + kd (v*
            - v) after the step (kp 0 for velocity control); TORQUE_CONTROL adds a torque for one step;
            PD_CONTROL is a spring-damper torque kp (q* - q) + kd (v* - v) in every step from now on.
        targetPosition: q* (rad or m).
        targetVelocity: v* (rad/s or m/s).
        force: largest torque or force of the motor, or the torque itself (N m or N).
        positionGain: kp.
        velocityGain: kd.
        maxVelocity: largest velocity of position control (rad/s or m/s).

    Raises:
        error: the joint does not exist, or the mode is unknown.
    """
    scene = client.scene
    record = scene.bodies.get(bodyUniqueId)
    if controlMode == c.TORQUE_CONTROL and type(force) in _NUMBERS and force - force == 0.0:
        world = scene.world
        if (
            record is None
            or record.revision != world.revision
            or world.is_stale
            or type(jointIndex) is not int
            or not 0 <= jointIndex < record.joint_count
        ):
            record = joint_of(client, bodyUniqueId, jointIndex)
        if record.is_scalar[jointIndex]:
            world.wrenches.add_effort(record.velocity_addresses[jointIndex], force)
        if is_machine_code("setJointMotorControl2"):
            _prepare_torques(scene, record)
        return
    if record is not None and record.motor_commands is not None:
        try:
            if record.motor_commands.set(
                jointIndex, controlMode, targetPosition, targetVelocity, force, positionGain, velocityGain,
                maxVelocity, client.parameters.time_step,
            ):  # fmt: skip
                if is_machine_code("setJointMotorControl2"):
                    _prepare(client, record)
                return
        except (struct.error, IndexError, TypeError):
            pass  # raised below, with PyBullet's text
    record = known_joint_of(client, bodyUniqueId, jointIndex)
    if whole(controlMode) not in _MODES:
        raise failure("Illegal control mode.", f"unknown control mode {controlMode!r}")
    _drive(
        client.scene, record, jointIndex, controlMode,
        *(number(targetPosition), number(targetVelocity), number(force)),
        *(number(positionGain), number(velocityGain), number(maxVelocity)),
    )  # fmt: skip
    if is_machine_code("setJointMotorControl2"):
        if controlMode == c.TORQUE_CONTROL:
            _prepare_torques(client.scene, record)
        else:
            _prepare(client, record)


@command(aliases=_OLD_BODY)
def setJointMotorControlArray(
    client: Client,
    bodyUniqueId: int,
    jointIndices: Sequence[int],
    controlMode: int,
    targetPositions: Vector | None = None,
    targetVelocities: Vector | None = None,
    forces: Vector | None = None,
    positionGains: Vector | None = None,
    velocityGains: Vector | None = None,
) -> None:
    """Set the commands of several motors; see setJointMotorControl2.

    Raises:
        error: a joint does not exist, the mode is unknown, or a list has the wrong length.
    """
    scene = client.scene
    record = scene.bodies.get(bodyUniqueId)
    if record is not None and record.motor_commands is not None:
        try:
            if record.motor_commands.set_many(
                jointIndices, controlMode, targetPositions, targetVelocities, forces, positionGains,
                velocityGains, client.parameters.time_step,
            ):  # fmt: skip
                scene.pending_commands.add(record.motor_commands)
                if is_machine_code("setJointMotorControlArray"):
                    _prepare(client, record)
                return
        except TypeError:
            pass  # raised below, with PyBullet's text
    if whole(controlMode) not in _MODES:
        raise failure("Illegal control mode.", f"unknown control mode {controlMode!r}")
    joints = indices(jointIndices)
    for joint in joints:
        known_joint_of(client, bodyUniqueId, joint)
    count = len(joints)
    if not count:
        return
    s = "should match the number of joint indices"
    velocities = _each(targetVelocities, count, 0.0, f"number of target velocies {s}")
    positions = _each(targetPositions, count, 0.0, f"number of target positions {s}")
    largest = _each(forces, count, DEFAULT_MAX_FORCE, "number of forces should match the joint indices")
    kps = _each(positionGains, count, KP, "number of kps should match the joint indices")
    kds = _each(velocityGains, count, KD, f"number of kds {s}")
    record = scene.bodies[bodyUniqueId]
    for joint, position, velocity, force, kp, kd in zip(
        joints, positions, velocities, largest, kps, kds, strict=True
    ):
        _drive(scene, record, joint, controlMode, position, velocity, force, kp, kd, -1.0)
    if is_machine_code("setJointMotorControlArray"):
        if controlMode == c.TORQUE_CONTROL:
            _prepare_torques(scene, record)
        else:
            _prepare(client, record)


@command()
def setJointMotorControlMultiDof(
    client: Client,
    bodyUniqueId: int,
    jointIndex: int,
    controlMode: int,
    targetPosition: Vector | None = None,
    targetVelocity: Vector | None = None,
    force: Vector | None = None,
    positionGain: float = KP,
    velocityGain: float = KD,
    maxVelocity: float = -1.0,
    damping: float = 1.0,
) -> None:
    """Set the command of the motor of a joint with any number of degrees of freedom.

    Position has 1 number (rad or m) or 4 (a quaternion), velocity 1 or 3, force 1 or 3 (one applies to all; N
    m or N). Motors of spherical joints always aim at velocity 0: velocityGain and maxVelocity have no effect
    on them, and damping is the share of their velocity that they remove in a step.

    Raises:
        error: the joint does not exist, or the mode is neither TORQUE_CONTROL nor POSITION_CONTROL.
    """
    scene = client.scene
    record = scene.bodies.get(bodyUniqueId)
    if (
        controlMode == c.POSITION_CONTROL
        and record is not None
        and type(damping) is float
        and _drive_one(
            scene, record, jointIndex, targetPosition, targetVelocity, force, positionGain, velocityGain,
            maxVelocity,
        )
    ):  # fmt: skip
        if is_machine_code("setJointMotorControlMultiDof"):
            _prepare(client, record)
        return
    record = known_joint_of(client, bodyUniqueId, jointIndex)
    if whole(controlMode) not in (c.TORQUE_CONTROL, c.POSITION_CONTROL):
        raise failure("Illegal control mode.", f"use TORQUE_CONTROL or POSITION_CONTROL; got {controlMode}")
    gains = number(positionGain), number(velocityGain), number(maxVelocity)
    _drive_many(
        client.scene, record, jointIndex, controlMode, targetPosition, targetVelocity, force, *gains,
        number(damping),
    )  # fmt: skip
    if controlMode == c.TORQUE_CONTROL and is_machine_code("setJointMotorControlMultiDof"):
        _prepare_torques(client.scene, record)


@command()
def setJointMotorControlMultiDofArray(
    client: Client,
    bodyUniqueId: int,
    jointIndices: Sequence[int],
    controlMode: int,
    targetPositions: Sequence[Vector] | None = None,
    targetVelocities: Sequence[Vector] | None = None,
    forces: Sequence[Vector] | None = None,
    positionGains: Vector | None = None,
    velocityGains: Vector | None = None,
    maxVelocities: Vector | None = None,
) -> None:
    """Set the commands of several motors; see setJointMotorControlMultiDof. Short lists use the defaults.

    Raises:
        error: a joint does not exist, or the mode is unknown.
    """
    record = client.scene.bodies.get(bodyUniqueId)
    if controlMode == c.POSITION_CONTROL and maxVelocities is None and record is not None:
        lists = targetPositions, targetVelocities, forces
        if record.motor_commands is not None and _drive_all(
            client.scene, record.motor_commands, jointIndices, lists, positionGains, velocityGains
        ):
            if is_machine_code("setJointMotorControlMultiDofArray"):
                _prepare(client, record)
            return
    if whole(controlMode) not in (c.TORQUE_CONTROL, c.POSITION_CONTROL, c.PD_CONTROL, c.STABLE_PD_CONTROL):
        raise failure("Illegal control mode.", f"unknown control mode {controlMode!r}")
    joints = indices(jointIndices)
    count = len(joints)
    kps, kds = _as_many(positionGains, count, KP), _as_many(velocityGains, count, KD)
    fastest = _as_many(maxVelocities, count, -1.0)
    lists = [_as_many(values, count, None) for values in (targetPositions, targetVelocities, forces)]
    if controlMode == c.STABLE_PD_CONTROL:
        records = [joint_of(client, bodyUniqueId, joint) for joint in joints]
        if records:
            _drive_stable(client.scene, records[0], joints, lists[0], lists[1], lists[2], kps, kds)
        return
    record = None
    for i, joint in enumerate(joints):
        if record is None or not 0 <= joint < record.joint_count:
            record = known_joint_of(client, bodyUniqueId, joint)
        position, velocity, force = (values[i] for values in lists)
        _drive_many(
            client.scene, record, joint, controlMode, position, velocity, force, kps[i], kds[i], fastest[i]
        )
    if controlMode == c.TORQUE_CONTROL and record and is_machine_code("setJointMotorControlMultiDofArray"):
        _prepare_torques(client.scene, record)


# ------------------------------------------------------------------------------------------------- helpers


def _prepare(client: Client, record: BodyRecord) -> None:
    """Apply the pending commands of a body, so that machine code can command its motors."""
    world = client.scene.world
    if world.is_stale or not any(record.is_scalar):
        return
    motors = _commands_of(client.scene, record)  # none yet where only fixed joints were commanded
    if record.revision != world.revision:
        client.scene.ready(record.number, OUT_OF_RANGE)
    if motors.pending:
        motors.flush()
    known = world.prepared.get("motors")
    if known is not None and record.number not in known:
        known[record.number] = motors.prepared(client.parameters, partial(_switch, client.scene, record))


def _switch(scene: PhysicsScene, record: BodyRecord, joint: int, is_off: bool | None) -> None:
    """Note that the motor of a joint of one degree of freedom is switched off, or on; see `switch_motor`."""
    if is_off is None:
        record.motored[joint] = True
        record.motors_off.discard(joint)
        return
    if record.motored[joint] and scene.motor_revision == scene.world.revision == record.revision:
        record.applied[joint] = scene.motor_forces().item(record.velocity_addresses[joint])
    record.motored[joint] = False
    record.motors_off.add(joint)


def _prepare_torques(scene: PhysicsScene, record: BodyRecord) -> None:
    """Let machine code add torques of a body's joints."""
    world = scene.world
    known = world.prepared.get("torques")
    if known is None or record.number in known or world.is_stale or record.revision != world.revision:
        return
    addresses, count = record.velocity_addresses, record.joint_count
    dofs = [
        _FIXED if record.joint_type(joint) not in _MOTORED
        else addresses[joint] if record.is_scalar[joint]
        else -1
        for joint in range(count)
    ]  # fmt: skip
    known[record.number] = (
        *(world.wrenches, world.live_data.qfrc_applied, np.array(dofs, np.int64)),
        *(np.zeros((count, 2)),),
    )


def _as_many(values: Sequence[Any] | None, count: int, default: Any) -> list[Any]:
    """Return the first `count` values; the default replaces missing ones."""
    given = list(values)[:count] if hasattr(values, "__iter__") and values is not None else []
    return given + [default] * (count - len(given))


def _each(values: Vector | None, count: int, default: float, message: str) -> Sequence[float]:
    return (default,) * count if values is None else floats(values, count, message)


def _within_limits(record: BodyRecord, joint: int, position: float) -> float:
    """Return the target of a joint (rad or m) within its limits, if it has any."""
    lower, upper = record.infos[joint][8:10]
    return min(max(position, lower), upper) if lower <= upper else position


def _drive(
    scene: PhysicsScene, record: BodyRecord, joint: int, mode: int, position: float, velocity: float,
    force: float,
    kp: float, kd: float, fastest: float,
) -> None:  # fmt: skip
    if record.joint_type(joint) not in (0, 1):
        return
    handle = record.body.joints[joint]
    if force != force:
        raise failure(_FAILED, f"force must be a number, got {force}")
    if mode == c.TORQUE_CONTROL:
        scene.ready(record.number, OUT_OF_RANGE)
        scene.world.wrenches.add_joint_effort(handle, force)
        return
    if mode == c.PD_CONTROL:
        from roboyard.pybullet.state.spring_damper import SpringDamper

        check_finite(
            _FAILED,
            targetPosition=position,
            targetVelocity=velocity,
            positionGain=kp,
            velocityGain=kd,
        )
        scene.spring_dampers[(record.number, joint)] = SpringDamper(
            scene,
            record,
            joint,
            _within_limits(record, joint, position),
            velocity,
            kp,
            kd,
            force,
            OUT_OF_RANGE,
        )
        return
    motors = _commands_of(scene, record)
    motors.flush()
    motors.bound_changed(joint, nan)
    scene.switch_motor(record, joint, off=force == 0.0)
    impulse = force * scene.time_step
    if mode == c.VELOCITY_CONTROL:
        scene.world.motors.set(handle, velocity=velocity, kp=0.0, kd=kd, max_impulse=impulse)
    else:
        scene.world.motors.set(
            handle, position=_within_limits(record, joint, position), velocity=velocity, kp=kp, kd=kd,
            max_impulse=impulse,
            max_velocity=max(fastest, 0.0),
        )  # fmt: skip
    if impulse > 0.0 or force == 0.0:
        motors.bound_changed(joint, impulse)


def _commands_of(scene: PhysicsScene, record: BodyRecord) -> MotorCommands:
    """Return the fast motor commands of a body, whose default motors it has from then on."""
    scene.ensure_default_motors(record)
    if record.motor_commands is None:
        record.motor_commands = MotorCommands(
            scene.world.motors.of(record.body), record.infos, record.body.dof_offsets, record.motors_off
        )
    return record.motor_commands


def _drive_many(
    scene: PhysicsScene, record: BodyRecord, joint: int, mode: int, position: Vector | None, velocity:
    Vector | None,
    force: Vector | None, kp: float, kd: float, fastest: float, damping: float = 1.0,
) -> None:  # fmt: skip
    kind = record.joint_type(joint)
    if kind not in _MOTORED:
        return
    if kind != 2 and mode == c.POSITION_CONTROL and _drive_one(
        scene, record, joint, position, velocity, force, kp, kd, fastest
    ):  # fmt: skip
        return
    size = VELOCITY_COUNT[kind]
    forces = [DEFAULT_MAX_FORCE] * size if force is None else _spread(force, size)
    if any(limit != limit for limit in forces):
        raise failure(_FAILED, f"force must be numbers, got {forces}")
    speeds = [0.0] * size if velocity is None else [number(v) for v in velocity]
    if kind != 2:
        where = number(next(iter(() if position is None else position), 0.0))
        _drive(scene, record, joint, mode, where, speeds[0] if speeds else 0.0, forces[0], kp, kd, fastest)
        return
    if mode == c.TORQUE_CONTROL:
        scene.add_spherical_torque(scene.ready(record.number, OUT_OF_RANGE), joint, forces)
        return
    _drive_spherical(scene, record, joint, position, velocity, forces, kp, damping)


def _drive_all(
    scene: PhysicsScene,
    motors: MotorCommands,
    joints: Sequence[int],
    lists: Sequence[Any],
    kps: Vector | None,
    kds: Vector | None,
) -> bool:
    """Set motors of one degree of freedom as setJointMotorControlArray does; return False if it cannot."""
    try:
        positions, velocities, forces = (
            None if values is None else [value for (value,) in values] for values in lists
        )
        if not motors.set_many(
            joints, c.POSITION_CONTROL, positions, velocities, forces, kps, kds, scene.time_step
        ):
            return False
    except (TypeError, ValueError):
        return False
    scene.pending_commands.add(motors)
    return True


def _drive_one(
    scene: PhysicsScene, record: BodyRecord, joint: int, position: Vector | None, velocity: Vector | None,
    force: Vector | None, kp: float, kd: float, fastest: float,
) -> bool:  # fmt: skip
    """Set the motor of a joint as setJointMotorControl2 does; return False, with no effect, if it cannot."""
    motors = record.motor_commands
    if motors is None:
        return False
    try:
        (q,) = (0.0,) if position is None else position
        (v,) = (0.0,) if velocity is None else velocity
        (limit,) = (DEFAULT_MAX_FORCE,) if force is None else force
        if not (type(q) in _NUMBERS and type(v) in _NUMBERS and type(limit) in _NUMBERS):
            return False
        return motors.set(joint, c.POSITION_CONTROL, q, v, limit, kp, kd, fastest, scene.time_step)
    except (struct.error, IndexError, TypeError, ValueError):
        return False


def _drive_spherical(
    scene: PhysicsScene, record: BodyRecord, joint: int, position: Vector | None, velocity: Vector | None,
    forces: Sequence[float], kp: float, damping: float,
) -> None:  # fmt: skip
    """Set the target of a spherical joint; ignored without 4 numbers of position or 3 of velocity."""
    is_aimed = position is not None and len(position) == 4
    if not is_aimed and (velocity is None or len(velocity) != 3):
        return
    scene.ensure_default_motors(record)
    scene.switch_motor(record, joint, off=not any(forces))
    target = tuple(map(number, position)) if position is not None and is_aimed else IDENTITY
    impulse = [force * scene.time_step for force in forces]
    set_spherical_target(scene.world, record.body.joints[joint], target, kp, impulse, damping)


def _drive_stable(
    scene: PhysicsScene,
    record: BodyRecord,
    joints: Sequence[int],
    positions: Sequence[Any],
    velocities: Sequence[Any],
    forces: Sequence[Any],
    kps: Sequence[float],
    kds: Sequence[float],
) -> None:
    """Apply stable PD torques to joints for one step; None in a list is zero, or no limit for a force."""
    from roboyard.pybullet.bullet_rules.stable_pd import StablePdTargets, rotation_error, stable_pd_torque

    world = scene.world
    world.ensure_compiled()
    model, data, live = world.live_model, scene.scratch_data(), world.live_data
    data.qpos[:], data.qvel[:] = live.qpos, live.qvel
    targets = StablePdTargets.zeros(model.nv)
    driven: list[int] = []
    for joint, position, velocity, force, kp, kd in zip(
        joints, positions, velocities, forces, kps, kds, strict=True
    ):
        place = record.velocities_of(joint)
        size = place.stop - place.start
        if not size:
            continue
        targets.kp[place], targets.kd[place] = kp, kd
        targets.velocity_target[place] = _per_dof(velocity, size, 0.0)
        targets.limit[place] = _per_dof(force, size, inf)
        if position is not None:
            now, goal = data.qpos[record.positions_of(joint)], [number(value) for value in position]
            error = rotation_error(now, goal) if len(now) == 4 else np.array(goal[:1]) - now
            targets.position_error[place] = error
        driven += range(place.start, place.stop)
    own = [d for j in range(record.joint_count) for d in range(*record.velocities_of(j).indices(model.nv))]
    if record.free is not None:
        own = [*range(record.body.free_dof, record.body.free_dof + 6), *own]
    torque = stable_pd_torque(model, data, scene.time_step, targets, own)
    live.qfrc_applied[driven] += torque[driven]
    world.wrenches.pending = True


def _per_dof(values: Any, size: int, default: float) -> list[float]:
    """Return one number per degree of freedom: one for all, or the first `size`; the default for None."""
    if values is None:
        return [default] * size
    found = [number(value) for value in values]
    return (found * size if len(found) == 1 else found)[:size]


def _spread(values: Vector, size: int) -> list[float]:
    """Return a force limit per degree of freedom: one for all or one each, else the default."""
    given = [number(v) for v in values]
    if len(given) == 1:
        return given * size
    return given if len(given) == size else [DEFAULT_MAX_FORCE] * size


START.later(
    replace_motors,
    "setJointMotorControl2",
    "setJointMotorControlArray",
    "setJointMotorControlMultiDof",
    "setJointMotorControlMultiDofArray",
)
