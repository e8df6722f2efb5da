"""Jacobians, mass matrix and inverse dynamics at joint positions of the caller's choice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.face.arguments import vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.joint_tables import POSITION_COUNT, VELOCITY_COUNT
from roboyard.transforms import Array, matrix_from_quaternion, multiply, rotate

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Vector = Sequence[float]
Rows = tuple[tuple[float, ...], ...]
_BAD_JACOBIAN = (
    "calculateJacobian [numDof] needs to be positive, [local position] needs to be of size 3 and "
    "[joint positions], [joint velocities], [joint accelerations] need to match the number of DoF."
)
_BAD_MASS_MATRIX = "Internal error in calculateMassMatrix"
_BAD_SPEEDS = (
    "calculateInverseDynamics numDofs needs to be positive and [joint velocities] and[joint accelerations] "
    "need to be equal and match the number of degrees of freedom."
)
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
        localPosition: the point from the link frame's origin, along the inertial frame's axes; m.
        objPositions: one number for each movable joint.
        objVelocities: of the same length; they do not matter to the answer.
        objAccelerations: likewise.

    Returns:
        two (3, n) matrices in the axes of the base. A base that moves adds six leading columns: its angular,
        then its linear velocity.
    """
    scene = client.scene
    record = scene.ready(bodyUniqueId, _BAD_JACOBIAN)
    for kind, name in ((2, "Spherirical"), (3, "Planar")):
        if any(info[2] == kind for info in record.infos):
            raise failure(f"{name} joints are not supported in the pybullet binding")
    point = vector3(localPosition, _BAD_JACOBIAN)
    q = _joint_values(record, objPositions, POSITION_COUNT, _BAD_JACOBIAN)
    for values in (objVelocities, objAccelerations):
        _joint_values(record, values, VELOCITY_COUNT, _BAD_JACOBIAN)
    if not -1 <= whole(linkIndex) < record.joint_count or not len(q):
        raise failure(_BAD_JACOBIAN, f"body {record.number} has no joint {linkIndex} that moves")
    import mujoco

    model, data = scene.world.live_model, _at(scene, record, q)
    row = record.rows[linkIndex + 1]
    turned = rotate(record.links[linkIndex + 1].frame.quaternion, point)
    where = data.xpos[row] + data.xmat[row].reshape(3, 3) @ turned
    linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, linear, angular, where, row)
    base, columns = _base_axes(record, data), _columns(record, data)
    return _rows(base.T @ linear @ columns), _rows(base.T @ angular @ columns)


