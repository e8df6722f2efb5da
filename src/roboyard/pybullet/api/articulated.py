"""Jacobians, mass matrix and inverse dynamics at given joint positions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.api.bodies import base_inertial_pose
from roboyard.pybullet.face.arguments import vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import replace_dynamics
from roboyard.pybullet.state.bodies.joint_tables import POSITION_COUNT, VELOCITY_COUNT
from roboyard.pybullet.state.frames import rotated
from roboyard.transforms import Array, matrix_from_quaternion, multiply

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
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
_BAD_DYNAMICS = (
    "calculateInverseDynamics numDofs needs to be positive and [joint positions], "
    "[joint velocities], [joint accelerations] need to match the number of DoF."
)


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
    """Return the linear and angular Jacobian of a point of a link.

    Args:
        bodyUniqueId: body.
        linkIndex: link; -1 for the base.
        localPosition: point relative to the link frame's origin, in the inertial frame's axes (m).
        objPositions: (n,) positions of the movable joints (rad or m).
        objVelocities: (n,) velocities; they do not change the result.
        objAccelerations: (n,) accelerations; they do not change the result.

    Returns:
        Two (3, n) matrices in base axes, from joint velocities (rad/s or m/s) to velocity (m/s) and angular
        velocity (rad/s). A floating base adds six leading columns: its angular, then its linear velocity.

    Raises:
        error: a list has the wrong length, or the body has spherical or planar joints.
    """
    scene = client.scene
    record = scene.bodies.get(bodyUniqueId)
    if record is None or record.revision != scene.world.revision or scene.world.is_stale:
        record = scene.ready(bodyUniqueId, _BAD_JACOBIAN)
    tree = record.tree(scene.world.live_model)
    if tree is not None and -1 <= whole(linkIndex) < record.joint_count:
        point = vector3(localPosition, _BAD_JACOBIAN)
        if any(point):
            point = rotated(record.links[linkIndex + 1].frame.quaternion, point)
        found = tree.jacobian(linkIndex, point, objPositions, objVelocities, objAccelerations)
        if found is not None:
            return found
    layout = record.layout
    for kind, name in ((2, "Spherirical"), (3, "Planar")):
        if kind in layout.kinds:
            raise failure(f"{name} joints are not supported in the pybullet binding")
    point = vector3(localPosition, _BAD_JACOBIAN)
    q = _joint_values(record, objPositions, layout.position_count, _BAD_JACOBIAN)
    for values in (objVelocities, objAccelerations):
        _joint_values(record, values, layout.velocity_count, _BAD_JACOBIAN)
    if not -1 <= whole(linkIndex) < record.joint_count or not len(q):
        raise failure(_BAD_JACOBIAN, f"body {record.number} has no movable joints, or no link {linkIndex}")
    from roboyard._mujoco import mujoco

    model, data = scene.world.live_model, _at(scene, record, q)
    row = record.rows[linkIndex + 1]
    where = data.xpos[row]
    if any(point):
        turned = rotated(record.links[linkIndex + 1].frame.quaternion, point)
        where = where + data.xmat[row].reshape(3, 3) @ turned
    jacobians = np.zeros((2, 3, model.nv))
    mujoco.mj_jac(model, data, jacobians[0], jacobians[1], where, row)
    columns = _columns(record, data) if _floats(record) else None
    jacobians = jacobians[:, :, layout.dofs] if columns is None else jacobians @ columns
    base = _base_axes(record, data)
    if base is not None:
        jacobians = base.T @ jacobians
    linear, angular = jacobians.tolist()
    return tuple(map(tuple, linear)), tuple(map(tuple, angular))


@command()
def calculateMassMatrix(client: Client, bodyUniqueId: int, objPositions: Vector, flags: int = 0) -> Rows:
    """Return the joint-space mass matrix (kg m², kg) at joint positions (rad or m).

    A floating base adds six leading rows and columns: angular, then linear. With flags 1 the positions of a
    floating base start with its seven numbers, and the matrix has seven rows for the base, also for a fixed
    one, where it is: linear, angular (both in world axes) and one of the identity, as for the fourth number
    of each quaternion. The mass of a fixed base is not in them.

    Raises:
        error: the body is unknown or there are too few positions.
    """
    scene = client.scene
    record = scene.bodies.get(bodyUniqueId)
    if record is None or record.revision != scene.world.revision or scene.world.is_stale:
        record = scene.ready(bodyUniqueId, _BAD_MASS_MATRIX)
    tree = None if flags else record.tree(scene.world.live_model)
    found = None if tree is None else tree.mass_matrix(objPositions)
    if tree is not None and found is not None:
        prepared = scene.world.prepared["masses"]
        if record.number not in prepared:
            prepared[record.number] = None, None, *tree.prepared_masses()
        return found
    from roboyard._mujoco import mujoco

    padded, base = bool(whole(flags) & 1), None
    joints: Vector | Array = objPositions
    if padded and _floats(record):
        base, joints = _split_base(objPositions, _BAD_MASS_MATRIX)
    q = _joint_values(record, joints, record.layout.position_count, _BAD_MASS_MATRIX, more_is_fine=True)
    model, data = scene.world.live_model, _at(scene, record, q, base if _floats(record) else None)
    if padded:
        matrix, places = _whole_mass_matrix(record, model, data), _padding(record)[1]
        out = np.eye(_padding(record)[0])
        out[np.ix_(places, places)] = matrix
        return _rows(out)
    mujoco.mj_crb(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    full -= np.diag(model.dof_armature)  # of joints that are held
    if not _floats(record):
        dofs = record.layout.dofs
        matrix = full[dofs[:, None], dofs]
    else:
        columns = _columns(record, data)
        matrix = columns.T @ full @ columns
    return _rows(matrix)


@command(aliases={"bodyIndex": "bodyUniqueId"})
def calculateInverseDynamics(
    client: Client,
    bodyUniqueId: int,
    objPositions: Vector,
    objVelocities: Vector,
    objAccelerations: Vector,
    flags: int = 0,
) -> tuple[float, ...]:
    """Return the joint torques (N m) and forces (N) that cause accelerations, with gravity, without damping.

    A floating base takes 7 + n positions and 6 + n velocities and accelerations (the base's angular before
    linear) and returns 6 + n numbers, the base's force before its torque. With flags 1 accelerations are
    taken as zeros, and velocities of a floating base are its linear, then its angular one in world axes, with
    a zero in the fourth place of every quaternion's velocity. Then a force and a torque of the base (in world
    axes) and a zero come before the n numbers of joints, also for a fixed base.

    Raises:
        error: the body is unknown or a list has the wrong length.
    """
    scene = client.scene
    message = _BAD_DYNAMICS
    record = scene.bodies.get(bodyUniqueId)
    if record is None or record.revision != scene.world.revision or scene.world.is_stale:
        record = scene.ready(bodyUniqueId, message)
    tree = None if flags else record.tree(scene.world.live_model)
    if tree is not None:
        scene.apply_parameters()
        found = tree.inverse_dynamics(objPositions, objVelocities, objAccelerations)
        if found is not None:
            prepared = scene.world.prepared["efforts"]
            if record.number not in prepared:
                prepared[record.number] = scene, scene.parameters, *tree.prepared_efforts()
            return found
    from roboyard._mujoco import mujoco

    floating = _floats(record)
    given = [
        _all_numbers(objPositions, message),
        *(_all_numbers(v, _BAD_SPEEDS) for v in (objVelocities, objAccelerations)),
    ]
    if len(given[1]) != len(given[2]):
        raise failure(_BAD_SPEEDS, f"got {len(given[1])} velocities and {len(given[2])} accelerations")
    padded = bool(whole(flags) & 1)
    if padded:
        return _whole_inverse_dynamics(scene, record, *given[:2])
    layout = record.layout
    extra = (7, 6, 6) if floating else (0, 0, 0)
    counts = (layout.position_count, layout.velocity_count, layout.velocity_count)
    for values, more, count in zip(given, extra, counts, strict=True):
        if len(values) != more + count:
            raise failure(message, f"expected {more + count} numbers, got {len(values)}")
    model = scene.world.live_model
    data = _at(scene, record, given[0][extra[0] :], base=given[0][:7] if floating else None)
    result = np.zeros(model.nv)
    if floating:
        columns = _columns(record, data)
        data.qvel[:] = columns @ given[1]
        data.qacc[:] = columns @ given[2]
    else:
        columns = None
        _, qvel, qacc = scene.scratch_arrays
        qvel[layout.dofs], qacc[layout.dofs] = given[1], given[2]
    mujoco.mj_comVel(model, data)
    mujoco.mj_rne(model, data, 1, result)
    efforts = result[layout.dofs] if columns is None else columns.T @ result
    found = tuple(efforts.tolist())
    return (*found[3:6], *found[:3], *found[6:]) if floating else found


# ------------------------------------------------------------------------------------------------- helpers


def _floats(record: BodyRecord) -> bool:
    """Return whether a body was loaded with a floating base; a fixed one may have got a velocity since."""
    return record.free is not None and not record.loaded_fixed


def _split_base(positions: Vector, message: str) -> tuple[Array, Array]:
    """Return the (7,) pose of the base and the (n,) joint positions."""
    given = np.asarray(positions, dtype=float).reshape(-1)
    if len(given) < 7:
        raise failure(
            message,
            f"with flags 1 the positions start with the base's seven numbers; got {len(given)} numbers",
        )
    return given[:7], given[7:]


def _padding(record: BodyRecord) -> tuple[int, list[int]]:
    """Return the size of the layout of flags 1, and the places in it: of the base's six, then of joints."""
    places, size = [*range(6)], 7
    for info in record.infos:
        places += range(size, size + VELOCITY_COUNT[info[2]])
        size += POSITION_COUNT[info[2]]
    return size, places


