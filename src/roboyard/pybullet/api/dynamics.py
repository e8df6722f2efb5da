"""Masses, inertias, friction and damping: getDynamicsInfo and changeDynamics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan
from typing import TYPE_CHECKING, Any

from roboyard.description.mass_properties import link_masses, trace_mass
from roboyard.description.model import Inertial
from roboyard.pybullet.bullet_rules.models import IMMOVABLE_MASS, never_turns, world_moments
from roboyard.pybullet.bullet_rules.shape_inertia import shape_moments
from roboyard.pybullet.face.arguments import check_finite, number, vector3_or, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.dynamics_writes import (
    COMMAND,
    KIND,
    forget_body,
    prepare_anchor,
    prepare_compliance,
    prepare_damping,
    prepare_equal,
    prepare_friction,
    prepare_inertia,
    prepare_joint_damping,
    prepare_limits,
    prepare_mass,
    prepare_restitution,
)
from roboyard.pybullet.fast.fast_commands import replace_dynamics_info, replace_properties
from roboyard.pybullet.fast.pairs import PAIR, SIGNED_PAIR
from roboyard.pybullet.state.bodies.body_records import RIGID_BODY
from roboyard.sim.build.masses import LEAST_SHARE

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord, LinkState
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Vector = Sequence[float]
SOFT_BODY = 3
"""Type of a soft body, beside `MULTIBODY` and `RIGID_BODY`."""
_IGNORED = (
    *("ccdSweptSphereRadius", "contactProcessingThreshold", "activationState", "jointLimitForce"),
    *("sleepThreshold", "anisotropicFriction"),
)
"""Arguments that change nothing here."""


@command()
def getDynamicsInfo(client: Client, bodyUniqueId: int, linkIndex: int) -> tuple[Any, ...]:
    """Return the physical properties of a link (-1: the base); of rigid and soft bodies those of the base.

    Returns:
        Mass (kg), lateral friction, inertia diagonal (kg m²), position (m) and quaternion of the inertial
        frame in the link frame, restitution, rolling friction, spinning friction, contact damping, contact
        stiffness (-1: not set), body type (1: rigid body, 2: multibody, 3: soft), collision margin (m).

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
    if record is not None and (record.kind == RIGID_BODY or record.soft is not None):
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
        *(record.kind if record.soft is None else SOFT_BODY, record.shapes.bounds(linkIndex)[1]),
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
    velocity. Damping and the largest velocity of joints apply to the whole body. Bodies do not sleep here, so
    the sleeping arguments have no effect. As in Bullet, all arguments are of the base, whichever link is
    named, where the last of those that are given (in the order of `_RANKS`) is linearDamping, angularDamping,
    activationState, maxJointVelocity or collisionMargin.

    Raises:
        error: only one of contactStiffness and contactDamping is given, or a number is not finite.
    """
    moments = () if localInertiaDiagonal is None else localInertiaDiagonal
    try:
        total = sum(
            (
                *moments, mass, lateralFriction, spinningFriction, rollingFriction, restitution,
                linearDamping, angularDamping, jointDamping, contactStiffness, contactDamping,
                jointLowerLimit, jointUpperLimit,
            )
        )  # fmt: skip
    except TypeError:
        total = nan
    if type(total) is not float or total - total != 0.0:
        check_finite(
            "changeDynamics failed.",
            mass=number(mass),
            friction=(number(lateralFriction), number(spinningFriction), number(rollingFriction)),
            restitution=number(restitution),
            damping=(number(linearDamping), number(angularDamping), number(jointDamping)),
            contactStiffness=number(contactStiffness),
            contactDamping=number(contactDamping),
            localInertiaDiagonal=moments,
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
    given = (
        *(linearDamping, angularDamping, jointDamping, restitution, contactStiffness, frictionAnchor),
        *(
            ccdSweptSphereRadius,
            activationState,
            contactProcessingThreshold,
            maxJointVelocity,
            collisionMargin,
        ),
    )
    if _is_of_base(given):
        linkIndex = -1
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
        _set_mass(scene, record, linkIndex, float(mass) if mass >= 0 else state.mass, moments)
    if lateralFriction >= 0 or spinningFriction >= 0 or rollingFriction >= 0:
        _set_friction(record, linkIndex, state, lateralFriction, spinningFriction, rollingFriction)
    if restitution >= 0:
        _set_restitution(record, linkIndex, state, restitution)
    if linearDamping >= 0 or angularDamping >= 0:
        linear = linearDamping if linearDamping >= 0 else record.linear_damping
        angular = angularDamping if angularDamping >= 0 else record.angular_damping
        if (linear, angular) != (record.linear_damping, record.angular_damping):
            scene.set_damping(record, float(linear), float(angular))
    if contactStiffness >= 0:
        _set_compliance(record, linkIndex, state, contactStiffness, contactDamping)
    if frictionAnchor != -1 and number(frictionAnchor) >= 0:
        _set_anchor(record, linkIndex, state, bool(frictionAnchor))
    if collisionMargin != -1.0 and number(collisionMargin) >= 0:
        _set_margin(scene, record, linkIndex, collisionMargin)
    if linkIndex >= 0:
        joint = record.body.joints[linkIndex]
        if jointDamping >= 0:
            _set_joint_damping(record, linkIndex, state, jointDamping)
        if jointLowerLimit <= jointUpperLimit and joint.is_scalar:
            _set_limits(record, linkIndex, state, jointLowerLimit, jointUpperLimit)
    if maxJointVelocity != -1.0 and number(maxJointVelocity) >= 0:
        _set_velocity_limits(scene, record, maxJointVelocity)


def _set_margin(scene: PhysicsScene, record: BodyRecord, link: int, margin: float) -> None:
    state, prepared = record.links[link + 1], scene.world.prepared
    state.collision_margin, state.solid_mass = margin, None
    record.link_boxes = scene.link_boxes = None
    for kind in ("overlaps", "closest"):
        prepared.get(kind, {}).clear()
    scene.shapes.rows.gather_again()
    prepared.get("box", {}).pop(record.number, None)
    forget_body(record)


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
        if is_known and state.solid_mass == mass:
            return
        moments = shape_moments(mass, *record.shapes.bounds(link))
    state.solid_mass = float(mass) if by_shape else None
    if is_known and moments == state.moments:
        return
    was_massless, turned = state.mass == 0.0, not never_turns(state.moments)
    state.mass, state.moments = float(mass), moments
    if mass > 0.0 and link == -1 and record.model.fixed_base and not record.shapes.has_plane:
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
    if was_massless or state.mass == 0.0 or turned == never_turns(state.moments):
        forget_body(record)
    if was_massless or state.mass == 0.0:
        return  # such changes need more than numbers
    if by_shape:
        prepare_mass(record, link)
    else:
        prepare_inertia(record, link)


def _set_friction(
    record: BodyRecord, link: int, state: LinkState, lateral: float, spinning: float, rolling: float
) -> None:
    old = state.friction, state.spinning_friction, state.rolling_friction
    if lateral >= 0:
        state.friction = float(lateral)
    if spinning >= 0:
        state.spinning_friction = float(spinning)
    if rolling >= 0:
        state.rolling_friction = float(rolling)
    if (state.friction, state.spinning_friction, state.rolling_friction) == old:
        return
    handle = record.body.links[link + 1]
    handle.set_friction(
        sliding=state.friction, spinning=state.spinning_friction, rolling=state.rolling_friction
    )
    for argument, value in (
        ("lateralFriction", lateral),
        ("spinningFriction", spinning),
        ("rollingFriction", rolling),
    ):
        if value >= 0:
            prepare_friction(record, link, argument)


def _set_restitution(record: BodyRecord, link: int, state: LinkState, value: float) -> None:
    if value == state.restitution:
        prepare_equal(record, link, "restitution", state, "restitution")
        return
    state.restitution = float(value)
    record.body.links[link + 1].restitution = min(state.restitution, 1.0)
    prepare_restitution(record, link)


def _set_compliance(
    record: BodyRecord, link: int, state: LinkState, stiffness: float, damping: float
) -> None:
    if (stiffness, damping) == (state.contact_stiffness, state.contact_damping):
        names = "contact_stiffness", "contact_damping"
        prepare_equal(record, link, "contactStiffness", state, *names)
        return
    state.contact_stiffness, state.contact_damping = float(stiffness), float(damping)
    handle = record.body.links[link + 1]
    handle.body.world.surfaces.set_compliance(handle, state.contact_stiffness, state.contact_damping)
    prepare_compliance(record, link)


def _set_anchor(record: BodyRecord, link: int, state: LinkState, is_anchored: bool) -> None:
    if state.is_anchored == is_anchored:
        return
    state.is_anchored = is_anchored
    handle = record.body.links[link + 1]
    handle.body.world.surfaces.set_anchor(handle, is_anchored=is_anchored)


def _set_joint_damping(record: BodyRecord, joint: int, state: LinkState, damping: float) -> None:
    if damping == state.joint_damping:
        prepare_equal(record, joint, "jointDamping", state, "joint_damping")
        return
    record.body.joints[joint].damping = damping
    state.joint_damping = float(damping)
    prepare_joint_damping(record, joint)


def _set_limits(record: BodyRecord, joint: int, state: LinkState, lower: float, upper: float) -> None:
    if (lower, upper) == (state.lower_limit, state.upper_limit):
        prepare_equal(record, joint, "jointLowerLimit", state, "lower_limit", "upper_limit")
        return
    record.body.joints[joint].set_limits(lower, upper)
    state.lower_limit, state.upper_limit = float(lower), float(upper)
    prepare_limits(record, joint)


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
    if mass != 0.0 and mass == state.solid_mass and not (link < 0 and record.model.fixed_base):
        prepare_equal(record, link, "mass", state, "solid_mass")
    elif record.soft is None:
        _set_mass(client.scene, record, link, mass, None)
    else:
        changeDynamics(client, body, link, mass=mass)


def _change_inertia(client: Client, body: int, link: int, moments: tuple[float, float, float]) -> None:
    record = _hard_body(client, body, link)
    if record is not None:
        _set_mass(client.scene, record, link, record.links[link + 1].mass, moments)


def _change_margin(client: Client, body: int, link: int, margin: float) -> None:
    record = _hard_body(client, body, link)
    if record is not None:
        _set_margin(client.scene, record, link, margin)


def _change_friction(client: Client, body: int, link: int, lateral: float) -> None:
    record = client.scene.bodies.get(body)
    if record is None or not -1 <= link < record.joint_count:
        return
    state = record.links[link + 1]
    if record.soft is not None:
        changeDynamics(client, body, link, lateralFriction=lateral)
    elif state.friction == lateral:
        prepare_equal(record, link, "lateralFriction", state, "friction")
    else:
        _set_friction(record, link, state, lateral, -1.0, -1.0)


def _change_spinning_friction(client: Client, body: int, link: int, spinning: float) -> None:
    record = _hard_body(client, body, link)
    if record is not None:
        state = record.links[link + 1]
        if state.spinning_friction == spinning:
            prepare_equal(record, link, "spinningFriction", state, "spinning_friction")
        else:
            _set_friction(record, link, state, -1.0, spinning, -1.0)


def _change_rolling_friction(client: Client, body: int, link: int, rolling: float) -> None:
    record = _hard_body(client, body, link)
    if record is not None:
        state = record.links[link + 1]
        if state.rolling_friction == rolling:
            prepare_equal(record, link, "rollingFriction", state, "rolling_friction")
        else:
            _set_friction(record, link, state, -1.0, -1.0, rolling)


def _change_restitution(client: Client, body: int, link: int, value: float) -> None:
    record = _hard_body(client, body, link)
    if record is not None:
        _set_restitution(record, link, record.links[link + 1], value)


def _change_linear_damping(client: Client, body: int, link: int, damping: float) -> None:
    record = _hard_body(client, body, link)
    if record is None:
        return
    if record.linear_damping == damping:
        prepare_equal(record, link, "linearDamping", record, "linear_damping")
    else:
        client.scene.set_damping(record, float(damping), record.angular_damping)
        prepare_damping(record, link, "linearDamping")


def _change_angular_damping(client: Client, body: int, link: int, damping: float) -> None:
    record = _hard_body(client, body, link)
    if record is None:
        return
    if record.angular_damping == damping:
        prepare_equal(record, link, "angularDamping", record, "angular_damping")
    else:
        client.scene.set_damping(record, record.linear_damping, float(damping))
        prepare_damping(record, link, "angularDamping")


def _change_compliance(client: Client, body: int, link: int, values: tuple[float, float]) -> None:
    record = _hard_body(client, body, link)
    if record is not None:
        _set_compliance(record, link, record.links[link + 1], *values)


def _change_anchor(client: Client, body: int, link: int, value: float) -> None:
    known: Any = client.prepared[KIND]
    prepared = known.get(("anchor", body, link))
    if prepared is not None:
        state, surfaces, note, anchored, key, anchors, rows = prepared
        if surfaces.anchors is anchors:
            if note is not None:
                note()
            is_anchored = state.is_anchored = value > 0.0
            (anchored.add if is_anchored else anchored.discard)(key)
            for row in rows:
                anchors[row] = is_anchored
            return
    record = _hard_body(client, body, link)
    if record is not None:
        _set_anchor(record, link, record.links[link + 1], value > 0.0)
        prepare_anchor(record, link)


def _change_joint_damping(client: Client, body: int, link: int, damping: float) -> None:
    record = _hard_body(client, body, link)
    if record is not None and link >= 0:
        _set_joint_damping(record, link, record.links[link + 1], damping)


def _change_limits(client: Client, body: int, link: int, limits: tuple[float, float]) -> None:
    record = _hard_body(client, body, link)
    if record is not None and link >= 0 and limits[0] <= limits[1] and record.body.joints[link].is_scalar:
        _set_limits(record, link, record.links[link + 1], *limits)


def _change_velocity_limit(client: Client, body: int, link: int, largest: float) -> None:
    record = _hard_body(client, body, link)
    if record is not None:
        _set_velocity_limits(client.scene, record, largest)


def _set_velocity_limits(scene: PhysicsScene, record: BodyRecord, largest: float) -> None:
    if largest == record.velocity_limit:
        prepare_equal(record, -1, "maxJointVelocity", record, "velocity_limit")
        return
    record.velocity_limit = float(largest)
    scene.world.stepping.set_velocity_limit(record.body.id, record.velocity_limit)


_RANKS = {
    "linearDamping": -1,
    "angularDamping": -2,
    "jointDamping": 3,
    "restitution": 4,
    "contactStiffness": 5,
    "frictionAnchor": 6,
    "ccdSweptSphereRadius": 7,
    "activationState": -8,
    "contactProcessingThreshold": 9,
    "maxJointVelocity": -10,
    "collisionMargin": -11,
}
"""Arguments of changeDynamics in the order in which Bullet's client takes them: each names the link that all
are of, the one that is given or, where the number is negative, the base. Earlier ones name the one given."""


def _is_of_base(given: Sequence[float]) -> bool:
    """Return whether a call of changeDynamics changes the base, whichever link it names.

    Args:
        given: the arguments in the order of `_RANKS`, below 0 where they are not given.
    """
    for rank, value in zip(reversed(_RANKS.values()), reversed(given), strict=True):
        if value != -1.0 and number(value) >= 0:
            return rank < 0
    return False


CHANGES: Mapping[str, Any] = {
    "mass": _change_mass,
    "lateralFriction": _change_friction,
    "spinningFriction": _change_spinning_friction,
    "rollingFriction": _change_rolling_friction,
    "restitution": _change_restitution,
    "linearDamping": _change_linear_damping,
    "angularDamping": _change_angular_damping,
    "contactStiffness": _change_compliance,
    "frictionAnchor": _change_anchor,
    "localInertiaDiagonal": _change_inertia,
    "jointDamping": _change_joint_damping,
    "maxJointVelocity": _change_velocity_limit,
    "collisionMargin": _change_margin,
    "jointLowerLimit": _change_limits,
}
"""Arguments of changeDynamics that change one property, to what does so where only such ones are given."""


def replace_changes() -> None:
    """Let machine code change dynamics."""
    replace_properties(
        COMMAND,
        CHANGES,
        lengths={"contactStiffness": PAIR, "jointLowerLimit": SIGNED_PAIR}
        | {"localInertiaDiagonal": 3, "anisotropicFriction": 3},
        kind=KIND,
        ignored=_IGNORED,
        ranks=_RANKS,
    )


START.later(replace_changes, "changeDynamics")
START.later(replace_dynamics_info, "getDynamicsInfo")
