"""The compiled loop of a step between the making of rows and the integration, once points are kept."""

from __future__ import annotations

from roboyard.native import compiled
from roboyard.sim.stepping.impulses.arranging import arrange
from roboyard.sim.stepping.impulses.inertia import accelerate
from roboyard.sim.stepping.impulses.records import (
    ARRANGE,
    ASK,
    CONTACT_ERP,
    CONTACTS_ARE_HARD,
    DEEP,
    DONE,
    ERP,
    EVERYTHING,
    HAND_OVER,
    HANDED_OVER,
    IS_BOUNDED,
    IS_COMPLIANT,
    IS_PRODUCT,
    KEEPS_POINTS,
    LIMITS_ARE_HARD,
    LOST,
    OTHERS,
    ROOM,
    ROUNDS,
    SEARCH,
    SLOP,
    SLOW,
    SOLVE,
    SURFACE,
    TABLE,
    TIMESTEP,
)  # fmt: skip
from roboyard.sim.stepping.impulses.solving import solve
from roboyard.sim.stepping.kernels import (
    add_damping,
    bound_velocity,
    compliant_contacts,
    correct_sliding,
    estimate_sliding,
    hard_contacts,
    hard_equalities,
    hard_limits,
    product_friction,
)  # fmt: skip
from roboyard.sim.stepping.manifold_kernels import note_slips, pull_to_anchors
from roboyard.sim.stepping.step_row_kernels import CONTACTS, ROWS, are_found

FRICTION_ERP = 0.2
"""Share of a slide at an anchor that is pulled back in a step."""


@compiled(EVERYTHING, "i8 i8 i8 -> i8", fast_math=True, from_start=True)
def execute(  # pragma: no cover
    rows, contacts, search, mechanism, state, points, surface, solver, first, last, remade
):
    """Execute the parts `first` to `last` of a step after KEEP; return what is to be done next.

    ARRANGE: choose the trees to solve and list their rows. ASK: write what limits and contacts ask for and
    what forces alone lead to; these are all rows. SOLVE: solve the rows, and write the solution where these
    are all rows. HAND_OVER: write what rows ask for into MuJoCo's, and drag; done after other parts only
    where its solver has rows to solve. remade: 1 where the rows were made again, so that their velocities
    are not known.
    """
    if not are_found(search):
        return LOST
    contact_count, count = search.counts[0], search.counts[4]
    rules = solver.rules
    if count > solver.order.shape[0] or count > surface.base.shape[0]:
        return ROOM
    if first <= ARRANGE:
        solver.ends[5] = -1
        before_contacts = search.counts[1] + search.counts[2] + search.counts[3]
        if rules[ROUNDS] > 0.0 and (contact_count == 0 or rules[CONTACTS_ARE_HARD] > 0.0):
            arrange(rows, contacts, search, mechanism, state, surface, solver, before_contacts)
        if solver.ends[5] != count:
            if last < HAND_OVER or search.places.shape[0] == 0:
                return OTHERS
            first = HAND_OVER
    if first == HAND_OVER:
        hand_over(rows, contacts, search, mechanism, state, surface, solver)
        return HANDED_OVER
    if last >= ASK and first <= ASK:
        ask_of_rows(rows, contacts, search, state, surface, solver, remade)
        if rules[KEEPS_POINTS] > 0.0:
            pull_to_anchors(
                contacts, contact_count, points.slots, points.points[points.notes[TABLE]], surface.anchors,
                mechanism.geom_body, state.xpos, state.xmat, FRICTION_ERP / rules[TIMESTEP], surface.base,
            )  # fmt: skip
        accelerate(mechanism, state, surface, solver)
    if last >= SOLVE:
        solve(rows, contacts, search, mechanism, state, surface, solver)
        if rules[KEEPS_POINTS] > 0.0 and solver.ends[5] == count:
            note_slips(
                contacts, contact_count, points.slots, rows.force[rows.starts[9] :],
                points.points[points.notes[TABLE]],
            )  # fmt: skip
        if rules[IS_BOUNDED] > 0.0 and solver.ends[5] == count:
            bound_velocity(state.qvel, state.qacc, rules[TIMESTEP], solver.largest)
    return DONE


def ask_of_rows(rows, contacts, search, state, surface, solver, remade):  # pragma: no cover
    """Write what limits and contacts ask for, where no row is left to MuJoCo's solver.

    Does what `hard_limits`, `product_friction`, `hard_contacts` and `compliant_contacts` do.
    """
    at, count, contact_count, rules = rows.starts, search.counts[4], search.counts[0], solver.rules
    velocity = rows.velocity[at[7] : at[7] + count]
    reference = rows.reference[at[8] : at[8] + count]
    if remade == 1:
        for n in range(count):
            total = 0.0
            for d in range(state.qvel.shape[0]):
                total += solver.jacobian[n, d] * state.qvel[d]
            velocity[solver.order[n, 0]] = total
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


def hand_over(rows, contacts, search, mechanism, state, surface, solver):  # pragma: no cover
    """Do what `Surfaces.apply` does: add drag, and write what rows ask for, for MuJoCo's solver."""
    add_damping(
        surface.damping, mechanism.mass, mechanism.inertia, mechanism.body_root, state.cvel, state.xipos,
        state.ximat, state.subtree_com, state.wrench,
    )  # fmt: skip
    at, count, rules = rows.starts, search.counts[4], solver.rules
    reference = rows.reference[at[8] : at[8] + count]
    velocity = rows.velocity[at[7] : at[7] + count]
    if rules[CONTACTS_ARE_HARD] > 0.0:
        position = rows.position[at[3] : at[3] + count]
        hard_equalities(position, velocity, search.counts[1], rules[TIMESTEP], rules[ERP], reference)
    ask_of_rows(rows, contacts, search, state, surface, solver, 0)
    estimate_sliding(
        contacts.dim, contacts.address[: search.counts[0]], contacts.friction, velocity, rules[TIMESTEP],
        surface.base, reference,
    )  # fmt: skip


@compiled(ROWS, CONTACTS, SEARCH, SURFACE, "f8[::1] f8 -> f8")
def correct_slides(rows, contacts, search, surface, acceleration, timestep):  # pragma: no cover
    """Do what `correct_sliding` does, in MuJoCo's block; return the largest change (m/s)."""
    at, count = rows.starts, search.counts[4]
    return correct_sliding(
        contacts.dim, contacts.address[: search.counts[0]], contacts.friction,
        rows.velocity[at[7] : at[7] + count], acceleration, rows.force[at[9] : at[9] + count], timestep,
        surface.base, rows.reference[at[8] : at[8] + count],
    )  # fmt: skip
