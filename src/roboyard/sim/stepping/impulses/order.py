"""The compiled loop of a step between the making of rows and the integration."""

from __future__ import annotations

from roboyard.native import compiled
from roboyard.sim.stepping.dynamics.inertia import accelerate, follow_centres, move_centres
from roboyard.sim.stepping.impulses.arranging import arrange
from roboyard.sim.stepping.impulses.asking import ask_of_rows
from roboyard.sim.stepping.impulses.contact_row_kernels import make_rows
from roboyard.sim.stepping.impulses.keeping import keep
from roboyard.sim.stepping.impulses.records import (
    ARRANGE,
    ASK,
    CONTACTS_ARE_HARD,
    DONE,
    EVERYTHING,
    IS_BOUNDED,
    KEEP,
    KEEPS_POINTS,
    LOST,
    MAKE,
    OF_ALL,
    OF_NONE,
    OTHERS,
    ROOM,
    ROOM_FOR_ROWS,
    ROUNDS,
    ROWS_ARE_OLD,
    SOLVE,
    TABLE,
    TIMESTEP,
)  # fmt: skip
from roboyard.sim.stepping.impulses.solving import solve
from roboyard.sim.stepping.kernels import bound_velocity
from roboyard.sim.stepping.manifold_kernels import note_slips, pull_to_anchors
from roboyard.sim.stepping.step_row_kernels import are_found

FRICTION_ERP = 0.2
"""Share of a slide at an anchor that is pulled back in a step."""


@compiled(EVERYTHING, "i8 i8 i8 i8 -> i8", fast_math=True, from_start=True, joins_lines=True)
def execute(  # pragma: no cover
    rows, contacts, search, mechanism, state, points, surface, solver, fields, own, own_contacts, own_search,
    first, last, remade, makes,
):  # fmt: skip
    """Execute the parts `first` to `last` of a step; return what is to be done next.

    KEEP: keep the points of contacts, before rows are used. MAKE: make the rows `makes` here. ARRANGE: choose
    the trees to solve and list their rows. ASK: write what limits and contacts ask for and what forces alone
    lead to; these are all rows. SOLVE: solve the rows, and write the solution where these are all rows.
    remade: 1 where the rows were made again, so that their velocities are not known.
    """
    if not are_found(search):
        return LOST
    contact_count, rules = search.counts[0], solver.rules
    if contact_count > points.sequence.shape[0]:
        return ROOM
    if first <= KEEP:
        answer = keep(rows, contacts, search, mechanism, state, points, surface, fields, rules)
        if last <= KEEP or (answer != DONE and (makes == OF_NONE or answer != ROWS_ARE_OLD)):
            return answer
        contact_count = search.counts[0]
    if last >= MAKE and makes != OF_NONE:
        answer = make_rows(
            rows, contacts, search, mechanism, state, surface, own, own_contacts, own_search, makes == OF_ALL
        )
        if answer != DONE:
            return answer
        rows, contacts, search = own, own_contacts, own_search
    count = search.counts[4]
    if count > solver.order.shape[0] or count > surface.base.shape[0]:
        return ROOM_FOR_ROWS
    if first <= ARRANGE:
        solver.ends[5] = -1
        before_contacts = search.counts[1] + search.counts[2] + search.counts[3]
        if rules[ROUNDS] > 0.0 and (contact_count == 0 or rules[CONTACTS_ARE_HARD] > 0.0):
            arrange(rows, contacts, search, mechanism, state, points, surface, solver, before_contacts)
        if solver.ends[5] != count:
            return OTHERS
    if last >= ASK and first <= ASK:
        ask_of_rows(rows, contacts, search, state, surface, solver, remade)
        if rules[KEEPS_POINTS] > 0.0:
            pull_to_anchors(
                contacts, contact_count, points.slots, points.points[points.notes[TABLE]], surface.anchors,
                mechanism.geom_body, state.xpos, state.xmat, FRICTION_ERP / rules[TIMESTEP], surface.base,
            )  # fmt: skip
        accelerate(mechanism, state, surface, solver)
        if solver.ends[5] == count:
            follow_centres(mechanism, state)
        if rules[IS_BOUNDED] > 0.0 and solver.ends[5] == count:
            bound_velocity(
                state.qvel, state.smooth, rules[TIMESTEP], solver.largest, mechanism.joint_type,
                mechanism.joint_dof, mechanism.joint_qpos, state.qpos, mechanism.dof_body, mechanism.centre,
                state.xmat,
            )  # fmt: skip
    if last >= SOLVE:
        solve(rows, contacts, search, mechanism, state, surface, solver)
        if rules[KEEPS_POINTS] > 0.0 and solver.ends[5] == count:
            note_slips(
                contacts, contact_count, points.slots, rows.force[rows.starts[9] :],
                points.points[points.notes[TABLE]],
            )  # fmt: skip
        if rules[IS_BOUNDED] > 0.0 and solver.ends[5] == count:
            bound_velocity(
                state.qvel, state.qacc, rules[TIMESTEP], solver.largest, mechanism.joint_type,
                mechanism.joint_dof, mechanism.joint_qpos, state.qpos, mechanism.dof_body, mechanism.centre,
                state.xmat,
            )  # fmt: skip
        if solver.ends[5] == count:
            move_centres(mechanism, state, rules[TIMESTEP])
    return DONE
