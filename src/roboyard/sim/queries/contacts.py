"""Contacts of the last step, as objects or as arrays."""

from __future__ import annotations

import typing

import numpy as np

from roboyard._records import dataclass
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.link import Link
from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True)
class Contact:
    """One contact point of two links."""

    link_a: Link
    link_b: Link
    position: Array
    """(3,) point midway between the surfaces in the world frame (m)."""
    normal: Array
    """(3,) unit normal from link_a to link_b in the world frame."""
    distance: float
    """Distance of the surfaces (m); negative for a penetration."""
    normal_force: float
    """Normal force (N), at least 0."""
    friction_force: Array
    """(3,) friction force on link_a in the world frame (N); the opposite acts on link_b."""

    @property
    def body_a(self) -> Body:
        """The body of link_a."""
        return typing.cast(Body, self.link_a.body)

    @property
    def body_b(self) -> Body:
        """The body of link_b."""
        return typing.cast(Body, self.link_b.body)


@dataclass(frozen=True, kw_only=True, slots=True)
class ContactArrays:
    """All k contacts, in MuJoCo's order."""

    owners: np.ndarray
    """(k, 4) int32: body id and link index of a, then of b."""
    position: Array
    """(k, 3) points in the world frame (m)."""
    frame: Array
    """(k, 3, 3) rows: normal from a to b, then two tangents, in the world frame."""
    distance: Array
    """(k,) distances of the surfaces (m)."""
    force: Array
    """(k, 3) force on b along the rows of `frame` (N)."""


def contact_arrays(world: Engine[Body]) -> ContactArrays:
    """Return the contacts of the last step (or of the last `World.detect_contacts`)."""
    world.ensure_compiled()
    model, data = world.live_model, world.live_data
    k = data.ncon
    contact = data.contact
    force = world.contact_forces()
    geom = contact.geom.reshape(k, 2)
    owners = world.geom_owners[geom]
    if model.nflex:
        for flex, body_id in world.flex_owners().items():
            owners[contact.flex.reshape(k, 2) == flex] = body_id, 0
    owners = owners.reshape(k, 4)
    there = contact.exclude == 0 if model.nflex else slice(None)  # others are merged with one of these
    return ContactArrays(
        owners=owners[there],
        position=contact.pos.reshape(k, 3)[there].copy(),
        frame=contact.frame.reshape(k, 3, 3)[there].copy(),
        distance=contact.dist[there].copy(),
        force=force[there],
    )


def find_contacts(world: Engine[Body], body: Body | None = None, other: Body | None = None) -> list[Contact]:
    """Return contacts as objects; `body` is a where it takes part, `other` filters by the second body."""
    arrays = contact_arrays(world)
    found = []
    for i in range(len(arrays.distance)):
        body_a, link_a, body_b, link_b = (int(v) for v in arrays.owners[i])
        normal, sign = arrays.frame[i, 0], 1.0
        if body is not None:
            if body.id not in (body_a, body_b):
                continue
            if body_a != body.id:
                body_a, link_a, body_b, link_b, sign = body_b, link_b, body_a, link_a, -1.0
        if other is not None and other.id not in ((body_b,) if body is not None else (body_a, body_b)):
            continue
        bodies = world.body_by_id
        tangential = arrays.force[i, 1:] @ arrays.frame[i, 1:]
        found.append(
            Contact(
                link_a=bodies[body_a].links[link_a],
                link_b=bodies[body_b].links[link_b],
                position=arrays.position[i],
                normal=sign * normal,
                distance=float(arrays.distance[i]),
                normal_force=float(arrays.force[i, 0]),
                friction_force=-sign * tangential,
            )
        )
    return found
