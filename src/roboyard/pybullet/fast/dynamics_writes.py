"""Writes by which machine code changes the dynamics of links, as changeDynamics does.

See `properties.writes`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.mass_properties import MIN_INERTIA
from roboyard.pybullet.bullet_rules.models import LEAST_MOMENT, never_turns
from roboyard.pybullet.fast.fast_commands import forget_write, is_changed_again, prepare_write
from roboyard.pybullet.state.bodies.body_records import MULTIBODY
from roboyard.sim.build.planned import PlannedBody

if TYPE_CHECKING:
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.sim.engine import Engine
    from roboyard.transforms import Array

COMMAND, KIND = "changeDynamics", "dynamics"
_FRICTIONS = {"lateralFriction": "friction", "spinningFriction": "spinning_friction"} | {
    "rollingFriction": "rolling_friction"
}
_FRICTION_SIZES = {"lateralFriction": 1, "spinningFriction": 4, "rollingFriction": 6}
"""Least dimensions of MuJoCo's contacts in which such a friction acts."""


def forget_body(record: BodyRecord) -> None:
    """Let the Python functions change the dynamics of a body until they prepare it again."""
    record.body.world.prepared.get(KIND, {}).pop(record.number, None)


def prepare_equal(
    record: BodyRecord, link: int, argument: str, owner: Any, name: str, second: str = ""
) -> None:
    """Let machine code know a value that is given a second time and changes nothing.

    Args:
        record: of the body.
        link: of the body, -1 for the base.
        argument: of changeDynamics.
        owner: has the value.
        name: its attribute.
        second: attribute with the value of the next argument, where they are a pair.
    """
    if _is_due(record, link, argument):
        from roboyard.pybullet.fast.properties.writes import Write

        other = owner if second else None
        _prepare(record, link, argument, Write(owner, name, other=other, other_name=second))


def prepare_mass(record: BodyRecord, link: int) -> None:
    """Let machine code change the mass of a link whose moments are those of its shapes; they grow with it."""
    numbers, state = _mass_numbers(record, link, "mass"), record.links[link + 1]
    mass, moments = state.mass, state.moments
    least = 2.0 * max(MIN_INERTIA, LEAST_MOMENT) * mass / max(min(moments), 1e-300)
    if numbers is None or state.solid_mass != mass or not mass > least:
        return
    from roboyard.pybullet.fast.properties.writes import Write

    world, factors = record.body.world, np.zeros((4, 4))
    factors[:, 0] = 1.0, *(moment / mass for moment in moments)
    targets: tuple[Any, ...] = (numbers,)
    if not world.is_stale:
        model, row = world.live_model, record.body.mujoco_ids[link + 1]
        targets = numbers, model.body_mass[row : row + 1], model.body_inertia[row]
    write = Write(
        owner=state,
        name="solid_mass",
        factors=factors,
        targets=targets,
        places=(np.arange(4), np.array([0]), np.array([1, 2, 3])),
        least=least,
        other=state,
        other_name="moments",
        marked=world,
        marks=_marks(world),
        late=world.late_numbers,
        key=record.body.links[link + 1].keep_mass,
        worth=numbers,
        also=(state, "mass"),
    )
    _prepare(record, link, "mass", write)


def prepare_inertia(record: BodyRecord, link: int) -> None:
    """Let machine code change the moments of a link that a script gives."""
    numbers, state = _mass_numbers(record, link, "localInertiaDiagonal"), record.links[link + 1]
    if numbers is None or record.held:
        return
    from roboyard.pybullet.fast.properties.writes import Write

    world = record.body.world
    targets: tuple[Any, ...] = (numbers[1:],)
    if not world.is_stale:
        targets = *targets, world.live_model.body_inertia[record.body.mujoco_ids[link + 1]]
    write = Write(
        owner=state,
        name="moments",
        factors=np.eye(3, 4),
        targets=targets,
        places=(np.arange(3),) * len(targets),
        marked=world,
        marks=_marks(world),
        late=world.late_numbers,
        key=record.body.links[link + 1].keep_mass,
        worth=numbers,
        also=(state, "solid_mass"),
        is_inertia=True,
    )
    _prepare(record, link, "localInertiaDiagonal", write)


