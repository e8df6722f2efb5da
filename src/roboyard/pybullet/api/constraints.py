"""Constraints between bodies: welds, ball joints, slides and gears."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import TYPE_CHECKING, Any

from roboyard.errors import RoboyardError
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import Quaternion, number, quaternion, vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.constraint_building import build, child_frame, remove
from roboyard.pybullet.state.constraint_records import ConstraintRecord

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

Vector = Sequence[float]
_FAILED = "createConstraint failed."
_IDENTITY = (0.0, 0.0, 0.0, 1.0)
_UNSET_FORCE = -1.0
_ROWS = {c.JOINT_FIXED: 6, c.JOINT_PRISMATIC: 5, c.JOINT_POINT2POINT: 3, c.JOINT_GEAR: 1}
_FREE_ROW = 2
"""Of a slide: the row along its axis, which Bullet does not have."""


@command()
def createConstraint(
    client: Client,
    parentBodyUniqueId: int,
    parentLinkIndex: int,
    childBodyUniqueId: int,
    childLinkIndex: int,
    jointType: int,
    jointAxis: Vector,
    parentFramePosition: Vector,
    childFramePosition: Vector,
    parentFrameOrientation: Vector | None = None,
    childFrameOrientation: Vector | None = None,
) -> int:
    """Hold two links together and give the constraint's id.

    Args:
        parentBodyUniqueId: first body.
        parentLinkIndex: its link; -1 for the base.
        childBodyUniqueId: second body; -1 for the world.
        childLinkIndex: its link.
        jointType: JOINT_FIXED, JOINT_POINT2POINT, JOINT_PRISMATIC or JOINT_GEAR (which couples the joints of
            the two links).
        jointAxis: line along which the child slides (JOINT_PRISMATIC), in the parent's frame.
        parentFramePosition: of the joint in the parent's inertial frame; m.
        childFramePosition: of the joint in the child's inertial frame, or in the world; m.
        parentFrameOrientation: x, y, z, w.
        childFrameOrientation: x, y, z, w.
    """
    scene = client.scene
    record = ConstraintRecord(
        number=0,
        parent=(whole(parentBodyUniqueId), whole(parentLinkIndex)),
        child=(whole(childBodyUniqueId), whole(childLinkIndex)),
        kind=whole(jointType),
        axis=vector3(jointAxis, _FAILED),
        parent_position=vector3(parentFramePosition, _FAILED),
        parent_orientation=_unit(parentFrameOrientation),
        child_position=vector3(childFramePosition, _FAILED),
        child_orientation=_unit(childFrameOrientation),
    )
    try:
        build(scene, record)
    except RoboyardError as problem:
        raise failure(_FAILED, *str(problem).splitlines()) from problem
    record.number = scene.constraint_ids.take()
    scene.constraints[record.number] = record
    scene.mark_moved()
    return record.number


@command()
def changeConstraint(
    client: Client,
    userConstraintUniqueId: int,
    jointChildPivot: Vector | None = None,
    jointChildFrameOrientation: Vector | None = None,
    maxForce: float = _UNSET_FORCE,
    gearRatio: float = 0.0,
    gearAuxLink: int = -1,
    relativePositionTarget: float = 1e32,
    erp: float = -1.0,
) -> None:
    """Change what is given; an unknown id is no error.

    Args:
        userConstraintUniqueId: id from createConstraint.
        jointChildPivot: the joint's place in the child's inertial frame, or in the world; m.
        jointChildFrameOrientation: x, y, z, w.
        maxForce: N or N m, on each direction.
        gearRatio: of a gear: v_parent + ratio v_child = 0.
        gearAuxLink: of a gear: a third joint of the parent, whose velocity replaces the 0.
        relativePositionTarget: of a gear: q_parent + ratio q_child, kept where erp is above 0.
        erp: of a gear: how hard positions are held, 0 to 1.
    """
    scene = client.scene
    record: ConstraintRecord | None = scene.constraints.get(whole(userConstraintUniqueId))
    if record is None or record.made is None:
        return
    constraints = scene.world.constraints
    if jointChildPivot is not None:
        record.child_position = vector3(jointChildPivot, "changeConstraint failed.")
    if jointChildFrameOrientation is not None:
        record.child_orientation = _unit(jointChildFrameOrientation)
    if number(maxForce) >= 0.0:
        record.max_force = float(maxForce)
        constraints.set_max_force(record.made, maxForce)
    _change_gear(client, record, gearRatio, gearAuxLink, relativePositionTarget, erp)
    if record.kind != c.JOINT_GEAR and (
        jointChildPivot is not None or jointChildFrameOrientation is not None
    ):
        constraints.set_frame(record.made, "b", *child_frame(scene, record))


def _change_gear(
    client: Client, record: ConstraintRecord, ratio: float, aux_link: int, target: float, erp: float
) -> None:
    """Take over what is given; constraints of other kinds only tell it again."""
    old = (record.gear_ratio, record.gear_aux_link, record.relative_position_target, record.erp)
    if number(ratio) != 0.0:
        record.gear_ratio = float(ratio)
    if whole(aux_link) >= 0:
        record.gear_aux_link = aux_link
    if number(target) < 1e32:
        record.relative_position_target = float(target)
    if number(erp) >= 0.0:
        record.erp = float(erp)
    now = (record.gear_ratio, record.gear_aux_link, record.relative_position_target, record.erp)
    if now == old or record.kind != c.JOINT_GEAR:
        return
    try:
        build(client.scene, record)
    except RoboyardError as problem:
        raise failure("changeConstraint failed.", *str(problem).splitlines()) from problem


@command()
def removeConstraint(client: Client, userConstraintUniqueId: int) -> None:
    """Let go; an unknown id is no error."""
    record = client.scene.constraints.pop(whole(userConstraintUniqueId), None)
    if record is not None:
        remove(client.scene, record)


@command()
def getNumConstraints(client: Client) -> int:
    """How many constraints there are."""
    return len(client.scene.constraints)


@command()
def getConstraintUniqueId(client: Client, serialIndex: int) -> int:
    """Id of the i-th constraint, -1 past the last."""
    ids = list(client.scene.constraints)
    return ids[serialIndex] if 0 <= whole(serialIndex) < len(ids) else -1


@command()
def getConstraintInfo(client: Client, constraintUniqueId: int) -> tuple[Any, ...]:
    """What a constraint holds.

    Returns:
        parent body, parent link, child body, child link, type, axis, position in the parent, position in the
        child, orientation in the parent, orientation in the child, greatest force, gear ratio, third link of
        a gear, relative position target, erp.
    """
    record = client.scene.constraints.get(whole(constraintUniqueId))
    if record is None:
        raise failure("Couldn't get user constraint info", _unknown(client, constraintUniqueId))
    return (
        *(*record.parent, *record.child, record.kind, record.axis),
        *(record.parent_position, record.child_position),
        *(record.parent_orientation, record.child_orientation),
        *(record.max_force, record.gear_ratio, record.gear_aux_link or 0),
        *(record.relative_position_target, record.erp),
    )


@command()
def getConstraintState(client: Client, constraintUniqueId: int) -> tuple[float, ...]:
    """Forces that a constraint applied in the last step: N, then N m; zeros before the first step.

    They act on the parent, except for those of a point, which act on the child.
    """
    scene = client.scene
    record = scene.constraints.get(whole(constraintUniqueId))
    if record is None or record.made is None:
        raise failure("Couldn't getConstraintState.", _unknown(client, constraintUniqueId))
    world = scene.world
    world.ensure_compiled()
    forces = world.constraints.applied(record.made).tolist()
    if not forces:
        return (0.0,) * _ROWS[record.kind]
    if record.kind == c.JOINT_PRISMATIC:
        del forces[_FREE_ROW]
    sign = -1.0 if record.kind == c.JOINT_POINT2POINT else 1.0
    return tuple(sign * force + 0.0 for force in forces)


def _unknown(client: Client, given: int) -> str:
    there = ", ".join(map(str, client.scene.constraints)) or "none"
    return f"there is no constraint {given}; constraints: {there}"


def _unit(orientation: Vector | None) -> Quaternion:
    if orientation is None:
        return _IDENTITY
    x, y, z, w = quaternion(orientation, _FAILED)
    length = sqrt(x * x + y * y + z * z + w * w)
    if length == 0.0:
        return _IDENTITY
    return x / length, y / length, z / length, w / length
