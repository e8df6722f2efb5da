"""Compiled loops that solve the constraints of robots one after the other, as an impulse solver does."""

from __future__ import annotations

import numpy as np

from roboyard.native import Bundle, compiled
from roboyard.sim.stepping.impulse_records import (
    BLOCK,
    CONTACT_ERP,
    CONTACTS_ARE_HARD,
    CUT,
    DEEP,
    DENSE,
    ERP,
    EXTRA,
    HELD,
    HIGH,
    IMPULSE,
    INVERSE,
    IS_BOUNDED,
    IS_COMPLIANT,
    IS_PRODUCT,
    KEEPS_POINTS,
    LIMITS_ARE_HARD,
    LOW,
    MECHANISM,
    OWN,
    PAIRS,
    POINTS,
    RESIDUAL,
    ROUNDS,
    SEARCH,
    SEEN,
    SLOP,
    SLOW,
    SOLVER,
    STATE,
    SURFACE,
    TABLE,
    TIMESTEP,
    WISH,
)  # fmt: skip
from roboyard.sim.stepping.impulse_rows import choose_trees, contact_rows, order_rows, set_goals
from roboyard.sim.stepping.kernels import (
    add_damping,
    bound_velocity,
    compliant_contacts,
    correct_sliding,
    drag_on,
    estimate_sliding,
    hard_contacts,
    hard_equalities,
    hard_limits,
    product_friction,
)  # fmt: skip
from roboyard.sim.stepping.manifold_kernels import (
    copy_contacts,
    drop_gaps,
    keep_points,
    note_slips,
    pull_to_anchors,
    round_edges,
    write_points,
)
from roboyard.sim.stepping.step_row_kernels import CONTACTS, ROWS, find_rows

EVERYTHING = Bundle((ROWS, CONTACTS, SEARCH, MECHANISM, STATE, POINTS, SURFACE, SOLVER))
"""Arrays of a step."""
FRICTION_ERP = 0.2
"""Share of a slide at an anchor that is pulled back in a step."""
KEEP, ARRANGE, ASK, SOLVE, HAND_OVER = range(5)
"""Parts of a step, in order; the last one where MuJoCo's solver has rows to solve."""
DONE, ROOM, POINTS_ARE_NEW, ROWS_ARE_OLD, OTHERS, HANDED_OVER, LOST = range(7)
"""Answers of `execute`: all is done; arrays are too short; points must be added to MuJoCo's contacts; it must
make rows again, since contacts were moved or added; its solver has rows to solve; they are handed over to it,
too; its arrays are not where they were."""