@command()
def calculateMassMatrix(client: Client, bodyUniqueId: int, objPositions: Vector, flags: int = 0) -> Rows:
    """Joint-space mass matrix (kg m², kg) at joint positions; a base that moves adds six leading rows.

    With flags 1 the base's seven numbers come first, always, and every quaternion has four rows. The fourth
    of these, and all seven of a base that does not move, are those of a unit matrix.
    """
    import mujoco

    scene = client.scene
    record = scene.ready(bodyUniqueId, _BAD_MASS_MATRIX)
    padded, base = bool(whole(flags) & 1), None
    joints: Vector | Array = objPositions
    if padded:
        base, joints = _split_base(objPositions, _BAD_MASS_MATRIX)
    q = _joint_values(record, joints, POSITION_COUNT, _BAD_MASS_MATRIX, more_is_fine=True)
    model, data = scene.world.live_model, _at(scene, record, q, base if record.free is not None else None)
    mujoco.mj_crb(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    columns = _columns(record, data)
    matrix = columns.T @ full @ columns
    if not padded:
        return _rows(matrix)
    size, places = _padding(record)
    out = np.eye(size)
    out[np.ix_(places, places)] = matrix
    return _rows(out)


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
    before linear) and gives 6 + n numbers. With flags 1 all are laid out as positions are, base first, with a
    zero in the fourth place of every quaternion's velocity.
    """
    import mujoco

    scene = client.scene
    message = _BAD_DYNAMICS + "[joint velocities], [joint accelerations] need to match the number of DoF."
    record = scene.ready(bodyUniqueId, message)
    floating = record.free is not None
    given = [
        _all_numbers(objPositions, message),
        *(_all_numbers(v, _BAD_SPEEDS) for v in (objVelocities, objAccelerations)),
    ]
    if len(given[1]) != len(given[2]):
        raise failure(_BAD_SPEEDS, f"got {len(given[1])} velocities and {len(given[2])} accelerations")
    padded = bool(whole(flags) & 1)
    size, places = _padding(record)
    if padded:
        if any(len(values) != size for values in given):
            raise failure(message, f"{size} numbers are needed, got {[len(v) for v in given]}")
        positions = given[0] if floating else given[0][7:]
        given = [positions, given[1][places], given[2][places]]
    extra = (7, 6, 6) if floating else (0, 0, 0)
    counts = (POSITION_COUNT, VELOCITY_COUNT, VELOCITY_COUNT)
    for values, more, count in zip(given, extra, counts, strict=True):
        wanted = more + sum(count[info[2]] for info in record.infos)
        if len(values) != wanted:
            raise failure(message, f"{wanted} numbers are needed, got {len(values)}")
    model = scene.world.live_model
    data = _at(scene, record, given[0][extra[0] :], base=given[0][:7] if floating else None)
    columns = _columns(record, data)
    data.qvel[:] = columns @ given[1]
    data.qacc[:] = columns @ given[2]
    mujoco.mj_comVel(model, data)
    result = np.zeros(model.nv)
    mujoco.mj_rne(model, data, 1, result)
    efforts = columns.T @ result
    if not padded:
        return tuple(efforts.tolist())
    out = np.zeros(size)
    out[places] = efforts
    return tuple(out.tolist())


# ------------------------------------------------------------------------------------------------- helpers


def _split_base(positions: Vector, message: str) -> tuple[Array, Array]:
    """The base's seven numbers, and the joints'."""
    given = np.asarray(positions, dtype=float).reshape(-1)
    if len(given) < 7:
        raise failure(message, f"with flags 1 the base's seven numbers come first; got {len(given)} in all")
    return given[:7], given[7:]


def _padding(record: BodyRecord) -> tuple[int, list[int]]:
    """How many numbers the layout of flags 1 has, and where the columns of `_columns` are in it."""
    places = [3, 4, 5, 0, 1, 2] if record.free is not None else []
    size = 7
    for info in record.infos:
        places += range(size, size + VELOCITY_COUNT[info[2]])
        size += POSITION_COUNT[info[2]]
    return size, places


def _joint_values(
    record: BodyRecord,
    values: Vector | Array,
    count: dict[int, int],
    message: str,
    *,
    more_is_fine: bool = False,
) -> Array:
    given = _all_numbers(values, message)
    wanted = sum(count[info[2]] for info in record.infos)
    if more_is_fine:
        given = given[:wanted]
    if len(given) != wanted:
        raise failure(message, f"body {record.number} takes {wanted} numbers, got {len(given)}")
    return given


def _all_numbers(values: Vector | Array, message: str) -> Array:
    """(n,) numbers of any sequence, in whatever shape."""
    try:
        return np.asarray(values, dtype=float).reshape(-1)
    except (TypeError, ValueError):
        raise failure(message, f"numbers are needed, got {values!r}") from None


def _at(scene: PhysicsScene, record: BodyRecord, q: Array, base: Array | None = None) -> Any:
    """Spare MjData with a body's joints at `q` (and its base's inertial frame at `base`); all else as it
    is.
    """
    import mujoco

    scene.apply_parameters()
    data = scene.spare_data()
    data.qpos[:] = scene.world.live_data.qpos
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
    mujoco.mj_kinematics(scene.world.live_model, data)
    mujoco.mj_comPos(scene.world.live_model, data)
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