def _moving_rows(record: BodyRecord) -> list[int]:
    """Return MuJoCo's rows of the links that count with flags 1: all but a fixed base."""
    return sorted(set(record.rows if _floats(record) else record.rows[1:]))


def _base_place(record: BodyRecord, data: Any) -> Array:
    """Return the (3,) centre of mass of the base (m)."""
    if not _floats(record):
        return np.array(base_inertial_pose(record)[0])
    row = record.rows[0]
    return data.xpos[row] + data.xmat[row].reshape(3, 3) @ np.asarray(record.links[0].frame.position)


def _whole_columns(record: BodyRecord, model: Any, data: Any) -> list[tuple[int, Array, Array]]:
    """Return each row's (3, n) velocity of its centre of mass and angular velocity, in world axes.

    The n columns are the base's linear and angular velocity in world axes, then those of joints.
    """
    from roboyard._mujoco import mujoco

    dofs, place = record.layout.dofs, _base_place(record, data)
    found = []
    for row in _moving_rows(record):
        linear, angular = np.zeros((2, 3, model.nv))
        mujoco.mj_jacBodyCom(model, data, linear, angular, row)
        x, y, z = data.xipos[row] - place
        lever = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        found.append(
            (
                row,
                np.hstack([np.eye(3), lever, linear[:, dofs]]),
                np.hstack([np.zeros((3, 3)), np.eye(3), angular[:, dofs]]),
            )
        )
    return found