@compiled(
    EVERYTHING,
    "i8 i8 i8 -> i8",
    fast_math=True,
    from_start=True,
)
def execute(  # pragma: no cover
    rows, contacts, search, mechanism, state, points, surface, solver, first, last, remade
):
    """Execute the parts `first` to `last` of a step; return what is to be done next.

    KEEP: keep the points of contacts, before MuJoCo's rows are used. ARRANGE: choose the trees to solve and
    list their rows. ASK: write what limits and contacts ask for and what forces alone lead to; these are all
    rows. SOLVE: solve the rows, and write the solution where these are all rows. HAND_OVER: write what rows
    ask for into MuJoCo's, and drag; done after all parts from KEEP on, too. remade: 1 where the rows
    were made again, so that their velocities are not known.
    """
    if search.places.shape[0] > 0:
        is_found = find_rows(
            search.words, search.places, search.counts, search.starts, search.address, search.size,
            search.contact, search.degrees,
        )  # fmt: skip
        if is_found == 0:
            return LOST
    contact_count, count = search.counts[0], search.counts[4]
    rules = solver.rules
    if count > solver.order.shape[0] or count > surface.base.shape[0]:
        return ROOM
    if first == HAND_OVER:
        hand_over(rows, contacts, search, mechanism, state, surface, solver)
        return HANDED_OVER
    if first <= KEEP:
        points.notes[EXTRA] = 0
        moved = 0
        if surface.boxes.shape[0] > 0:
            moved = round_edges(
                contacts, contact_count, mechanism.geom_type, mechanism.geom_body, state.xpos, state.xmat,
                surface.boxes, surface.rounding,
            )  # fmt: skip
            drop_gaps(
                contacts, contact_count, mechanism.geom_type, mechanism.geom_body, state.xpos, state.xmat,
                surface.margins, surface.boxes, surface.compound,
            )  # fmt: skip
        if contact_count == 0:
            points.notes[PAIRS] = 0
        elif rules[KEEPS_POINTS] > 0.0:
            if contact_count > points.keys.shape[1]:
                return ROOM
            now = points.notes[TABLE]
            following = 1 - now
            points.notes[EXTRA] = keep_points(
                contacts, contact_count, points.kinds, mechanism.geom_type, mechanism.geom_body, state.xpos,
                state.xmat, surface.margins, surface.reaches, surface.anchors, rules[SEEN],
                points.notes[PAIRS], points.keys[now], points.counts[now], points.points[now],
                points.keys[following], points.counts[following], points.points[following], points.fresh,
                points.source, points.extra, points.slots, points.notes,
            )  # fmt: skip
            points.notes[TABLE] = following
            if points.notes[HELD] > 0:
                moved = 1
            if points.notes[EXTRA] > 0:
                return ROWS_ARE_OLD if add_points(rows, contacts, search, points) else POINTS_ARE_NEW
        if moved == 1:
            return ROWS_ARE_OLD
    if last <= KEEP:
        return DONE
    if first <= ARRANGE:
        solver.ends[5] = -1
        before_contacts = search.counts[1] + search.counts[2] + search.counts[3]
        if rules[ROUNDS] > 0.0 and (contact_count == 0 or rules[CONTACTS_ARE_HARD] > 0.0):
            arrange(rows, contacts, search, mechanism, state, surface, solver, before_contacts)
        if solver.ends[5] != count:
            if first > KEEP or search.places.shape[0] == 0:
                return OTHERS
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


