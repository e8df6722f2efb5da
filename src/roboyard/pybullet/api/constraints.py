"""Constraints between bodies: fixed, point-to-point, prismatic and gear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.native import loaded
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import (
    Quaternion,
    Vector3,
    check_finite,
    number,
    quaternion_or,
    vector3_or,
    whole,
)
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.constraints.writes import (
    prepare_bound,
    prepare_gear,
    prepare_pivot,
    prepare_turn,
)
from roboyard.pybullet.fast.fast_commands import (
    is_machine_code,
    replace_constraint_reads,
    replace_constraints,
    replace_properties,
)
from roboyard.pybullet.fast.pairs import SIGNED
from roboyard.pybullet.state.constraint_building import (
    build,
    child_frame,
    regear,
    remove,
)
from roboyard.pybullet.state.constraint_records import (
    BOUND,
    CHILD_POSITION,
    CHILD_TURN,
    GEAR_ERP,
    GEAR_RATIO,
    GEAR_TARGET,
    IDENTITY,
    MAX_FORCE,
    NO_EFFORTS,
    ROWS,
    ConstraintRecord,
)
from roboyard.pybullet.state.ids import drop_from_order

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.sim.world import World

Vector = Sequence[float]
_FAILED = "createConstraint failed."
_ZERO = (0.0, 0.0, 0.0)
_UNSET_FORCE = -1.0
_NO_RATIO, _NO_LINK, _NO_TARGET = 0.0, -1, 1e32


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
    """Create a constraint between two links, or a link and the world, and return its id.

    Args:
        parentBodyUniqueId: first body.
        parentLinkIndex: link of the first body; -1 for the base.
        childBodyUniqueId: second body; -1 for the world.
        childLinkIndex: link of the second body.
        jointType: JOINT_FIXED, JOINT_POINT2POINT, JOINT_PRISMATIC or JOINT_GEAR (which couples the joints of
            the two links).
        jointAxis: axis along which the child slides (JOINT_PRISMATIC), in the parent's frame.
        parentFramePosition: joint position in the parent's inertial frame (m).
        childFramePosition: joint position in the child's inertial frame, or in the world (m).
        parentFrameOrientation: joint orientation in the parent (x, y, z, w); None for the identity.
        childFrameOrientation: joint orientation in the child (x, y, z, w); None for the identity.

    Raises:
        error: a body, link or joint does not exist, or the type is not supported.
    """
    scene = client.scene
    record = ConstraintRecord(
        number=0,
        parent=(whole(parentBodyUniqueId), whole(parentLinkIndex)),
        child=(whole(childBodyUniqueId), whole(childLinkIndex)),
        kind=whole(jointType),
        axis=vector3_or(jointAxis, _ZERO),
        parent_position=vector3_or(parentFramePosition, _ZERO),
        parent_orientation=_turn(parentFrameOrientation),
        child_position=vector3_or(childFramePosition, _ZERO),
        child_orientation=_turn(childFrameOrientation),
    )
    check_finite(
        _FAILED,
        jointAxis=record.axis,
        parentFramePosition=record.parent_position,
        childFramePosition=record.child_position,
    )
    scene.build_requested()  # which come before it in the order of solution
    try:
        build(scene, record)
    except RoboyardError as problem:
        raise failure(_FAILED, *str(problem).splitlines()) from problem
    record.number = scene.constraint_ids.take()
    scene.constraints[record.number] = record
    scene.constraint_order.append(record.number)
    scene.world.mark_moved()
    return record.number


@command()
def changeConstraint(
    client: Client,
    userConstraintUniqueId: int,
    jointChildPivot: Vector | None = None,
    jointChildFrameOrientation: Vector | None = None,
    maxForce: float = _UNSET_FORCE,
    gearRatio: float = _NO_RATIO,
    gearAuxLink: int = _NO_LINK,
    relativePositionTarget: float = _NO_TARGET,
    erp: float = _UNSET_FORCE,
) -> None:
    """Change the properties that are given; an unknown id is ignored.

    Args:
        userConstraintUniqueId: id from createConstraint.
        jointChildPivot: joint position in the child's inertial frame, or in the world (m).
        jointChildFrameOrientation: joint orientation in the child (x, y, z, w).
        maxForce: largest force (N) or torque (N m) in each direction.
        gearRatio: ratio of a gear: v_parent + ratio v_child = 0.
        gearAuxLink: third joint of the parent of a gear, whose velocity replaces the 0.
        relativePositionTarget: q_parent + ratio q_child of a gear, held if erp is above 0.
        erp: share of the position error of a gear corrected in a step (0 to 1).

    Raises:
        error: a vector has the wrong length, or the third joint of a gear does not exist.
    """
    scene = client.scene
    record: ConstraintRecord | None = scene.constraints.get(whole(userConstraintUniqueId))
    if record is None or record.made is None:
        return
    old_position, old_orientation = record.child_position, record.child_orientation
    if jointChildPivot is not None:
        x, y, z = pivot = vector3_or(jointChildPivot, old_position)
        total = x + y + z
        if total - total != 0.0:
            check_finite("changeConstraint failed.", jointChildPivot=pivot)
        record.child_position = pivot
    if jointChildFrameOrientation is not None:
        record.child_orientation = _turn(jointChildFrameOrientation, old_orientation)
    if (
        maxForce is not _UNSET_FORCE
        and number(maxForce) >= 0.0
        and not (record.is_bounded and maxForce == record.max_force)
    ):
        record.max_force = record.bound = float(maxForce)
        scene.world.constraints.set_max_force(record.made, maxForce)
    if not (
        gearRatio is _NO_RATIO
        and gearAuxLink is _NO_LINK
        and relativePositionTarget is _NO_TARGET
        and erp is _UNSET_FORCE
    ):
        _change_gear(client, record, gearRatio, gearAuxLink, relativePositionTarget, erp)
    if record.kind == c.JOINT_GEAR:
        return
    is_turned = record.child_orientation != old_orientation
    if is_turned or record.child_position != old_position:
        position, orientation = child_frame(scene, record)
        scene.world.constraints.set_frame(record.made, "b", position, orientation if is_turned else None)


def _change_gear(
    client: Client, record: ConstraintRecord, ratio: float, aux_link: int, target: float, erp: float
) -> None:
    """Apply the gear properties that are given; other constraints only store them."""
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
    if now == old:
        return
    if record.kind != c.JOINT_GEAR or regear(client.scene, record):
        prepare_gear(client.scene, record)
        return
    try:
        build(client.scene, record)
    except RoboyardError as problem:
        record.gear_ratio, record.gear_aux_link, record.relative_position_target, record.erp = old
        build(client.scene, record)
        raise failure("changeConstraint failed.", *str(problem).splitlines()) from problem


@command()
def removeConstraint(client: Client, userConstraintUniqueId: int) -> None:
    """Remove a constraint; an unknown id is ignored."""
    scene = client.scene
    record = scene.constraints.pop(whole(userConstraintUniqueId), None)
    if record is not None:
        drop_from_order(scene.constraint_order, record.number)
        remove(scene, record)


@command()
def getNumConstraints(client: Client) -> int:
    """Return the number of constraints."""
    return len(client.scene.constraint_order)


@command()
def getConstraintUniqueId(client: Client, serialIndex: int) -> int:
    """Return the id of the i-th constraint, or -1 beyond the last.

    As in PyBullet, the last constraint takes the place of one that is removed.
    """
    ids = client.scene.constraint_order
    return ids[serialIndex] if 0 <= whole(serialIndex) < len(ids) else -1


@command()
def getConstraintInfo(client: Client, constraintUniqueId: int) -> tuple[Any, ...]:
    """Return the properties of a constraint.

    Returns:
        Parent body, parent link, child body, child link, type, axis, position in the parent (m), position in
        the child (m), orientation in the parent, orientation in the child (x, y, z, w), largest force (N or
        N m), gear ratio, third link of a gear, relative position target, erp.

    Raises:
        error: the constraint does not exist.
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
    """Return the forces (N) and torques (N m) of a constraint in the last step; zeros before the first step.

    They act on the parent, except those of a point-to-point constraint, which act on the child. Those of a
    prismatic constraint are two forces across its axis and the torques about z, x and y.

    Raises:
        error: the constraint does not exist.
    """
    scene = client.scene
    record: ConstraintRecord | None = scene.constraints.get(whole(constraintUniqueId))
    if record is None or record.made is None:
        raise failure("Couldn't getConstraintState.", _unknown(client, constraintUniqueId))
    world, kind = scene.world, record.kind
    if world.is_stale:
        world.ensure_compiled()
    forces = world.constraints.rows.applied_numbers(record.made)
    if not forces:
        return NO_EFFORTS[kind]
    if is_machine_code("getConstraintState"):
        _prepare(world, record)
    if kind == c.JOINT_PRISMATIC:
        x, y, _, *turns = forces
        forces = [x, y, turns[2], *turns[:2]]
    if kind == c.JOINT_POINT2POINT:
        return tuple([0.0 - force for force in forces])
    return tuple([force + 0.0 for force in forces])