def _whole_mass_matrix(record: BodyRecord, model: Any, data: Any) -> Array:
    """Return the (6 + n, 6 + n) mass matrix of a base that moves, in world axes, and joints."""
    matrix = np.zeros((6 + len(record.layout.dofs),) * 2)
    for row, linear, angular in _whole_columns(record, model, data):
        axes = data.ximat[row].reshape(3, 3)
        turned = axes.T @ angular
        matrix += model.body_mass[row] * linear.T @ linear
        matrix += turned.T @ (model.body_inertia[row][:, None] * turned)
    return matrix


def _whole_inverse_dynamics(
    scene: PhysicsScene, record: BodyRecord, positions: Array, velocities: Array
) -> tuple[float, ...]:
    """Return calculateInverseDynamics with flags 1."""
    from roboyard._mujoco import mujoco

    size, places = _padding(record)
    floating, layout = _floats(record), record.layout
    seven = 7 if floating else 0
    wanted = layout.position_count + seven
    if len(positions) < wanted or len(velocities) < wanted:
        raise failure(
            _BAD_DYNAMICS,
            f"expected {wanted} positions and velocities, got {len(positions)} and {len(velocities)}",
        )
    model = scene.world.live_model
    data = _at(scene, record, positions[seven:wanted], positions[:7] if floating else None)
    speeds = velocities[[place - 7 + seven for place in places[6:]]]
    if floating:
        axes = _base_axes(record, data)
        assert axes is not None
        turned = np.concatenate([axes.T @ velocities[3:6], axes.T @ velocities[:3], speeds])
        data.qvel[:] = _columns(record, data) @ turned
        # Bullet takes the angular velocity for one in base axes where it differentiates the base's rotation
        linear, angular = velocities[:3], velocities[3:6]
        shift = np.cross(angular - axes @ angular, linear)
    else:
        data.qvel[layout.dofs] = speeds
        shift = np.zeros(3)
    mujoco.mj_comVel(model, data)
    data.qacc[:] = 0.0
    mujoco.mj_rnePostConstraint(model, data)
    found = np.zeros(len(places))
    for row, linear, angular in _whole_columns(record, model, data):
        force, torque = _needed(model, data, row)
        found += linear.T @ (force + model.body_mass[row] * shift) + angular.T @ torque
    out = np.zeros(size)
    out[places] = found
    return tuple(out.tolist())