def add_points(rows, contacts, search, points):
    """Add the points that are kept besides MuJoCo's contacts to these, in its block; return whether it could.

    Does what MuJoCo's `mj_addContact` does: contacts overwrite the rows, which have to be made again.
    """
    before, extra = search.counts[0], points.notes[EXTRA]
    total = before + extra
    if search.places.shape[0] == 0 or total * search.contact > search.size:
        return False
    for k in range(search.counts.shape[0]):
        search.counts[k] = 0
    search.counts[0] = total
    copy_contacts(rows.kind, search.contact // 4, total, extra, points.source)
    write_points(contacts, total, extra, points.extra)
    return True


def arrange(rows, contacts, search, mechanism, state, surface, solver, wanted):  # pragma: no cover
    """Choose the trees to solve, list their rows and copy their Jacobian, for contacts on their surfaces.

    wanted: number of rows of equalities, motors and limits. The number of rows listed becomes the sixth of
    `ends`, -1 where a row is of another kind.
    """
    at, count = rows.starts, search.counts[4]
    kind, index = rows.kind[at[0] : at[0] + count], rows.ids[at[1] : at[1] + count]
    geom, address = contacts.geom[: search.counts[0]], contacts.address[: search.counts[0]]
    if not choose_trees(
        kind, index, geom, address, mechanism.geom_tree, mechanism.dof_tree, mechanism.joint_dof,
        mechanism.joint_type, mechanism.slot, mechanism.limit_slot, mechanism.equality_tree, wanted, DENSE,
        solver.taken,
    ):  # fmt: skip
        return
    found = order_rows(
        kind, index, geom, address, contacts.dim, mechanism.geom_tree, mechanism.dof_tree,
        mechanism.joint_dof, mechanism.joint_qpos, state.qpos, mechanism.slot, mechanism.limit_slot,
        mechanism.limits, mechanism.equality_slot, mechanism.equality_tree, solver.taken, wanted,
        solver.places, solver.order, solver.ends,
    )  # fmt: skip
    width = state.qvel.shape[0]
    for n in range(found):
        start = at[2] + solver.order[n, 0] * width
        for d in range(width):
            solver.jacobian[n, d] = rows.jacobian[start + d]
    solver.ends[5] = found
    velocity = rows.velocity[at[7] : at[7] + count]
    position = rows.position[at[3] : at[3] + count]
    slide_on_margins(geom, address, contacts, mechanism, state, surface, solver, velocity)
    for n in range(solver.ends[0]):
        row = solver.order[n, 0]
        if kind[row] == 0:
            equality = index[row]
            aux = mechanism.equality_aux[equality]
            if aux >= 0:
                velocity[row] -= solver.jacobian[n, aux] * state.qvel[aux]
                solver.jacobian[n, aux] = 0.0
            if row >= 3 and index[row - 3] == equality:
                axis = 0
                while axis < 2 and row >= 4 + axis and index[row - 4 - axis] == equality:
                    axis += 1
                turn_about_axis(mechanism, state, equality, axis, n, row, solver.jacobian, velocity, position)


def turn_about_axis(  # pragma: no cover
    mechanism, state, equality, axis, n, row, jacobian, velocity, position
):
    """Let a weld's row n hold half the turn about an axis of its first frame, 0 ... 2, as Euler angles.

    MuJoCo's is the imaginary part of a quaternion, in which a torque's bound depends on the angle.
    """
    site_a, site_b = mechanism.equality_site[equality, 0], mechanism.equality_site[equality, 1]
    a, b = state.site_xmat[site_a], state.site_xmat[site_b]
    for d in range(state.qvel.shape[0]):
        jacobian[n, d] = 0.0
    velocity[row] = 0.0
    for side in range(2):
        body = mechanism.site_body[site_a if side == 0 else site_b]
        while body > 0:
            first = mechanism.body_dof[body]
            for d in range(first, first + mechanism.body_dofs[body]):
                turn = 0.0
                for k in range(3):
                    turn += 0.5 * a[3 * k + axis] * state.cdof[d, k]
                if side == 1:
                    turn = -turn
                jacobian[n, d] += turn
                velocity[row] += turn * state.qvel[d]
            body = mechanism.body_parent[body]
    sine = min(max(a[2] * b[0] + a[5] * b[3] + a[8] * b[6], -1.0), 1.0)
    angle = 0.0
    if axis == 1:
        angle = np.arcsin(sine)
    elif abs(sine) < 1.0:
        y = x = 0.0
        for k in range(3):
            if axis == 0:
                y -= a[3 * k + 2] * b[3 * k + 1]
                x += a[3 * k + 2] * b[3 * k + 2]
            else:
                y -= a[3 * k + 1] * b[3 * k]
                x += a[3 * k] * b[3 * k]
        angle = np.arctan2(y, x)
    elif axis == 0:
        y = x = 0.0
        for k in range(3):
            y += a[3 * k] * b[3 * k + 1]
            x += a[3 * k + 1] * b[3 * k + 1]
        angle = np.arctan2(y, x) * sine
    position[row] = 0.5 * angle


def slide_on_margins(  # pragma: no cover
    geom, address, contacts, mechanism, state, surface, solver, velocity
):
    """Move each contact's sliding rows from between MuJoCo's shapes to a point on each of the two surfaces.

    These lie outside the shapes by margins: a wheel whose hull has one rolls on a radius larger by it. The
    rows' velocities change, too.
    """
    jacobian, order, tree, frame = solver.jacobian, solver.order, mechanism.geom_tree, contacts.frame
    n = solver.ends[3]
    for i in range(geom.shape[0]):
        if address[i] < 0 or geom[i, 0] < 0 or geom[i, 1] < 0 or contacts.dim[i] < 3:
            continue
        a, b = tree[geom[i, 0]], tree[geom[i, 1]]
        if not ((a >= 0 and solver.taken[a] == 1) or (b >= 0 and solver.taken[b] == 1)):
            continue
        half = 0.5 * contacts.dist[i]
        for k in range(2):
            t = 3 + 3 * k
            x = frame[i, 1] * frame[i, t + 2] - frame[i, 2] * frame[i, t + 1]
            y = frame[i, 2] * frame[i, t] - frame[i, 0] * frame[i, t + 2]
            z = frame[i, 0] * frame[i, t + 1] - frame[i, 1] * frame[i, t]
            for side in range(2):
                shift = half - surface.margins[geom[i, side]]
                body = mechanism.geom_body[geom[i, side]]
                while body > 0:
                    first = mechanism.body_dof[body]
                    for d in range(first, first + mechanism.body_dofs[body]):
                        more = x * state.cdof[d, 0] + y * state.cdof[d, 1] + z * state.cdof[d, 2]
                        jacobian[n + k, d] += shift * more
                        velocity[order[n + k, 0]] += shift * more * state.qvel[d]
                    body = mechanism.body_parent[body]
        n += 2


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


def accelerate(mechanism, state, surface, solver):  # pragma: no cover
    """Write the forces on degrees of freedom but those of constraints, drag among them, and what they do.

    Does what MuJoCo's `mj_fwdAcceleration` does after `add_damping`, with the forces on links summed up
    along the trees.
    """
    force, wrenches, parent = state.smooth_force, solver.wrenches, mechanism.body_parent
    for d in range(force.shape[0]):
        force[d] = state.passive[d] - state.bias[d] + state.applied[d] + state.actuated[d]
    for b in range(1, parent.shape[0]):
        c = mechanism.body_root[b]
        fx, fy, fz, tx, ty, tz = drag_on(
            b, c, surface.damping, mechanism.mass, mechanism.inertia, state.cvel, state.xipos, state.ximat,
            state.subtree_com,
        )  # fmt: skip
        fx, fy, fz = fx + state.wrench[b, 0], fy + state.wrench[b, 1], fz + state.wrench[b, 2]
        rx = state.xipos[b, 0] - state.subtree_com[c, 0]
        ry = state.xipos[b, 1] - state.subtree_com[c, 1]
        rz = state.xipos[b, 2] - state.subtree_com[c, 2]
        wrenches[b, 0] = tx + state.wrench[b, 3] + ry * fz - rz * fy
        wrenches[b, 1] = ty + state.wrench[b, 4] + rz * fx - rx * fz
        wrenches[b, 2] = tz + state.wrench[b, 5] + rx * fy - ry * fx
        wrenches[b, 3], wrenches[b, 4], wrenches[b, 5] = fx, fy, fz
    for i in range(1, parent.shape[0]):
        b = parent.shape[0] - i
        if parent[b] > 0:
            for k in range(6):
                wrenches[parent[b], k] += wrenches[b, k]
    for d in range(force.shape[0]):
        b = mechanism.dof_body[d]
        for k in range(6):
            force[d] += state.cdof[d, k] * wrenches[b, k]
        state.smooth[d] = force[d]
    solve_inertia(mechanism, state, state.smooth, 0, force.shape[0])


def solve_inertia(mechanism, state, x, start, stop):  # pragma: no cover
    """Divide efforts (nv,) of whole trees, dofs start ... stop, by the inertia: accelerations, in place."""
    for i in range(stop - 1, start - 1, -1):
        if x[i] != 0.0:
            first = mechanism.factor_start[i]
            for a in range(first, first + mechanism.factor_count[i] - 1):
                x[mechanism.factor_column[a]] -= state.factor[a] * x[i]
    for i in range(start, stop):
        x[i] *= state.factor_inverse[i]
        first = mechanism.factor_start[i]
        for a in range(first, first + mechanism.factor_count[i] - 1):
            x[i] -= state.factor[a] * x[mechanism.factor_column[a]]


def solve_inertia_across(mechanism, state, across, blocks):  # pragma: no cover
    """Do what `solve_inertia` does for many efforts at once: across is (nv, n), of whole blocks of rows."""
    nv = state.qvel.shape[0]
    for i in range(nv - 1, -1, -1):
        first = mechanism.factor_start[i]
        for a in range(first, first + mechanism.factor_count[i] - 1):
            add_line(across, mechanism.factor_column[a], across, i, -state.factor[a], blocks)
    for i in range(nv):
        inverse = state.factor_inverse[i]
        for k in range(BLOCK * blocks):
            across[i, k] *= inverse
        first = mechanism.factor_start[i]
        for a in range(first, first + mechanism.factor_count[i] - 1):
            add_line(across, i, across, mechanism.factor_column[a], -state.factor[a], blocks)


def add_line(lines, to, others, line, factor, blocks):
    """Add a multiple of a line to another, of so many blocks of numbers."""
    for k in range(BLOCK * blocks):
        lines[to, k] += factor * others[line, k]


def solve(rows, contacts, search, mechanism, state, surface, solver):  # pragma: no cover
    """Write what each row asks for and solve the rows in turn; see `set_goals` and `solve_in_turn`."""
    at, count, rules = rows.starts, search.counts[4], solver.rules
    order, ends, goals, jacobian = solver.order, solver.ends, solver.goals, solver.jacobian
    tree_dof, tree_dofs, timestep = mechanism.tree_dof, mechanism.tree_dofs, rules[TIMESTEP]
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
        state.qpos, state.qvel, state.smooth, jacobian, ends, tree_dof, tree_dofs, mechanism.equality_bound,
        mechanism.equality_share, mechanism.equality_aux, rules[ERP], rules[SLOW], timestep, goals,
    )  # fmt: skip
    listed = ends[4]
    if listed <= DENSE:
        blocks = (listed + BLOCK - 1) // BLOCK
        across = solver.across
        for d in range(across.shape[0]):
            for k in range(BLOCK * blocks):
                across[d, k] = 0.0
        for n in range(listed):
            for side in range(1, 3):
                tree = order[n, side]
                if tree >= 0:
                    for d in range(tree_dof[tree], tree_dof[tree] + tree_dofs[tree]):
                        across[d, n] = jacobian[n, d]
        solve_inertia_across(mechanism, state, across, blocks)
        solve_by_table(
            order, goals, ends, jacobian, across, tree_dof, tree_dofs, rules[ROUNDS], rules[RESIDUAL],
            solver.influence, solver.lines, solver.change,
        )  # fmt: skip
    else:
        response = solver.response
        for n in range(listed):
            for side in range(1, 3):
                tree = order[n, side]
                if tree >= 0:
                    first, last = tree_dof[tree], tree_dof[tree] + tree_dofs[tree]
                    for d in range(first, last):
                        response[n, d] = jacobian[n, d]
                    solve_inertia(mechanism, state, response[n], first, last)
        solve_in_turn(
            order, goals, ends, jacobian, response, tree_dof, tree_dofs, rules[ROUNDS], rules[RESIDUAL],
            solver.own, solver.step, solver.change,
        )  # fmt: skip
    if listed == count:
        for dof in range(state.qacc.shape[0]):
            state.qacc[dof] = state.smooth[dof]  # of trees that nothing holds
            state.constraint[dof] = 0.0
        write_rows(
            order, goals, ends, jacobian, solver.change, state.smooth, solver.taken, mechanism.dof_tree,
            tree_dof, tree_dofs, timestep, state.qacc, force, state.constraint,
        )  # fmt: skip


