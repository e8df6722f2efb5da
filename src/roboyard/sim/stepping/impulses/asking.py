"""References of limits and contacts, where no row is left to MuJoCo's solver."""

from __future__ import annotations

from roboyard.sim.stepping.impulses.entries import along
from roboyard.sim.stepping.impulses.records import (
    CONTACT_ERP,
    DEEP,
    ERP,
    IS_COMPLIANT,
    IS_PRODUCT,
    LIMITS_ARE_HARD,
    SLOP,
    SLOW,
    TIMESTEP,
)  # fmt: skip
from roboyard.sim.stepping.kernels import compliant_contacts, hard_contacts, hard_limits, product_friction


def ask_of_rows(rows, contacts, search, state, surface, solver, remade):  # pragma: no cover
    """Write what limits and contacts ask for, where no row is left to MuJoCo's solver.

    Does what `hard_limits`, `product_friction`, `hard_contacts` and `compliant_contacts` do.
    """
    at, count, contact_count, rules = rows.starts, search.counts[4], search.counts[0], solver.rules
    velocity = rows.velocity[at[7] : at[7] + count]
    reference = rows.reference[at[8] : at[8] + count]
    if remade == 1:
        for n in range(solver.ends[4]):
            velocity[solver.order[n, 0]] = along(solver.jacobian, n, solver.spans, state.qvel)
    limits = search.counts[3]
    if limits > 0 and rules[LIMITS_ARE_HARD] > 0.0:
        kind, position = rows.kind[at[0] : at[0] + count], rows.position[at[3] : at[3] + count]
        hard_limits(
            kind, position, velocity, search.counts[1] + search.counts[2], limits, rules[TIMESTEP],
            rules[ERP], rules[DEEP], reference,
        )  # fmt: skip
    if contact_count > 0:
        R, D = rows.R[at[5] : at[5] + count], rows.D[at[6] : at[6] + count]
        geom, address = contacts.geom[:contact_count], contacts.address[:contact_count]
        dim, dist, friction, mu = contacts.dim, contacts.dist, contacts.friction, contacts.mu
        if rules[IS_PRODUCT] > 0.0:
            product_friction(surface.friction, geom, dim, address, friction, mu, R, D)
        hard_contacts(
            surface.restitution, geom, dim, address, dist, friction, velocity, rules[TIMESTEP],
            rules[CONTACT_ERP], rules[SLOP], rules[SLOW], surface.base, reference, R, D, surface.margins,
            surface.reaches, contacts.position, contacts.frame,
        )  # fmt: skip
        if rules[IS_COMPLIANT] > 0.0:
            compliant_contacts(
                surface.compliance, geom, dim, address, dist, friction, mu, rules[TIMESTEP],
                rules[CONTACT_ERP], rules[SLOP], surface.base, reference, R, D,
            )  # fmt: skip
