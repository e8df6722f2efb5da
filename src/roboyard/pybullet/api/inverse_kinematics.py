"""Inverse kinematics: joint positions that bring links to targets, by PyBullet's damped steps."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.pybullet.api.bodies import base_inertial_pose
from roboyard.pybullet.face.arguments import floats, number, quaternion, vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import error, failure
from roboyard.pybullet.state.bodies.joint_tables import POSITION_COUNT
from roboyard.transforms import Array, conjugate, multiply, normalized, rotate

if TYPE_CHECKING:
    from roboyard.kinematics import ChainArrays
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene

steps = lazy_module("roboyard.kinematics.steps")

Vector = Sequence[float]
_FAILED = "Error in calculateInverseKinematics"
_ITERATIONS, _RESIDUAL = 20, 1e-4
_WRONG_POSITION = "calculateInverseKinematics couldn't extract position vector3"
_WRONG_CURRENT = (
    "calculateInverseKinematics the size of input current positions needs to be equal to the number of "
    "degrees of freedom."
)


@command(aliases={"bodyIndex": "bodyUniqueId"})
def calculateInverseKinematics(
    client: Client,
    bodyUniqueId: int,
    endEffectorLinkIndex: int,
    targetPosition: Vector,
    targetOrientation: Vector | None = None,
    lowerLimits: Vector | None = None,
    upperLimits: Vector | None = None,
    jointRanges: Vector | None = None,
    restPoses: Vector | None = None,
    jointDamping: Vector | None = None,
    solver: int = 0,
    currentPositions: Vector | None = None,
    maxNumIterations: int = _ITERATIONS,
    residualThreshold: float = _RESIDUAL,
) -> tuple[float, ...]:
    """Return the positions of all movable joints (rad or m) that bring a link's frame to a target.

    The search starts at the current (or given) positions and takes at most maxNumIterations small steps;
    repeat the call from its result to continue. The robot does not move.

    Args:
        bodyUniqueId: body.
        endEffectorLinkIndex: link.
        targetPosition: position of the link frame in the world (m).
        targetOrientation: orientation (x, y, z, w); None, or another length than 4, leaves it free.
        lowerLimits: (n,) lower limits of all movable joints. With upperLimits, jointRanges and restPoses, the
            solution stays close to restPoses. Lists of another length are ignored.
        upperLimits: (n,) upper limits.
        jointRanges: (n,) ranges.
        restPoses: (n,) preferred positions.
        jointDamping: (n,) damping of all movable joints; a larger value moves a joint less. Of more numbers
            the first n count; fewer are ignored.
        solver: IK_DLS or IK_SDLS; both use the same damped steps here.
        currentPositions: (n,) start positions.
        maxNumIterations: largest number of steps.
        residualThreshold: error (m and rad) at which the search stops.

    Raises:
        error: the body or link does not exist, or a required list has the wrong length.
    """
    whole(solver)
    goal = vector3(targetPosition, _WRONG_POSITION), _orientation(targetOrientation)
    null_space = (lowerLimits, upperLimits, jointRanges, restPoses)
    limits = whole(maxNumIterations), number(residualThreshold)
    return _solve(
        client.scene, bodyUniqueId, [whole(endEffectorLinkIndex)], [goal], null_space, jointDamping,
        currentPositions, *limits,
    )  # fmt: skip


@command()
def calculateInverseKinematics2(
    client: Client,
    bodyUniqueId: int,
    endEffectorLinkIndices: Sequence[int],
    targetPositions: Sequence[Vector],
    lowerLimits: Vector | None = None,
    upperLimits: Vector | None = None,
    jointRanges: Vector | None = None,
    restPoses: Vector | None = None,
    jointDamping: Vector | None = None,
    solver: int = 0,
    currentPositions: Vector | None = None,
    maxNumIterations: int = _ITERATIONS,
    residualThreshold: float = _RESIDUAL,
) -> tuple[float, ...]:
    """Return joint positions that bring several links to positions; see calculateInverseKinematics.

    Raises:
        error: as calculateInverseKinematics, or there are not as many links as targets.
    """
    whole(solver)
    links = [whole(link) for link in endEffectorLinkIndices]
    goals: list[tuple[Vector, Vector | None]] = [(vector3(p, _FAILED), None) for p in targetPositions]
    if len(links) != len(goals) or not links:
        raise failure(
            _FAILED, f"expected as many targets as links, got {len(links)} links and {len(goals)} targets"
        )
    null_space = (lowerLimits, upperLimits, jointRanges, restPoses)
    return _solve(
        client.scene, bodyUniqueId, links, goals, null_space, jointDamping, currentPositions,
        whole(maxNumIterations), number(residualThreshold),
    )  # fmt: skip


def _orientation(given: Vector | None) -> Vector | None:
    try:
        return None if given is None else quaternion(given, "")
    except error:
        return None


def _solve(
    scene: PhysicsScene, body: int, links: list[int], goals: list[tuple[Vector, Vector | None]],
    null_space: tuple[Vector | None, ...], damping: Vector | None, current: Vector | None, iterations: int,
    threshold: float,
) -> tuple[float, ...]:  # fmt: skip
    message = _FAILED if current is None else _WRONG_CURRENT
    record = scene.ready(body, message)
    chain = record.chains.get((*links,))
    if chain is None and not record.movable():
        raise failure(message, f"body {body} has no movable joint")
    if not all(0 <= link < record.joint_count for link in links):
        raise failure(_FAILED, f"body {body} has the links 0 to {record.joint_count - 1}, not {links}")
    chain = chain or _chain(record, tuple(links))
    start = _start(record, current)
    in_base = _in_base if current is None or not len(current) else _from_inertial
    targets = np.array(
        [in_base(record, *_of_link(record, link, *goal)) for link, goal in zip(links, goals, strict=True)]
    )
    first, second, third, last = null_space
    has_pulls = not (first is None or second is None or third is None or last is None)
    if damping is None and current is None and not has_pulls:
        return tuple(steps().plain_steps(chain, start, targets, threshold, max(iterations, 0)).tolist())
    keywords: dict[str, Any] = {}
    if has_pulls:
        given = [_complete(values, chain.size) for values in null_space]
        if not any(values is None for values in given):
            keywords = dict(zip(("lower", "upper", "ranges", "rest"), given, strict=True))
    if damping is not None and len(damping) > chain.size:
        damping = damping[: chain.size]  # the numbers that Bullet reads
    damping_values = None if damping is None else _complete(damping, chain.size)
    if damping_values is not None:
        keywords["joint_damping"] = damping_values
    answer = steps().damped_step_ik(
        chain, start, targets if len(targets) > 1 else targets[0], iterations=max(iterations, 0),
        residual_threshold=threshold, **keywords,
    )  # fmt: skip
    return tuple(answer.tolist())


def _chain(record: BodyRecord, links: tuple[int, ...]) -> ChainArrays:
    """Return the body as a kinematic chain with these tips; cached."""
    found = record.chains.get(links)
    if found is None:
        for joint, name, kind, *_ in record.infos:
            if POSITION_COUNT[kind] > 1:  # PyBullet writes beyond its memory then
                raise failure(
                    _FAILED,
                    f"joint {joint} ({name.decode(errors='replace')}) has several degrees of freedom; "
                    "inverse kinematics moves revolute and prismatic joints only",
                )
        from roboyard.kinematics import from_description

        names = [record.model.links[link + 1].name for link in links]
        found = from_description(record.model.description, names, whole_tree=True)
        record.chains[links] = found
    return found


def _start(record: BodyRecord, current: Vector | None) -> Array:
    places = record.chain_places
    if places is None:
        places = np.array([i for joint in record.movable() for i in _places(record, joint)], dtype=np.intp)
        record.chain_places = places
    if current is None:
        return record.qpos.take(places)
    if hasattr(current, "__len__") and not len(current):
        return record.qpos.take(places)
    return np.array(floats(current, len(places), _WRONG_CURRENT))


def _places(record: BodyRecord, joint: int) -> range:
    place = record.positions_of(joint)
    return range(place.start, place.stop)


def _of_link(
    record: BodyRecord, link: int, position: Vector, orientation: Vector | None
) -> tuple[Vector, Vector | None]:
    """Return the target of a link's frame; PyBullet's has its origin, but the inertial frame's axes."""
    turn = record.links[link + 1].frame.quaternion
    if orientation is None or turn == (0.0, 0.0, 0.0, 1.0):
        return position, orientation
    return position, multiply(np.asarray(orientation, dtype=float), conjugate(turn)).tolist()