def solve_in_turn(  # pragma: no cover
    rows, goals, ends, jacobian, response, tree_dof, tree_dofs, rounds, residual, own, step, change
):
    """Solve row by row, each with the changes of velocity that the others have made, in several rounds.

    Motors and limits are taken backwards and forwards by turns. Rounds end when no row changes its velocity
    by more than the root of the residual, or after `rounds`: motors of joints with nearly parallel axes, or
    at their largest impulse, have not converged by then. The two sliding rows of a contact share one bound,
    the normal's impulse in this round times the coefficient. Returns the number of rounds.

    response: (n, nv) changes of velocity by unit impulses. own: (n,) and step: (2,) or longer, work arrays.
    change: (nv,) change of velocity, written.
    """
    for d in range(change.shape[0]):
        change[d] = 0.0
    for n in range(ends[4]):
        total = 0.0
        for side in range(1, 3):
            tree = rows[n, side]
            if tree >= 0:
                for d in range(tree_dof[tree], tree_dof[tree] + tree_dofs[tree]):
                    total += jacobian[n, d] * response[n, d]
        own[n] = total + goals[n, 4]
    done = 0.0
    while done < rounds:
        worst = 0.0
        n = 0
        while n < ends[4]:
            at = n
            size = 1
            if n < ends[0] and done % 2.0 == 0.0:
                at = ends[0] - 1 - n
            elif n >= ends[2]:
                size = 2
            n += size
            bound = 0.0
            if at >= ends[1]:
                pressed = goals[rows[at, 3], 3]
                if pressed <= 0.0 and at < ends[3]:
                    continue
                bound = goals[at, 2] * max(pressed, 0.0)
            for k in range(size):
                m = at + k
                speed = 0.0
                for side in range(1, 3):
                    tree = rows[m, side]
                    if tree >= 0:
                        for d in range(tree_dof[tree], tree_dof[tree] + tree_dofs[tree]):
                            speed += jacobian[m, d] * change[d]
                step[k] = goals[m, 3]
                if own[m] > 1e-15:
                    step[k] += (goals[m, 0] - goals[m, 4] * goals[m, 3] - speed) / own[m]
            if size == 2:
                length = np.sqrt(step[0] * step[0] + step[1] * step[1])
                if length > bound:
                    step[0] *= bound / length
                    step[1] *= bound / length
            elif at >= ends[1]:
                step[0] = min(max(step[0], -bound), bound)
            else:
                step[0] = min(max(step[0], goals[at, 1]), goals[at, 2])
            for k in range(size):
                m = at + k
                delta = step[k] - goals[m, 3]
                goals[m, 3] = step[k]
                for side in range(1, 3):
                    tree = rows[m, side]
                    if tree >= 0:
                        for d in range(tree_dof[tree], tree_dof[tree] + tree_dofs[tree]):
                            change[d] += delta * response[m, d]
                worst = max(worst, (delta * own[m]) ** 2)
        done += 1.0
        if worst <= residual:
            break
    return done


