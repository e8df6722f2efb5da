"""Compiled loops that solve the rows of a step one after the other, as an impulse solver does."""

from __future__ import annotations

from roboyard.native import compiled
from roboyard.sim.constraints.kinds import SLIDE
from roboyard.sim.stepping.dynamics.inertia import (
    change_velocities,
    find_roots,
    scale,
    scale_across,
    solve_inertia,
)
from roboyard.sim.stepping.dynamics.neighbours import note_neighbours
from roboyard.sim.stepping.impulses.contact_row_kernels import FRICTION, OWN_CONTACT
from roboyard.sim.stepping.impulses.entries import add_to
from roboyard.sim.stepping.impulses.lanes import solve_in_turn
from roboyard.sim.stepping.impulses.records import (
    BLOCK,
    DENSE,
    ERP,
    FEW,
    IS_PYRAMID,
    RESIDUAL,
    ROUNDS,
    SHORT,
    SLOW,
    TIMESTEP,
)
from roboyard.sim.stepping.impulses.rows import contact_rows, set_goals
from roboyard.sim.stepping.impulses.table import solve_by_table

EQUALITY, CONTACT = 0, 5
"""MuJoCo's kind of the rows of constraints."""


def solve(rows, contacts, search, mechanism, state, surface, solver):  # pragma: no cover
    """Write what each row asks for and solve the rows in turn; see `set_goals` and `solve_in_turn`."""
    at, count, rules = rows.starts, search.counts[4], solver.rules
    order, ends, goals, timestep = solver.order, solver.ends, solver.goals, rules[TIMESTEP]
    spans, jacobian = solver.spans, solver.jacobian
    kind, index = rows.kind[at[0] : at[0] + count], rows.ids[at[1] : at[1] + count]
    position = rows.position[at[3] : at[3] + count]
    loss, R = rows.loss[at[4] : at[4] + count], rows.R[at[5] : at[5] + count]
    velocity = rows.velocity[at[7] : at[7] + count]
    reference, force = rows.reference[at[8] : at[8] + count], rows.force[at[9] : at[9] + count]
    geom, address = contacts.geom[: search.counts[0]], contacts.address[: search.counts[0]]
    contact_rows(
        geom, address, contacts.dim, contacts.friction, surface.compliance, surface.restitution, R, solver.mu,
        solver.soft,
    )  # fmt: skip
    set_goals(
        order, kind, index, position, velocity, reference, surface.base, loss, solver.mu, solver.soft,
        mechanism.dof_joint, mechanism.joint_type, mechanism.joint_qpos, solver.motors, solver.targets,
        state.qpos, state.qvel, state.smooth, spans, jacobian, ends, mechanism.equality_bound,
        mechanism.equality_share, mechanism.equality_aux, rules[ERP], rules[SLOW], timestep, goals,
    )  # fmt: skip
    note_gears(kind, index, mechanism, state, solver)
    note_links_apart(kind, index, geom, mechanism, state, solver)
    note_neighbours(order, kind, index, mechanism, state, solver, FRICTION)
    listed = ends[4]
    entries = 0
    for n in range(listed):
        entries += spans[n, 1] + spans[n, 3]
    roots, plain = solver.roots, solver.diagonal
    bent = find_roots(mechanism, state, roots, plain)
    if listed <= FEW or (listed <= DENSE and entries > SHORT * listed):
        width = (listed + BLOCK - 1) // BLOCK * BLOCK
        across = solver.across
        for k in range(roots.shape[0] * width):
            across[k] = 0.0
        for n in range(listed):
            first, size, other = spans[n, 0], spans[n, 1], spans[n, 2]
            for k in range(size):
                across[(first + k) * width + n] = jacobian[n, k]
            for k in range(spans[n, 3]):
                across[(other + k) * width + n] = jacobian[n, size + k]
        scale_across(mechanism, state, roots, across, width)
        solve_by_table(
            order, spans, goals, ends, solver.parts, across, rules[ROUNDS], rules[RESIDUAL],
            rules[IS_PYRAMID] > 0.0, solver.table, solver.lines, solver.change,
        )  # fmt: skip
    else:
        for n in range(listed if bent > 0 else 0):
            for side in range(2):
                first, size = spans[n, 2 * side], spans[n, 2 * side + 1]
                if size > 0 and plain[order[n, 1 + side]] == 0:
                    place = spans[n, 1] if side == 1 else 0
                    scale(mechanism, state, roots, jacobian[n], solver.scaled[n], first, size, place)
        solve_in_turn(
            order, spans, goals, ends, solver.parts, jacobian, solver.scaled, roots, plain,
            mechanism.tree_dof, mechanism.tree_dofs, solver.slots, solver.places_of_rows, solver.lanes,
            solver.velocities, rules[ROUNDS], rules[RESIDUAL], rules[IS_PYRAMID] > 0.0, solver.change,
        )  # fmt: skip
    change_velocities(mechanism, state, roots, solver.change)
    if solver.ends[5] == count:
        if listed < count:
            for row in range(count):
                force[row] = 0.0  # of contacts that do not push
        for dof in range(state.qacc.shape[0]):
            state.qacc[dof] = state.smooth[dof]  # of trees that nothing holds
            state.constraint[dof] = 0.0
        write_rows(
            order, spans, goals, ends, jacobian, solver.change, state.smooth, solver.taken,
            mechanism.dof_tree, timestep, state.qacc, force, state.constraint,
        )  # fmt: skip