def _mass_numbers(record: BodyRecord, link: int, argument: str) -> Array | None:
    """Return (4,) mass (kg) and moments (kg m²) of a link, which all writes of it share.

    None where machine code is not to change the argument now: then it no longer does.
    """
    world, state = record.body.world, record.links[link + 1]
    known: Any = world.prepared.get(KIND)
    key, values = ("masses", record.number, link), (state.mass, *state.moments)
    if known is None:
        return None
    numbers = known.get(key)
    if numbers is not None:
        numbers[:] = values
    if not _is_due(record, link, argument):
        return None
    forget_write(COMMAND, argument, world.prepared, KIND, (record.number, link))
    if state.mass <= 0.0 or (link < 0 and record.model.fixed_base):
        return None
    present = record.body.links[link + 1]._built.mass
    if present is None or (present.mass, *present.principal.tolist()) != values:
        return None  # the World has other numbers
    if numbers is None:
        numbers = known[key] = np.array(values)
    return numbers


def _marks(world: Engine[Any]) -> tuple[str, ...]:
    return () if world.is_stale else ("_inertia_changed", "is_moved", "_velocity_moved")


def prepare_friction(record: BodyRecord, link: int, argument: str) -> None:
    """Let machine code change one of the frictions of a link, after it was changed.

    A friction that acts in more dimensions than the contacts of the link have now is not prepared.
    """
    world, state, handle = record.body.world, record.links[link + 1], record.body.links[link + 1]
    known: Any = world.prepared.get(KIND)
    if known is None:
        return
    values = state.friction, state.spinning_friction, state.rolling_friction
    key = "frictions", record.number, link
    numbers = known.get(key)
    if numbers is not None:
        numbers[:] = values
    if not _is_due(record, link, argument):
        return
    is_planned = type(record.body.form) is PlannedBody
    if is_planned and argument != "lateralFriction":
        return
    if not is_planned and any(geom.condim < _FRICTION_SIZES[argument] for geom in handle._built.geoms):
        return
    if numbers is None:
        numbers = known[key] = np.array(values)
    from roboyard.pybullet.fast.properties.writes import Write

    place = [*_FRICTIONS].index(argument)
    frictions = [] if world.is_stale else [world.live_model.geom_friction[row] for row in handle.geom_ids]
    targets = tuple(row[place : place + 1] for row in (numbers, *frictions))
    write = Write(
        owner=state,
        name=_FRICTIONS[argument],
        factors=np.array([[1.0, 0.0, 0.0, 0.0]]),
        targets=targets,
        places=(np.array([0]),) * len(targets),
        late=world.late_numbers,
        key=handle.keep_friction,
        worth=numbers,
    )
    _prepare(record, link, argument, write)


def prepare_restitution(record: BodyRecord, link: int) -> None:
    """Let machine code change the restitution of a link."""
    if not _is_due(record, link, "restitution"):
        return
    targets = record.body.world.surfaces.restitution_places(record.body.links[link + 1])
    if targets is not None:
        from roboyard.pybullet.fast.properties.writes import Write

        places = (np.array([0]),) * len(targets)
        factors, state = np.array([[1.0, 0.0, 0.0, 0.0]]), record.links[link + 1]
        _prepare(
            record,
            link,
            "restitution",
            Write(state, "restitution", factors, tuple(targets), places, most=1.0),
        )


def prepare_anchor(record: BodyRecord, link: int) -> None:
    """Note where it is written whether friction anchors a link: its state, and what the World has.

    Between them is a function that lets the World compile, None where it has compiled.
    """
    known: Any = record.body.world.prepared.get(KIND)
    if known is not None:
        world = record.body.world
        places = world.surfaces.anchor_places(record.body.links[link + 1])
        note = world.takes_numbers if world.is_stale else None
        known["anchor", record.number, link] = record.links[link + 1], world.surfaces, note, *places