def solve_by_table(  # pragma: no cover
    rows, goals, ends, jacobian, across, tree_dof, tree_dofs, rounds, residual, influence, lines, change
):
    """Do what `solve_in_turn` does, for a bounded number of rows, with their effect on each other.

    What a row wishes for, the impulse with which it would get what it asks for, is kept up to date.

    across: (nv, n) changes of velocity by unit impulses, n rounded up to whole blocks. influence: (n, n) or
    larger, what unit impulses of a row take from the wishes of the others, written. lines: (6, n) or longer,
    work array.
    """
    count = ends[4]
    blocks = (count + BLOCK - 1) // BLOCK
    for n in range(count):
        for k in range(BLOCK * blocks):
            influence[n, k] = 0.0
        for side in range(1, 3):
            tree = rows[n, side]
            if tree >= 0:
                for d in range(tree_dof[tree], tree_dof[tree] + tree_dofs[tree]):
                    if jacobian[n, d] != 0.0:
                        add_line(influence, n, across, d, jacobian[n, d], blocks)
        own = influence[n, n] + goals[n, 4]
        lines[OWN, n] = own
        lines[INVERSE, n] = 1.0 / own if own > 1e-15 else 0.0
        lines[WISH, n] = goals[n, 0] * lines[INVERSE, n]
        lines[LOW, n], lines[HIGH, n], lines[IMPULSE, n] = goals[n, 1], goals[n, 2], 0.0
    for k in range(count, BLOCK * blocks):
        lines[INVERSE, k] = lines[WISH, k] = 0.0
    for n in range(count):
        for k in range(BLOCK * blocks):
            influence[n, k] *= lines[INVERSE, k]
        influence[n, n] = 0.0
    done = 0.0
    while done < rounds:
        if done % 2.0 == 1.0:
            worst = push_each(lines, influence, 0, ends[0], 1, blocks)
        else:
            worst = push_each(lines, influence, ends[0] - 1, ends[0], -1, blocks)
        worst = max(worst, push_each(lines, influence, ends[0], ends[1] - ends[0], 1, blocks))
        for n in range(ends[1], ends[2]):
            bound = lines[HIGH, n] * max(lines[IMPULSE, rows[n, 3]], 0.0)
            if bound > 0.0:
                impulse = min(max(lines[WISH, n], -bound), bound)
                worst = max(worst, push(lines, influence, n, impulse, blocks))
        if ends[2] < count:
            worst = max(worst, push_pairs(lines, influence, rows, ends[2], ends[3], count, blocks))
        done += 1.0
        if worst <= residual:
            break
    for n in range(count):
        goals[n, 3] = lines[IMPULSE, n]
    for d in range(change.shape[0]):
        total = 0.0
        for n in range(count):
            total += lines[IMPULSE, n] * across[d, n]
        change[d] = total
    return done