def note_gears(kind, index, mechanism, state, solver):  # pragma: no cover
    """Write what the joints of a gear give each other through their tree, for which Bullet does not allow.

    It divides by what an impulse on each joint changes in the velocity of that joint alone.
    """
    order, spans, jacobian, goals, work = (
        solver.order,
        solver.spans,
        solver.jacobian,
        solver.goals,
        solver.change,
    )
    for n in range(solver.ends[0]):
        row = order[n, 0]
        if kind[row] != 0 or order[n, 2] >= 0 or mechanism.equality_site[index[row], 0] >= 0:
            continue
        first, size, one = spans[n, 0], spans[n, 1], -1
        for k in range(size):
            if jacobian[n, k] != 0.0 and one < 0:
                one = k
                for dof in range(first, first + size):
                    work[dof] = 0.0
                work[first + k] = jacobian[n, k]
                solve_inertia(mechanism, state, work, first, first + size, first)
            elif jacobian[n, k] != 0.0:
                goals[n, 5] += 2.0 * jacobian[n, k] * work[first + k]


def note_links_apart(kind, index, geom, mechanism, state, solver):  # pragma: no cover
    """Write what both links of a row give each other through their tree, for which Bullet does not allow.

    It divides by the sum of what an impulse on each link changes in the velocity of that link alone: where
    two links of a robot touch or are held together by a constraint, and for motors of spherical joints, see
    `note_neighbours`. So links that cannot move apart still push each other.
    """
    order, entries, tree = solver.order, solver.scaled, mechanism.geom_tree
    for n in range(solver.ends[4]):
        row = order[n, 0]
        if order[n, 1] < 0 or order[n, 2] >= 0:
            continue
        if kind[row] == OWN_CONTACT or kind[row] >= CONTACT:
            a, b = geom[index[row], 0], geom[index[row], 1]
            if tree[a] != tree[b]:
                continue  # the entries of its first link were kept as it was written
        elif kind[row] == EQUALITY and holds_own_links(index[row], mechanism):
            write_first_link(n, row, kind, index, mechanism, state, solver)
        else:
            continue
        first, size, work = solver.spans[n, 0], solver.spans[n, 1], solver.change
        for k in range(size):
            work[first + k] = entries[n, k]
        solve_inertia(mechanism, state, work, first, first + size, first)
        for k in range(size):
            solver.goals[n, 5] += 2.0 * work[first + k] * (solver.jacobian[n, k] - entries[n, k])