def _needed(model: Any, data: Any, row: int) -> tuple[Array, Array]:
    """Return the force (N) and torque (N m) at the centre of mass of a row that moves as `cacc` has it."""
    axes, mass = data.ximat[row].reshape(3, 3), model.body_mass[row]
    centre = data.subtree_com[model.body_rootid[row]]
    turn, lever = data.cvel[row][:3], data.xipos[row] - centre
    linear = data.cacc[row][3:] + np.cross(data.cacc[row][:3], lever)
    speed = data.cvel[row][3:] + np.cross(turn, lever)
    inertia = axes @ (model.body_inertia[row][:, None] * axes.T)
    force = mass * (linear + np.cross(turn, speed))
    return force, inertia @ data.cacc[row][:3] + np.cross(turn, inertia @ turn)


def _joint_values(
    record: BodyRecord, values: Vector | Array, wanted: int, message: str, *, more_is_fine: bool = False
) -> Array:
    given = _all_numbers(values, message)
    if more_is_fine:
        given = given[:wanted]
    if len(given) != wanted:
        raise failure(message, f"body {record.number} needs {wanted} numbers, got {len(given)}")
    return given


def _all_numbers(values: Vector | Array, message: str) -> Array:
    """Return a sequence of any shape as (n,) numbers."""
    try:
        return np.asarray(values, dtype=float).reshape(-1)
    except (TypeError, ValueError):
        raise failure(message, f"expected numbers, got {values!r}") from None


def _at(scene: PhysicsScene, record: BodyRecord, q: Array, base: Array | None = None) -> Any:
    """Return scratch MjData with a body's joints at `q` and its base's inertial frame at `base` (7,)."""
    from roboyard._mujoco import mujoco

    scene.apply_parameters()
    data = scene.scratch_data()
    qpos, qvel, qacc = scene.scratch_arrays
    qpos[:] = record.qpos
    qvel.fill(0.0)
    qacc.fill(0.0)
    layout = record.layout
    qpos[layout.places] = q[layout.order]
    if base is not None:
        free = record.body.free_qpos
        position, orientation = record.from_inertial(base[:3], base[3:] / (np.linalg.norm(base[3:]) or 1.0))
        qpos[free : free + 3], qpos[free + 3 : free + 7] = position, np.roll(orientation, 1)
    model = scene.world.live_model
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return data


def _base_axes(record: BodyRecord, data: Any) -> Array | None:
    """Return the (3, 3) rotation of the base's inertial frame in the world; None for none of a fixed base."""
    if not _floats(record):
        turn = base_inertial_pose(record)[1]
        if turn == (0.0, 0.0, 0.0, 1.0):
            return None
        if record.fixed_axes is None or record.fixed_axes[0] != turn:
            record.fixed_axes = turn, matrix_from_quaternion(turn)
        return record.fixed_axes[1]
    w, x, y, z = data.xquat[record.rows[0]]
    return matrix_from_quaternion(multiply((x, y, z, w), record.links[0].frame.quaternion))


def _columns(record: BodyRecord, data: Any) -> Array:
    """Return the (nv, n) matrix from Bullet's velocities to MuJoCo's.

    Bullet's are base angular, base linear (in base axes), then joints in order.
    """
    dofs = record.layout.dofs
    six = 6 if _floats(record) else 0
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


def _rows(matrix: Array) -> Rows:
    return tuple(map(tuple, matrix.tolist()))


START.later(replace_dynamics, "calculateInverseDynamics", "calculateMassMatrix")