def push(lines, influence, n, impulse, blocks):
    """Set a row's impulse; return the square of the change of its velocity."""
    delta = impulse - lines[IMPULSE, n]
    if delta == 0.0:
        return 0.0
    lines[IMPULSE, n] = impulse
    add_line(lines, WISH, influence, n, -delta, blocks)
    delta *= lines[OWN, n]
    return delta * delta


def push_each(lines, influence, first, count, step, blocks):
    """Set the impulses of so many rows within their bounds, one after the other; return the largest change.

    A row's wish is known once those of the rows before it are in it. The processor would wait for each to be
    written to memory and read again; so the next two wishes are kept besides.
    """
    worst = 0.0
    if count <= 0:
        return worst
    n = first
    wish = lines[WISH, n]
    following = lines[WISH, n + step] if count > 1 else 0.0
    for i in range(count):
        old = lines[IMPULSE, n]
        impulse = min(max(wish, lines[LOW, n]), lines[HIGH, n])
        delta = impulse - old
        after = n + 2 * step if i + 2 < count else n
        coming = lines[WISH, after] - delta * influence[n, after]
        wish = following - delta * influence[n, n + step if i + 1 < count else n]
        following = coming
        if delta != 0.0:
            lines[IMPULSE, n] = impulse
            add_line(lines, WISH, influence, n, -delta, blocks)
            delta *= lines[OWN, n]
            worst = max(worst, delta * delta)
        n += step
    return worst