def holds_own_links(equality, mechanism):
    """Return whether an equality holds two frames of one tree together; not slides, whose rows are turned."""
    one, two = mechanism.equality_site[equality, 0], mechanism.equality_site[equality, 1]
    if one < 0 or mechanism.equality_aux[equality] == SLIDE:
        return False
    return mechanism.body_tree[mechanism.site_body[one]] == mechanism.body_tree[mechanism.site_body[two]]


def write_first_link(n, row, kind, index, mechanism, state, solver):
    """Write the entries that row n of a constraint at two frames has for the link of the first one."""
    equality, before = index[row], 0
    while before < row and kind[row - 1 - before] == EQUALITY and index[row - 1 - before] == equality:
        before += 1
    site = mechanism.equality_site[equality, 0]
    body, k = mechanism.site_body[site], before % 3
    if before >= 3:  # half the turn about an axis of the first frame; see `turn_about_axis`
        x, y, z = state.site_xmat[site, k], state.site_xmat[site, 3 + k], state.site_xmat[site, 6 + k]
        write_link(n, body, 0.5 * x, 0.5 * y, 0.5 * z, 0.0, 0.0, 0.0, mechanism, state, solver)
        return
    root = mechanism.body_root[body]
    x = state.site_xpos[site, 0] - state.subtree_com[root, 0]
    y = state.site_xpos[site, 1] - state.subtree_com[root, 1]
    z = state.site_xpos[site, 2] - state.subtree_com[root, 2]
    if k == 0:
        write_link(n, body, 0.0, z, -y, 1.0, 0.0, 0.0, mechanism, state, solver)
    elif k == 1:
        write_link(n, body, -z, 0.0, x, 0.0, 1.0, 0.0, mechanism, state, solver)
    else:
        write_link(n, body, y, -x, 0.0, 0.0, 0.0, 1.0, mechanism, state, solver)


def write_link(n, body, rx, ry, rz, x, y, z, mechanism, state, solver):
    """Write the turns of a link's chain of joints about (rx, ry, rz) and their moves along (x, y, z)."""
    entries, first = solver.scaled, solver.spans[n, 0]
    for k in range(solver.spans[n, 1]):
        entries[n, k] = 0.0
    while body > 0:
        start = mechanism.body_dof[body]
        for d in range(start, start + mechanism.body_dofs[body]):
            turn = rx * state.cdof[d, 0] + ry * state.cdof[d, 1] + rz * state.cdof[d, 2]
            entries[n, d - first] = turn + x * state.cdof[d, 3] + y * state.cdof[d, 4] + z * state.cdof[d, 5]
        body = mechanism.body_parent[body]


def write_rows(
    rows, spans, goals, ends, jacobian, change, smooth, taken, dof_tree, timestep, qacc, force, constraint
):  # fmt: skip
    """Write accelerations, forces of rows and constraint forces of dofs of the chosen trees."""
    for dof in range(qacc.shape[0]):
        if taken[dof_tree[dof]] == 1:
            qacc[dof] = smooth[dof] + change[dof] / timestep
            constraint[dof] = 0.0
    for n in range(ends[4]):
        value = goals[n, 3] / timestep
        force[rows[n, 0]] = value
        add_to(constraint, value, jacobian, n, spans)


@compiled(
    "i4[:,::1] i4[:,::1] f8[:,::1] i4[::1] f8[:,::1] f8[::1] f8[::1] u1[::1] i4[::1] f8 f8[::1] f8[::1]"
    " f8[::1]"
)
def write_solution(  # pragma: no cover
    rows, spans, goals, ends, jacobian, change, smooth, taken, dof_tree, timestep, qacc, force, constraint
):  # fmt: skip
    """Write the solution over that of MuJoCo's solver; see `write_rows`."""
    write_rows(
        rows, spans, goals, ends, jacobian, change, smooth, taken, dof_tree, timestep, qacc, force,
        constraint,
    )  # fmt: skip