def _prepare(world: World, record: ConstraintRecord) -> None:
    """Let machine code read the efforts of a constraint."""
    from roboyard._mujoco import mujoco
    from roboyard.pybullet.bullet_rules.constraint_kernels import PLAIN, POINT, SLIDE, constraint_efforts
    from roboyard.sim.stepping.step_rows import StepRows, layout

    known, made = world.prepared.get("constraints"), record.made
    if known is None or record.number in known or made is None or layout() is None:
        return
    model = world.live_model
    rows = StepRows(world.live_data, model.nv, is_sparse=bool(mujoco.mj_isSparse(model)))
    rule = {c.JOINT_PRISMATIC: SLIDE, c.JOINT_POINT2POINT: POINT}.get(record.kind, PLAIN)
    out, loop = np.zeros(ROWS[record.kind]), loaded(constraint_efforts)
    blocks = rows.rows.ids, rows.rows.force
    arguments = *rows.search, *blocks, made.element.id, rule, out
    known[record.number] = loop, arguments, out, rows


def _unknown(client: Client, given: int) -> str:
    there = ", ".join(map(str, client.scene.constraints)) or "none"
    return f"there is no constraint {given}; constraints: {there}"


def _turn(orientation: Vector | None, default: Quaternion = IDENTITY) -> Quaternion:
    x, y, z, w = given = quaternion_or(orientation, default)
    length = sqrt(x * x + y * y + z * z + w * w)
    if length - length != 0.0:
        check_finite(_FAILED, orientation=given, length=length)
    return given


