"""Jacobians, mass matrix and inverse dynamics at joint positions of the caller's choice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.poses import Array, matrix_from_quaternion, multiply
from roboyard.pybullet.arguments import vector3, whole
from roboyard.pybullet.commands import command
from roboyard.pybullet.errors import failure
from roboyard.pybullet.joint_tables import POSITION_COUNT, VELOCITY_COUNT

if TYPE_CHECKING:
    from roboyard.pybullet.clients import Client
    from roboyard.pybullet.records import BodyRecord
    from roboyard.pybullet.scene import Scene

Vector = Sequence[float]
Rows = tuple[tuple[float, ...], ...]
_BAD_JACOBIAN = (
    "calculateJacobian [numDof] needs to be positive, [local position] needs to be of size 3 and "
    "[joint positions], [joint velocities], [joint accelerations] need to match the number of DoF."
)
_BAD_MASS_MATRIX = "Internal error in calculateMassMatrix"
_BAD_DYNAMICS = "calculateInverseDynamics numDofs needs to be positive and [joint positions], "


@command()
def calculateJacobian(
    client: Client,
    bodyUniqueId: int,
    linkIndex: int,
    localPosition: Vector,
    objPositions: Vector,
    objVelocities: Vector,
    objAccelerations: Vector,
) -> tuple[Rows, Rows]:
    """Jacobians of a point of a link: velocity (m/s) and angular velocity (rad/s) from joint velocities.

    Args:
        bodyUniqueId: the body.
        linkIndex: the link; -1 for the base.
        localPosition: the point in the link frame; m.
        objPositions: one number for each movable joint.
        objVelocities: of the same length; they do not matter to the answer.
        objAccelerations: likewise.

    Returns:
        two (3, n) matrices in the axes of the base. A base that moves adds six leading columns: its angular,
        then its linear velocity.
    """
    scene = client.scene
    record = scene.ready(bodyUniqueId, _BAD_JACOBIAN)
    point = vector3(localPosition, _BAD_JACOBIAN)
    q = _joint_values(record, objPositions, POSITION_COUNT, _BAD_JACOBIAN)
    for values in (objVelocities, objAccelerations):
        _joint_values(record, values, VELOCITY_COUNT, _BAD_JACOBIAN)
    if not -1 <= whole(linkIndex) < record.joint_count or not len(q):
        raise failure(_BAD_JACOBIAN, f"body {record.number} has no joint {linkIndex} that moves")
    import mujoco

    model, data = scene.world.model, _at(scene, record, q)
    row = record.rows[linkIndex + 1]
    where = data.xpos[row] + data.xmat[row].reshape(3, 3) @ point
    linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, linear, angular, where, row)
    base, columns = _base_axes(record, data), _columns(record, data)
    return _rows(base.T @ linear @ columns), _rows(base.T @ angular @ columns)


@command()
def calculateMassMatrix(client: Client, bodyUniqueId: int, objPositions: Vector, flags: int = 0) -> Rows:
    """Joint-space mass matrix (kg m², kg) at joint positions; a base that moves adds six leading rows."""
    import mujoco

    scene = client.scene
    record = scene.ready(bodyUniqueId, _BAD_MASS_MATRIX)
    whole(flags)
    q = _joint_values(record, objPositions, POSITION_COUNT, _BAD_MASS_MATRIX)
    model, data = scene.world.model, _at(scene, record, q)
    mujoco.mj_crb(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    columns = _columns(record, data)
    return _rows(columns.T @ full @ columns)


@command(aliases={"bodyIndex": "bodyUniqueId"})
def calculateInverseDynamics(
    client: Client,
    bodyUniqueId: int,
    objPositions: Vector,
    objVelocities: Vector,
    objAccelerations: Vector,
    flags: int = 0,
) -> tuple[float, ...]:
    """Joint torques (N m, N) that bring about accelerations, gravity included and joint damping left out.

    A body whose base moves takes 7 + n positions, 6 + n velocities and accelerations (the base's angular
    before linear) and gives 6 + n numbers.
    """
    import mujoco

    scene = client.scene
    message = _BAD_DYNAMICS + "[joint velocities], [joint accelerations] need to match the number of DoF."
    record = scene.ready(bodyUniqueId, message)
    whole(flags)
    floating = record.free is not None
    given = [np.asarray(v, dtype=float).reshape(-1) for v in (objPositions, objVelocities, objAccelerations)]
    extra = (7, 6, 6) if floating else (0, 0, 0)
    counts = (POSITION_COUNT, VELOCITY_COUNT, VELOCITY_COUNT)
    for values, more, count in zip(given, extra, counts, strict=True):
        wanted = more + sum(count[info[2]] for info in record.infos)
        if len(values) != wanted:
            raise failure(message, f"{wanted} numbers are needed, got {len(values)}")
    model = scene.world.model
    data = _at(scene, record, given[0][extra[0] :], base=given[0][:7] if floating else None)
    columns = _columns(record, data)
    data.qvel[:] = columns @ given[1]
    data.qacc[:] = columns @ given[2]
    mujoco.mj_comVel(model, data)
    result = np.zeros(model.nv)
    mujoco.mj_rne(model, data, 1, result)
    return tuple((columns.T @ result).tolist())


# ------------------------------------------------------------------------------------------------- helpers


def _joint_values(record: BodyRecord, values: Vector, count: dict[int, int], message: str) -> Array:
    given = np.asarray(values, dtype=float).reshape(-1)
    wanted = sum(count[info[2]] for info in record.infos)
    if len(given) != wanted:
        raise failure(message, f"body {record.number} takes {wanted} numbers, got {len(given)}")
    return given


def _at(scene: Scene, record: BodyRecord, q: Array, base: Array | None = None) -> Any:
    """Spare MjData with a body's joints at `q` (and its base's inertial frame at `base`); all else as it
    is.
    """
    import mujoco

    scene.apply_parameters()
    data = scene.spare_data()
    data.qpos[:] = scene.world.data.qpos
    data.qvel[:] = 0.0
    data.qacc[:] = 0.0
    start = 0
    for joint, info in enumerate(record.infos):
        count = POSITION_COUNT[info[2]]
        if count:
            values = q[start : start + count]
            data.qpos[record.positions_of(joint)] = np.roll(values, 1) if count == 4 else values
            start += count
    if base is not None:
        free = record.body.free_qpos
        position, orientation = record.from_inertial(base[:3], base[3:] / (np.linalg.norm(base[3:]) or 1.0))
        data.qpos[free : free + 3], data.qpos[free + 3 : free + 7] = position, np.roll(orientation, 1)
    mujoco.mj_kinematics(scene.world.model, data)
    mujoco.mj_comPos(scene.world.model, data)
    return data


def _base_axes(record: BodyRecord, data: Any) -> Array:
    """(3, 3) axes of the base's inertial frame in the world."""
    w, x, y, z = data.xquat[record.rows[0]]
    return matrix_from_quaternion(multiply((x, y, z, w), record.links[0].frame.quaternion))


def _columns(record: BodyRecord, data: Any) -> Array:
    """(nv, n) MuJoCo's velocities from Bullet's: base angular, base linear (in base axes), then joints in
    order.
    """
    dofs = [d for j, info in enumerate(record.infos) if VELOCITY_COUNT[info[2]] for d in _range(record, j)]
    six = 6 if record.free is not None else 0
    out = np.zeros((len(data.qvel), six + len(dofs)))
    out[dofs, np.arange(six, six + len(dofs))] = 1.0
    if six:
        start, row = record.body.free_dof, record.rows[0]
        axes, link = _base_axes(record, data), data.xmat[row].reshape(3, 3)
        x, y, z = link @ np.asarray(record.links[0].frame.position)
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        out[start : start + 3, 0:3] = cross @ axes
        out[start : start + 3, 3:6] = axes
        out[start + 3 : start + 6, 0:3] = link.T @ axes
    return out


def _range(record: BodyRecord, joint: int) -> range:
    place = record.velocities_of(joint)
    return range(place.start, place.stop)


def _rows(matrix: Array) -> Rows:
    return tuple(tuple(row) for row in matrix.tolist())
