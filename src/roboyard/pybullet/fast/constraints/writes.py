"""Writes by which machine code changes constraints, as changeConstraint does; see `properties.writes`."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.face import constants as c
from roboyard.pybullet.fast.fast_commands import is_changed_again, prepare_write
from roboyard.pybullet.state.constraint_building import child_frame, place_in_child, unit

if TYPE_CHECKING:
    from roboyard.pybullet.state.constraint_records import ConstraintRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene
    from roboyard.sim.world import World

COMMAND, KIND = "changeConstraint", "pivots"


def prepare_pivot(scene: PhysicsScene, record: ConstraintRecord) -> None:
    """Let machine code move the child's frame of a constraint."""
    world, made, places = scene.world, record.made, (record.number,)
    if made is None or (world.is_stale and made.element is not None):
        return
    if not is_changed_again(COMMAND, "jointChildPivot", world.prepared, KIND, places):
        return
    from roboyard.pybullet.fast.properties.writes import Write

    factors = np.zeros((3, 4))
    factors[:, 3] = start = place_in_child(scene, record, (0.0, 0.0, 0.0))
    for axis, unit_vector in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
        factors[:, axis] = np.subtract(place_in_child(scene, record, unit_vector), start)
    write = Write(
        owner=record,
        name="child_position",
        factors=factors,
        targets=() if world.is_stale else (world.live_model.site_pos[made.rows[1]],),
        places=(np.arange(3),),
        other=made,
        other_name="position_b",
        among=scene.constraints,
    )
    prepare_write(COMMAND, "jointChildPivot", world.prepared, KIND, places, write)


def prepare_turn(scene: PhysicsScene, record: ConstraintRecord) -> None:
    """Let machine code turn the child's frame of a constraint, where its inertial frame is not turned."""
    world, made, places = scene.world, record.made, (record.number,)
    if made is None or (world.is_stale and made.element is not None):
        return
    is_plain = child_frame(scene, record)[1] == unit(record.child_orientation)
    name = "jointChildFrameOrientation"
    if is_plain and is_changed_again(COMMAND, name, world.prepared, KIND, places):
        from roboyard.pybullet.fast.properties.writes import Write

        write = Write(
            owner=record,
            name="child_orientation",
            targets=() if world.is_stale else (world.live_model.site_quat[made.rows[1]],),
            other=made,
            other_name="orientation_b",
            turns=True,
            among=scene.constraints,
        )
        prepare_write(COMMAND, name, world.prepared, KIND, places, write)


def prepare_bound(scene: PhysicsScene, record: ConstraintRecord) -> None:
    """Let machine code change the largest force of a constraint."""
    world, made, places = scene.world, record.made, (record.number,)
    if not is_changed_again(COMMAND, "maxForce", world.prepared, KIND, places):
        return
    targets = None if made is None else world.constraints.rows.bound_places(made)
    if targets is not None:
        from roboyard.pybullet.fast.properties.writes import Write
        from roboyard.sim.constraints.rows import LARGEST_FORCE

        write = Write(
            owner=record,
            name="bound",
            factors=np.array([[1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0]]),
            targets=targets,
            places=(np.array([0]), np.array([0, 1])),
            most=LARGEST_FORCE,
            also=(record, "max_force", made, "max_force"),
            among=scene.constraints,
        )
        prepare_write(COMMAND, "maxForce", world.prepared, KIND, places, write)


def prepare_gear(scene: PhysicsScene, record: ConstraintRecord) -> None:
    """Let machine code change the numbers of a gear of two joints."""
    world, places = scene.world, (record.number,)
    for argument in ("gearRatio", "relativePositionTarget", "erp"):
        if not is_changed_again(COMMAND, argument, world.prepared, KIND, places):
            continue
        write = _gear_write(world, record, argument)
        prepare_write(COMMAND, argument, world.prepared, KIND, places, write)


def _gear_write(world: World, record: ConstraintRecord, argument: str) -> Any:
    """Return what an argument of a gear writes; None where the Python function has to change it."""
    from roboyard.pybullet.fast.properties.writes import Write

    made = record.made
    name, of_made = _GEAR_NAMES[argument]
    if record.kind != c.JOINT_GEAR:
        return Write(record, name, np.eye(1, 4), least=-inf)
    if made is None or made.tendon is not None or made.element is None or world.is_stale:
        return None
    data, target = world.live_model.eq_data[made.element.id], None
    is_held = record.erp != 0.0
    if argument == "gearRatio":
        target = data[1:2]
    elif argument == "erp":
        target = world.constraints.rows.share_place(made) if is_held else None
        if target is None:
            return None
    elif is_held:
        target = data[:1]
    return Write(
        owner=record,
        name=name,
        factors=np.array([[-1.0 if argument == "gearRatio" else 1.0, 0.0, 0.0, 0.0]]),
        targets=() if target is None else (target,),
        places=(np.array([0]),),
        least=0.0 if argument == "erp" else -inf,
        also=() if target is None else (made, of_made),
    )


_GEAR_NAMES = {
    "gearRatio": ("gear_ratio", "gear_ratio"),
    "relativePositionTarget": ("relative_position_target", "gear_offset"),
    "erp": ("erp", "share"),
}
"""Arguments of gears to the attributes of records and of the World's constraints."""
