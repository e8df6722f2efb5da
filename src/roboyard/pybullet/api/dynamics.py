"""Masses, inertias, friction and damping: getDynamicsInfo and changeDynamics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.mass_properties import MIN_INERTIA, link_masses, trace_mass
from roboyard.description.model import Inertial
from roboyard.pybullet.bullet_rules.models import IMMOVABLE_MASS, LEAST_MOMENT, never_turns, world_moments
from roboyard.pybullet.bullet_rules.shape_inertia import shape_moments
from roboyard.pybullet.face.arguments import check_finite, number, vector3_or, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import (
    forget_write,
    is_changed_again,
    prepare_write,
    replace_properties,
)
from roboyard.pybullet.state.body_records import RIGID_BODY, has_plane
from roboyard.sim.build.masses import LEAST_SHARE

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.body_records import BodyRecord, LinkState
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Vector = Sequence[float]
_KIND = "dynamics"
"""Of what is prepared for machine code."""


@command()
def getDynamicsInfo(client: Client, bodyUniqueId: int, linkIndex: int) -> tuple[Any, ...]:
    """Return the physical properties of a link (-1: the base); of a rigid body always those of the base.

    Returns:
        Mass (kg), lateral friction, inertia diagonal (kg m²), position (m) and quaternion of the inertial
        frame in the link frame, restitution, rolling friction, spinning friction, contact damping, contact
        stiffness (-1: not set), body type (2: multibody, 1: rigid body), collision margin (m).

    Raises:
        error: the body or link does not exist.
    """
    if whole(bodyUniqueId) < 0:
        raise failure(
            "getDynamicsInfo failed; invalid bodyUniqueId", f"body ids start at 0, got {bodyUniqueId}"
        )
    if whole(linkIndex) < -1:
        raise failure("getDynamicsInfo failed; invalid linkIndex", f"links start at -1, got {linkIndex}")
    record = client.scene.bodies.get(bodyUniqueId)
    if record is not None and record.kind == RIGID_BODY:
        linkIndex = -1
    if record is None or linkIndex >= record.joint_count:
        raise failure(
            "getDynamicsInfo failed; invalid return status",
            f"there is no body {bodyUniqueId} with a link {linkIndex}",
        )
    s = record.links[linkIndex + 1]
    return (
        *(s.mass, s.friction, s.moments, s.frame.position, s.frame.quaternion),
        *(s.restitution, s.rolling_friction, s.spinning_friction, s.contact_damping, s.contact_stiffness),
        *(record.kind, record.bounds(linkIndex)[1]),
    )


@command()
def changeDynamics(
    client: Client,
    bodyUniqueId: int,
    linkIndex: int,
    mass: float = -1.0,
    lateralFriction: float = -1.0,
    spinningFriction: float = -1.0,
    rollingFriction: float = -1.0,
    restitution: float = -1.0,
    linearDamping: float = -1.0,
    angularDamping: float = -1.0,
    contactStiffness: float = -1.0,
    contactDamping: float = -1.0,
    frictionAnchor: int = -1,
    localInertiaDiagonal: Vector | None = None,
    ccdSweptSphereRadius: float = -1.0,
    contactProcessingThreshold: float = -1.0,
    activationState: int = -1,
    jointDamping: float = -1.0,
    anisotropicFriction: Vector | None = None,
    maxJointVelocity: float = -1.0,
    collisionMargin: float = -1.0,
    jointLowerLimit: float = 1.0,
    jointUpperLimit: float = -1.0,
    jointLimitForce: float = -1.0,
    sleepThreshold: float = -1.0,
) -> None:
    """Change the given physical properties of a link (-1: the base). An unknown body is ignored.

    A new mass (kg) recomputes the inertia from the collision shapes, unless localInertiaDiagonal (kg m²) is
    given. A mass > 0 makes a fixed base movable; mass 0 makes a movable base immune to forces: it keeps its
    velocity. Damping applies to the whole body. Bodies do not sleep here, so the sleeping arguments have no
    effect.

    Raises:
        error: only one of contactStiffness and contactDamping is given, or a number is not finite.
    """
    try:
        total = sum(
            (
                mass, lateralFriction, spinningFriction, rollingFriction, restitution, linearDamping,
                angularDamping, jointDamping, contactStiffness, contactDamping, jointLowerLimit,
                jointUpperLimit,
            )
        )  # fmt: skip
    except TypeError:
        total = nan
    if localInertiaDiagonal is not None or type(total) is not float or total - total != 0.0:
        check_finite(
            "changeDynamics failed.",
            mass=number(mass),
            friction=(number(lateralFriction), number(spinningFriction), number(rollingFriction)),
            restitution=number(restitution),
            damping=(number(linearDamping), number(angularDamping), number(jointDamping)),
            contactStiffness=number(contactStiffness),
            contactDamping=number(contactDamping),
            localInertiaDiagonal=() if localInertiaDiagonal is None else localInertiaDiagonal,
            limits=(number(jointLowerLimit), number(jointUpperLimit)),
        )
    # All of these are numbers from here on
    if (contactStiffness >= 0) != (contactDamping >= 0):
        raise failure(
            "Both contactStiffness and contactDamping needs to be set together.",
            f"got contactStiffness={contactStiffness}, contactDamping={contactDamping}",
        )
    scene = client.scene
    record = scene.bodies.get(whole(bodyUniqueId))
    if record is None or not -1 <= whole(linkIndex) < record.joint_count:
        return
    state = record.links[linkIndex + 1]
    if record.soft is not None:
        if lateralFriction >= 0:
            state.friction = lateralFriction
            record.soft.set_friction(lateralFriction)
        if mass > 0:
            state.mass = mass
            record.soft.set_mass(mass)
        return
    if mass >= 0 or localInertiaDiagonal is not None:
        moments = None if localInertiaDiagonal is None else vector3_or(localInertiaDiagonal, state.moments)
        _set_mass(scene, record, linkIndex, mass if mass >= 0 else state.mass, moments)
    if lateralFriction >= 0 or spinningFriction >= 0 or rollingFriction >= 0:
        _set_friction(record, linkIndex, state, lateralFriction, spinningFriction, rollingFriction)
    if restitution >= 0:
        state.restitution = restitution
        record.body.links[linkIndex + 1].restitution = min(restitution, 1.0)
    if linearDamping >= 0 or angularDamping >= 0:
        linear = linearDamping if linearDamping >= 0 else record.linear_damping
        angular = angularDamping if angularDamping >= 0 else record.angular_damping
        if (linear, angular) != (record.linear_damping, record.angular_damping):
            scene.set_damping(record, linear, angular)
    if contactStiffness >= 0:
        state.contact_stiffness, state.contact_damping = contactStiffness, contactDamping
        link = record.body.links[linkIndex + 1]
        scene.world.surfaces.set_compliance(link, contactStiffness, contactDamping)
    if frictionAnchor != -1 and number(frictionAnchor) >= 0:
        state.is_anchored = bool(frictionAnchor)
        scene.world.surfaces.set_anchor(record.body.links[linkIndex + 1], is_anchored=bool(frictionAnchor))
    if collisionMargin != -1.0 and number(collisionMargin) >= 0:
        state.collision_margin, state.is_solid = collisionMargin, False
        record.link_boxes = scene.link_boxes = None
        scene.shape_rows.gather_again()
        scene.world.prepared.get("box", {}).pop(record.number, None)
        scene.world.prepared.get(_KIND, {}).pop(record.number, None)
    if linkIndex >= 0:
        joint = record.body.joints[linkIndex]
        if jointDamping >= 0:
            joint.damping = jointDamping
        if jointLowerLimit <= jointUpperLimit and joint.is_scalar:
            joint.set_limits(jointLowerLimit, jointUpperLimit)
        if maxJointVelocity != -1.0 and number(maxJointVelocity) >= 0:
            scene.world.stepping.set_velocity_limit(record.body.id, linkIndex, maxJointVelocity)


def _set_mass(
    scene: PhysicsScene,
    record: BodyRecord,
    link: int,
    mass: float,
    moments: tuple[float, float, float] | None,
) -> None:
    state = record.links[link + 1]
    is_known = mass > 0.0 and mass == state.mass and (link >= 0 or not record.model.fixed_base)
    by_shape = moments is None
    if moments is None:
        if is_known and state.is_solid:
            return
        moments = shape_moments(mass, *record.bounds(link))
    state.is_solid = by_shape
    if is_known and moments == state.moments:
        return
    was_massless, turned = state.mass == 0.0, not never_turns(state.moments)
    state.mass, state.moments = float(mass), moments
    if mass > 0.0 and link == -1 and record.model.fixed_base and not has_plane(record):
        scene.free_base(record)
        was_massless = True
    if mass == 0.0 or was_massless:
        scene.disable_gravity(record, link, mass == 0.0)
    if mass == 0.0 and link == -1 and not record.model.fixed_base:
        mass, moments = IMMOVABLE_MASS, (IMMOVABLE_MASS, IMMOVABLE_MASS, IMMOVABLE_MASS)
    if mass == 0.0 and link >= 0:
        description = record.model.description
        trace = trace_mass(description, link_masses(description, 1.0), share=LEAST_SHARE)
        mass, (x, y, z) = trace.mass, trace.principal.tolist()
        moments = x, y, z
    scene.hold_massless_joints(record)
    x, y, z = world_moments(moments, is_alone=len(record.links) == 1)
    inertial = Inertial(mass=mass, origin=state.frame, inertia=(x, 0.0, 0.0, y, 0.0, z))
    record.body.links[link + 1].set_inertial(inertial)
    if turned == never_turns(state.moments) and len(record.links) == 1:
        scene.set_damping(record, record.linear_damping, record.angular_damping)
    _prepare_mass(scene, record, link)


def _prepare_mass(scene: PhysicsScene, record: BodyRecord, link: int) -> None:
    """Let machine code change the mass of a link whose moments are those of its shapes; they grow with it."""
    world, state, places = scene.world, record.links[link + 1], (record.number, link)
    if not is_changed_again("changeDynamics", "mass", world.prepared, _KIND, places):
        return
    forget_write("changeDynamics", "mass", world.prepared, _KIND, places)
    handle = record.body.links[link + 1]
    mass, moments, present = state.mass, state.moments, handle._built.mass
    if not state.is_solid or mass <= 0.0 or (link < 0 and record.model.fixed_base):
        return
    least = 2.0 * max(MIN_INERTIA, LEAST_MOMENT) * mass / max(min(moments), 1e-300)
    if (
        not mass > least
        or present is None
        or present.mass != mass
        or present.principal.tolist() != [*moments]
    ):
        return  # the World has other numbers
    from roboyard.pybullet.fast.property_entries import Write

    factors, numbers = np.zeros((4, 4)), np.zeros(4)
    factors[:, 0] = 1.0, *(moment / mass for moment in moments)
    targets: tuple[Any, ...] = (numbers,)
    if not world.is_stale:
        model, row = world.live_model, record.body.mujoco_ids[link + 1]
        targets = numbers, model.body_mass[row : row + 1], model.body_inertia[row]
    write = Write(
        owner=state,
        name="mass",
        factors=factors,
        targets=targets,
        places=(np.arange(4), np.array([0]), np.array([1, 2, 3])),
        least=least,
        other=state,
        other_name="moments",
        marked=world,
        marks=() if world.is_stale else ("_inertia_changed", "is_moved", "_velocity_moved"),
        late=world.late_masses,
        key=handle,
        worth=numbers,
    )
    prepare_write("changeDynamics", "mass", world.prepared, _KIND, places, write)


def _set_friction(
    record: BodyRecord, link: int, state: LinkState, lateral: float, spinning: float, rolling: float
) -> None:
    old = state.friction, state.spinning_friction, state.rolling_friction
    if lateral >= 0:
        state.friction = lateral
    if spinning >= 0:
        state.spinning_friction = spinning
    if rolling >= 0:
        state.rolling_friction = rolling
    if (state.friction, state.spinning_friction, state.rolling_friction) == old:
        return
    handle = record.body.links[link + 1]
    handle.set_friction(
        sliding=state.friction, spinning=state.spinning_friction, rolling=state.rolling_friction
    )
    world, argument, places = handle.body.world, "lateralFriction", (record.number, link)
    if not is_changed_again("changeDynamics", argument, world.prepared, _KIND, places):
        return
    from roboyard.pybullet.fast.property_entries import Write

    factors, numbers = np.array([[1.0, 0.0, 0.0, 0.0]]), np.zeros(1)
    rows = [] if world.is_stale else handle.geom_ids
    write = Write(
        owner=state,
        name="friction",
        factors=factors,
        targets=(numbers, *(world.live_model.geom_friction[row, :1] for row in rows)),
        places=(np.array([0]),) * (len(rows) + 1),
        late=world.late_frictions,
        key=handle,
        worth=numbers,
    )
    prepare_write("changeDynamics", argument, world.prepared, _KIND, places, write)


def _hard_body(client: Client, body: int, link: int) -> BodyRecord | None:
    """Return the record of a body that is not soft and has this link."""
    record: BodyRecord | None = client.scene.bodies.get(body)
    if record is None or not -1 <= link < record.joint_count or record.soft is not None:
        return None
    return record


def _change_mass(client: Client, body: int, link: int, mass: float) -> None:
    record = client.scene.bodies.get(body)
    if record is None or not -1 <= link < record.joint_count:
        return
    state = record.links[link + 1]
    if mass != 0.0 and mass == state.mass and state.is_solid and not (link < 0 and record.model.fixed_base):
        return
    if record.soft is None:
        _set_mass(client.scene, record, link, mass, None)
    else:
        changeDynamics(client, body, link, mass=mass)


def _change_friction(client: Client, body: int, link: int, lateral: float) -> None:
    record = client.scene.bodies.get(body)
    if record is None or not -1 <= link < record.joint_count:
        return
    state = record.links[link + 1]
    if state.friction == lateral:
        return
    if record.soft is None:
        _set_friction(record, link, state, lateral, -1.0, -1.0)
    else:
        changeDynamics(client, body, link, lateralFriction=lateral)


def _change_spinning_friction(client: Client, body: int, link: int, spinning: float) -> None:
    record = _hard_body(client, body, link)
    if record is not None:
        _set_friction(record, link, record.links[link + 1], -1.0, spinning, -1.0)


def _change_rolling_friction(client: Client, body: int, link: int, rolling: float) -> None:
    record = _hard_body(client, body, link)
    if record is not None:
        _set_friction(record, link, record.links[link + 1], -1.0, -1.0, rolling)


def _change_linear_damping(client: Client, body: int, link: int, damping: float) -> None:
    record = _hard_body(client, body, link)
    if record is not None and record.linear_damping != damping:
        client.scene.set_damping(record, damping, record.angular_damping)


def _change_angular_damping(client: Client, body: int, link: int, damping: float) -> None:
    record = _hard_body(client, body, link)
    if record is not None and record.angular_damping != damping:
        client.scene.set_damping(record, record.linear_damping, damping)


def _change_joint_damping(client: Client, body: int, link: int, damping: float) -> None:
    record = _hard_body(client, body, link)
    if record is not None and link >= 0:
        record.body.joints[link].damping = damping


CHANGES: Mapping[str, Any] = {
    "mass": _change_mass,
    "lateralFriction": _change_friction,
    "spinningFriction": _change_spinning_friction,
    "rollingFriction": _change_rolling_friction,
    "linearDamping": _change_linear_damping,
    "angularDamping": _change_angular_damping,
    "jointDamping": _change_joint_damping,
}
"""Arguments of changeDynamics that change one property, to what does so where only such ones are given."""
START.later(partial(replace_properties, "changeDynamics", CHANGES, kind=_KIND))