START.later(
    replace_constraint_reads,
    "getConstraintState",
    "getConstraintInfo",
    "getNumConstraints",
    "getConstraintUniqueId",
)
START.later(replace_constraints, "createConstraint", "removeConstraint")


def _move_child(client: Client, number: int, pivot: Vector3) -> None:
    scene = client.scene
    record: ConstraintRecord | None = scene.constraints.get(number)
    if record is not None and record.made is not None and pivot != record.child_position:
        record.child_position = pivot
        if record.kind != c.JOINT_GEAR:
            scene.world.constraints.set_frame(record.made, "b", child_frame(scene, record)[0])
            prepare_pivot(scene, record)


def _turn_child(client: Client, number: int, orientation: Quaternion) -> None:
    scene = client.scene
    record: ConstraintRecord | None = scene.constraints.get(number)
    if record is None or record.made is None or orientation == record.child_orientation:
        return
    record.child_orientation = _turn(orientation)
    if record.kind != c.JOINT_GEAR:
        scene.world.constraints.set_frame(record.made, "b", *child_frame(scene, record))
        prepare_turn(scene, record)


def _bound(client: Client, number: int, force: float) -> None:
    scene = client.scene
    record: ConstraintRecord | None = scene.constraints.get(number)
    if record is None or record.made is None or (record.is_bounded and force == record.max_force):
        return
    record.max_force = record.bound = float(force)
    scene.world.constraints.set_max_force(record.made, record.max_force)
    prepare_bound(scene, record)


def _change_gear_number(client: Client, number: int, value: float, *, name: str) -> None:
    """Apply one of the numbers of a gear."""
    scene = client.scene
    record: ConstraintRecord | None = scene.constraints.get(number)
    if record is None or record.made is None:
        return
    given: dict[str, Any] = {"ratio": _NO_RATIO, "aux_link": _NO_LINK, "target": _NO_TARGET}
    given |= {"erp": _UNSET_FORCE, name: value}
    _change_gear(client, record, **given)


CHANGES: Mapping[str, Any] = {
    "jointChildPivot": _move_child,
    "jointChildFrameOrientation": _turn_child,
    "maxForce": _bound,
    "gearRatio": partial(_change_gear_number, name="ratio"),
    "gearAuxLink": partial(_change_gear_number, name="aux_link"),
    "relativePositionTarget": partial(_change_gear_number, name="target"),
    "erp": partial(_change_gear_number, name="erp"),
}
"""Arguments of changeConstraint that change one property, to what does so where only such ones are given."""
LENGTHS = {"jointChildPivot": 3, "jointChildFrameOrientation": 4} | {
    "gearRatio": SIGNED,
    "relativePositionTarget": SIGNED,
}
"""Arguments that are several numbers, and how many, or any number."""
PRESENT = {
    "jointChildPivot": "child_position",
    "jointChildFrameOrientation": "child_orientation",
    "maxForce": "bound",
    "gearRatio": "gear_ratio",
    "gearAuxLink": "gear_aux_link",
    "relativePositionTarget": "relative_position_target",
    "erp": "erp",
}
"""Attribute of the record that is equal where an argument changes nothing."""
REQUESTED = {
    "jointChildPivot": (CHILD_POSITION,),
    "jointChildFrameOrientation": (CHILD_TURN,),
    "maxForce": (MAX_FORCE, BOUND),
    "gearRatio": (GEAR_RATIO,),
    "relativePositionTarget": (GEAR_TARGET,),
    "erp": (GEAR_ERP,),
}
"""Arguments to the fields of a request that they become."""


def replace_changes() -> None:
    """Let machine code change constraints."""
    replace_properties(
        "changeConstraint",
        CHANGES,
        LENGTHS,
        "_constraints",
        PRESENT,
        "pivots",
        requests=("requested", REQUESTED),
    )


START.later(replace_changes, "changeConstraint")