def push_pairs(lines, influence, rows, first, sliding, stop, blocks):
    """Do what `push_each` does for pairs of friction rows, which share a bound, of the last ones slid."""
    worst = 0.0
    x, y = lines[WISH, first], lines[WISH, first + 1]
    for n in range(first, stop, 2):
        after = n + 2 if n + 2 < stop else n
        next_x, next_y = lines[WISH, after], lines[WISH, after + 1]
        bound = lines[HIGH, n] * max(lines[IMPULSE, rows[n, 3]], 0.0)
        if bound > 0.0 or n >= sliding:
            square = x * x + y * y
            if square > bound * bound:
                factor = bound / np.sqrt(square)
                x *= factor
                y *= factor
                lines[CUT, n] = factor  # without a store LLVM takes the root of rows that do not slide, too
            x -= lines[IMPULSE, n]
            y -= lines[IMPULSE, n + 1]
            if x != 0.0 or y != 0.0:
                next_x -= x * influence[n, after] + y * influence[n + 1, after]
                next_y -= x * influence[n, after + 1] + y * influence[n + 1, after + 1]
                lines[IMPULSE, n] += x
                lines[IMPULSE, n + 1] += y
                for k in range(BLOCK * blocks):
                    lines[WISH, k] -= x * influence[n, k] + y * influence[n + 1, k]
                worst = max(worst, max((x * lines[OWN, n]) ** 2, (y * lines[OWN, n + 1]) ** 2))
        x, y = next_x, next_y
    return worst


def write_rows(
    rows, goals, ends, jacobian, change, smooth, taken, dof_tree, tree_dof, tree_dofs, timestep, qacc, force,
    constraint,
):  # fmt: skip
    """Write accelerations, forces of rows and constraint forces of dofs of the chosen trees."""
    for dof in range(qacc.shape[0]):
        if taken[dof_tree[dof]] == 1:
            qacc[dof] = smooth[dof] + change[dof] / timestep
            constraint[dof] = 0.0
    for n in range(ends[4]):
        value = goals[n, 3] / timestep
        force[rows[n, 0]] = value
        for side in range(1, 3):
            tree = rows[n, side]
            if tree >= 0:
                for d in range(tree_dof[tree], tree_dof[tree] + tree_dofs[tree]):
                    constraint[d] += jacobian[n, d] * value


@compiled(
    "i4[:,::1] f8[:,::1] i4[::1] f8[:,::1] f8[::1] f8[::1] u1[::1] i4[::1] i4[::1] i4[::1] f8 f8[::1]"
    " f8[::1] f8[::1]"
)
def write_solution(  # pragma: no cover
    rows, goals, ends, jacobian, change, smooth, taken, dof_tree, tree_dof, tree_dofs, timestep, qacc, force,
    constraint,
):  # fmt: skip
    """Write the solution over that of MuJoCo's solver; see `write_rows`."""
    write_rows(
        rows, goals, ends, jacobian, change, smooth, taken, dof_tree, tree_dof, tree_dofs, timestep, qacc,
        force, constraint,
    )  # fmt: skip
