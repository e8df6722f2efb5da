"""Building the World's constraint for what a script asked for."""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt
from typing import TYPE_CHECKING

from roboyard.errors import RoboyardError
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.state.constraint_records import IDENTITY, WORLD, ConstraintRecord
from roboyard.pybullet.state.frames import rotated
from roboyard.transforms import multiply

if TYPE_CHECKING:
    from roboyard.description.model import Pose
    from roboyard.pybullet.face.arguments import Quaternion, Vector3
    from roboyard.pybullet.state.constraint_records import ConstraintRequest, ConstraintScene
    from roboyard.sim.joint import Joint
    from roboyard.sim.link import Link


def requested_constraint(scene: ConstraintScene, number: int, request: ConstraintRequest) -> ConstraintRecord:
    """Return the record, with the World's constraint, of a request."""
    parent, link, child, child_link, kind, axis, position, child_position, turn, child_turn, *rest = request
    max_force, ratio, _, target, erp, bound = rest
    record = ConstraintRecord(
        number=number,
        parent=(parent, link),
        child=(child, child_link),
        kind=kind,
        axis=axis,
        parent_position=position,
        parent_orientation=turn,
        child_position=child_position,
        child_orientation=child_turn,
        max_force=max_force,
        bound=bound,
        gear_ratio=ratio,
        relative_position_target=target,
        erp=erp,
    )
    build(scene, record)
    return record


def unit(orientation: Quaternion) -> Quaternion:
    """Return a quaternion (4,) of length 1; the identity for zeros."""
    x, y, z, w = orientation
    length = sqrt(x * x + y * y + z * z + w * w)
    if length == 1.0:
        return orientation
    if length == 0.0:
        return IDENTITY
    return x / length, y / length, z / length, w / length


def build(scene: ConstraintScene, record: ConstraintRecord) -> None:
    """Build, or rebuild, the World's constraint of a record.

    Raises:
        RoboyardError: a link or joint does not exist, or the type is not supported.
    """
    constraints = scene.world.constraints
    remove(scene, record)
    bound = record.max_force
    if not record.is_bounded:  # Bullet takes the number as the impulse of a step then
        bound /= scene.world.timestep
    if record.kind == c.JOINT_GEAR:
        aux_link, ratio = record.gear_aux_link, record.gear_ratio or 1.0
        aux = None if aux_link is None else _joint(scene, (record.parent[0], aux_link))
        record.made = constraints.add_gear(
            _joint(scene, record.parent),
            _joint(scene, record.child),
            ratio,
            against=aux,
            max_force=bound,
        )
        record.made.share = record.erp
        if record.erp != 0.0:
            constraints.set_gear(record.made, ratio, record.relative_position_target)
        return
    link_a = _link(scene, record.parent)
    link_b = None if record.child[0] == WORLD else _link(scene, record.child)
    position_a, orientation_a = parent_frame(scene, record)
    position_b, orientation_b = child_frame(scene, record)
    if record.kind == c.JOINT_POINT2POINT:
        record.made = constraints.add_point(
            link_a, link_b, position_a=position_a, position_b=position_b, max_force=bound
        )
    elif record.kind == c.JOINT_FIXED:
        record.made = constraints.add_weld(
            link_a,
            link_b,
            position_a=position_a,
            orientation_a=orientation_a,
            position_b=position_b,
            orientation_b=orientation_b,
            max_force=bound,
        )
    elif record.kind == c.JOINT_PRISMATIC:
        record.made = constraints.add_slide(
            link_a,
            link_b,
            record.axis,
            position_a=position_a,
            orientation_a=orientation_a,
            position_b=position_b,
            orientation_b=orientation_b,
            max_force=bound,
        )
    else:
        raise RoboyardError(
            f"joint type {record.kind} is not supported in constraints; use JOINT_FIXED, JOINT_POINT2POINT, "
            "JOINT_PRISMATIC or JOINT_GEAR"
        )


def regear(scene: ConstraintScene, record: ConstraintRecord) -> bool:
    """Give the World's gear of two joints the properties of its record; return whether it is one."""
    made = record.made
    if made is None or made.tendon is not None or record.gear_aux_link is not None:
        return False
    constraints = scene.world.constraints
    ends = _joint(scene, record.parent), _joint(scene, record.child)
    target = record.relative_position_target if record.erp != 0.0 else None
    constraints.change_gear(made, ends, record.gear_ratio or 1.0, target=target, share=record.erp)
    if not record.is_bounded:
        constraints.set_max_force(made, record.max_force / scene.world.timestep)
    return True


def bound_again(scene: ConstraintScene, records: Iterable[ConstraintRecord]) -> None:
    """Bound constraints whose largest force the script has not set, after the time step has changed."""
    for record in records:
        if record.made is not None and not record.is_bounded:
            scene.world.constraints.set_max_force(record.made, record.max_force / scene.world.timestep)


def remove(scene: ConstraintScene, record: ConstraintRecord) -> None:
    """Remove the World's constraint, if it exists."""
    if record.anchor is not None:
        soft, anchor = record.anchor
        record.anchor = None
        soft.release(anchor)
    made, record.made = record.made, None
    if made is not None:
        for kind in ("constraints", "pivots"):
            scene.world.prepared.get(kind, {}).pop(record.number, None)
        scene.world.constraints.remove(made)


def parent_frame(scene: ConstraintScene, record: ConstraintRecord) -> tuple[Vector3, Quaternion]:
    """Return the (3,) position (m) and (4,) orientation of the joint in the parent's link frame."""
    return _in_link_frame(scene, record.parent, record.parent_position, unit(record.parent_orientation))


def child_frame(scene: ConstraintScene, record: ConstraintRecord) -> tuple[Vector3, Quaternion]:
    """Return the (3,) position (m) and (4,) orientation in the child's link frame or the world."""
    return _in_link_frame(scene, record.child, record.child_position, unit(record.child_orientation))


def place_in_child(scene: ConstraintScene, record: ConstraintRecord, position: Vector3) -> Vector3:
    """Return the (3,) place (m) in the child's link frame, or the world, of one in its inertial frame."""
    return _in_link_frame(scene, record.child, position, unit(record.child_orientation))[0]


def _in_link_frame(
    scene: ConstraintScene, place: tuple[int, int], position: Vector3, orientation: Quaternion
) -> tuple[Vector3, Quaternion]:
    if place[0] == WORLD:
        return position, orientation
    frame: Pose = scene.bodies[place[0]].links[place[1] + 1].frame
    if frame.position == (0.0, 0.0, 0.0) and frame.quaternion == (0.0, 0.0, 0.0, 1.0):
        return position, orientation
    (x, y, z), (a, b, c) = frame.position, rotated(frame.quaternion, position)
    i, j, k, w = multiply(frame.quaternion, orientation).tolist()
    return (x + a, y + b, z + c), (i, j, k, w)


def _link(scene: ConstraintScene, place: tuple[int, int]) -> Link:
    found = scene.link(*place)
    if found is None:
        raise RoboyardError(f"there is no body {place[0]} with a link {place[1]}")
    return found


def _joint(scene: ConstraintScene, place: tuple[int, int]) -> Joint:
    record = scene.bodies.get(place[0])
    if record is None or not 0 <= place[1] < record.joint_count:
        raise RoboyardError(f"there is no body {place[0]} with a joint {place[1]}; gears couple joints")
    return record.body.joints[place[1]]