def prepare_compliance(record: BodyRecord, link: int) -> None:
    """Let machine code change contact stiffness and damping of a link."""
    if not _is_due(record, link, "contactStiffness"):
        return
    targets = record.body.world.surfaces.compliance_places(record.body.links[link + 1])
    if targets is not None:
        from roboyard.pybullet.fast.properties.writes import Write

        factors, state = np.eye(4)[:2], record.links[link + 1]
        write = Write(
            owner=state,
            name="contact_stiffness",
            factors=np.ascontiguousarray(factors),
            targets=tuple(targets),
            places=(np.array([0, 1]),) * len(targets),
            other=state,
            other_name="contact_damping",
        )
        _prepare(record, link, "contactStiffness", write)


def prepare_damping(record: BodyRecord, link: int, argument: str) -> None:
    """Let machine code change the linear or angular damping of a body's links."""
    if not _is_due(record, link, argument):
        return
    is_linear = argument == "linearDamping"
    name = "linear_damping" if is_linear else "angular_damping"
    is_still = record.kind != MULTIBODY or (
        not is_linear and len(record.links) == 1 and never_turns(record.links[0].moments)
    )
    targets: list[Any] = []
    for handle, state in zip(record.body.links, record.links, strict=True):
        if state.mass > 0.0 and not is_still:
            places = record.body.world.surfaces.damping_places(handle)
            if places is None:
                return
            targets += [values[:2] if is_linear else values[2:] for values in places]
    from roboyard.pybullet.fast.properties.writes import Write

    factors = np.array([[1.0, 0.0, 0.0, 0.0]])
    both = (np.array([0, 0]),) * len(targets)
    _prepare(record, link, argument, Write(record, name, factors, tuple(targets), both))


def prepare_joint_damping(record: BodyRecord, joint: int) -> None:
    """Let machine code change the damping of a joint."""
    handle, state, world = record.body.joints[joint], record.links[joint + 1], record.body.world
    targets = handle.damping_places() if _is_due(record, joint, "jointDamping") else None
    if targets is not None:
        from roboyard.pybullet.fast.properties.writes import Write

        numbers = np.array([state.joint_damping])
        write = Write(
            owner=state,
            name="joint_damping",
            factors=np.array([[1.0, 0.0, 0.0, 0.0]]),
            targets=(numbers, *targets),
            places=(np.array([0]), *(np.zeros(len(target), np.int64) for target in targets)),
            late=world.late_numbers,
            key=handle.keep_damping,
            worth=numbers,
        )
        _prepare(record, joint, "jointDamping", write)


def prepare_limits(record: BodyRecord, joint: int) -> None:
    """Let machine code change the limits of a joint that has some."""
    handle, state, world = record.body.joints[joint], record.links[joint + 1], record.body.world
    targets = handle.limit_places() if _is_due(record, joint, "jointLowerLimit") else None
    if targets is not None:
        from roboyard.pybullet.fast.properties.writes import Write

        numbers = np.array([state.lower_limit, state.upper_limit])
        write = Write(
            owner=state,
            name="lower_limit",
            factors=np.eye(2, 4),
            targets=(numbers, *targets),
            places=(np.array([0, 1]),) * (1 + len(targets)),
            other=state,
            other_name="upper_limit",
            rises=True,
            late=world.late_numbers,
            key=handle.keep_limits,
            worth=numbers,
        )
        _prepare(record, joint, "jointLowerLimit", write)


def _is_due(record: BodyRecord, link: int, argument: str) -> bool:
    places = record.number, link
    return is_changed_again(COMMAND, argument, record.body.world.prepared, KIND, places)


def _prepare(record: BodyRecord, link: int, argument: str, write: Any) -> None:
    prepare_write(COMMAND, argument, record.body.world.prepared, KIND, (record.number, link), write)