def _from_inertial(record: BodyRecord, position: Vector, orientation: Vector | None) -> list[float]:
    """Return a target in the base link frame, given in the base's inertial frame.

    PyBullet takes it so where the current joint positions are given.
    """
    frame = record.links[0].frame
    moved = (rotate(frame.quaternion, np.asarray(position, dtype=float)) + frame.position).tolist()
    if orientation is None:
        return moved
    return [*moved, *multiply(frame.quaternion, normalized(orientation)).tolist()]


def _in_base(record: BodyRecord, position: Vector, orientation: Vector | None) -> list[float]:
    """Return a target in the base link frame: 3 numbers, or 7 with an orientation."""
    if record.fixed_poses is None and record.free is None:
        base_inertial_pose(record)  # keeps both poses of a base that stays
    (x, y, z), (i, j, k, w) = record.base_pose()
    dx, dy, dz = position[0] - x, position[1] - y, position[2] - z
    # q* v q = v - w t + q x t, with t = 2 q x v
    tx, ty, tz = 2.0 * (j * dz - k * dy), 2.0 * (k * dx - i * dz), 2.0 * (i * dy - j * dx)
    moved = [
        dx - w * tx + j * tz - k * ty,
        dy - w * ty + k * tx - i * tz,
        dz - w * tz + i * ty - j * tx,
    ]
    if orientation is None:
        return moved
    a, b, c, d = orientation
    length = sqrt(a * a + b * b + c * c + d * d) or 1.0
    a, b, c, d = a / length, b / length, c / length, d / length
    return [
        *moved,
        w * a - i * d - j * c + k * b,
        w * b - j * d - k * a + i * c,
        w * c - k * d - i * b + j * a,
        w * d + i * a + j * b + k * c,
    ]


def _complete(values: Vector | None, count: int) -> Array | None:
    """Return (n,) values, or None for another length, which PyBullet ignores."""
    if values is None or len(values) != count:
        return None
    return np.array(floats(values, count, _FAILED))
