"""Compiled loops that solve the rows of a step one after the other, as an impulse solver does."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.sim.stepping.impulses.entries import add_to
from roboyard.sim.stepping.impulses.inertia import (
    add_line,
    change_velocities,
    find_roots,
    scale,
    scale_across,
)
from roboyard.sim.stepping.impulses.lanes import solve_in_turn
from roboyard.sim.stepping.impulses.records import (
    BLOCK,
    CUT,
    DENSE,
    ERP,
    FEW,
    HIGH,
    IMPULSE,
    INVERSE,
    LOW,
    OWN,
    RESIDUAL,
    ROUNDS,
    SHORT,
    SLOW,
    TIMESTEP,
    WISH,
)
from roboyard.sim.stepping.impulses.rows import contact_rows, set_goals


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
    listed = ends[4]
    entries = 0
    for n in range(listed):
        entries += spans[n, 1] + spans[n, 3]
    roots, plain = solver.roots, solver.diagonal
    bent = find_roots(mechanism, state, roots, plain)
    if listed <= FEW or (listed <= DENSE and entries > SHORT * listed):
        blocks = (listed + BLOCK - 1) // BLOCK
        across = solver.across
        for d in range(across.shape[0]):
            for k in range(BLOCK * blocks):
                across[d, k] = 0.0
        for n in range(listed):
            first, size, other = spans[n, 0], spans[n, 1], spans[n, 2]
            for k in range(size):
                across[first + k, n] = jacobian[n, k]
            for k in range(spans[n, 3]):
                across[other + k, n] = jacobian[n, size + k]
        scale_across(mechanism, state, roots, across, blocks)
        solve_by_table(
            order, spans, goals, ends, solver.parts, across, rules[ROUNDS], rules[RESIDUAL], solver.influence,
            solver.lines, solver.change,
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
            solver.velocities, rules[ROUNDS], rules[RESIDUAL], solver.change,
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


def solve_by_table(  # pragma: no cover
    rows, spans, goals, ends, parts, across, rounds, residual, influence, lines, change
):
    """Do what `solve_in_turn` does, for a bounded number of rows, with their effect on each other.

    What a row wishes for, the impulse with which it would get what it asks for, is kept up to date.

    across: (nv, n) scaled entries of the rows, n rounded up to whole blocks. influence: (n, n) or
    larger, what unit impulses of a row take from the wishes of the others, written. lines: (6, n) or longer,
    work array.
    """
    count = ends[4]
    blocks = (count + BLOCK - 1) // BLOCK
    for n in range(count):
        for k in range(BLOCK * blocks):
            influence[n, k] = 0.0
        first, size, other = spans[n, 0], spans[n, 1], spans[n, 2]
        for k in range(size + spans[n, 3]):
            d = first + k if k < size else other + k - size
            if across[d, n] != 0.0:
                add_line(influence, n, across, d, across[d, n], blocks)
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
    most = 0.0
    for part in range(parts[parts.shape[0] - 1, 0]):
        done = 0.0
        joints, joints_end = parts[part, 0], parts[part, 1]
        normals, normals_end = parts[part, 2], parts[part, 3]
        rolling, rolling_end = parts[part, 6], parts[part, 7]
        sliding, sliding_end = parts[part, 8], parts[part, 9]
        while done < rounds:
            if done % 2.0 == 1.0:
                worst = push_each(lines, influence, joints, joints_end - joints, 1, blocks)
            else:
                worst = push_each(lines, influence, joints_end - 1, joints_end - joints, -1, blocks)
            worst = max(worst, push_each(lines, influence, normals, normals_end - normals, 1, blocks))
            for n in range(parts[part, 4], parts[part, 5]):
                bound = lines[HIGH, n] * max(lines[IMPULSE, rows[n, 3]], 0.0)
                if bound > 0.0:
                    impulse = min(max(lines[WISH, n], -bound), bound)
                    worst = max(worst, push(lines, influence, n, impulse, blocks))
            if rolling < rolling_end:
                worst = max(worst, push_pairs(lines, influence, rows, rolling, ends[3], rolling_end, blocks))
            if sliding < sliding_end:
                worst = max(worst, push_pairs(lines, influence, rows, sliding, ends[3], sliding_end, blocks))
            done += 1.0
            if worst <= residual:
                break
        most = max(most, done)
    for n in range(count):
        goals[n, 3] = lines[IMPULSE, n]
    for d in range(change.shape[0]):
        total = 0.0
        for n in range(count):
            total += lines[IMPULSE, n] * across[d, n]
        change[d] = total
    return most


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
                both = x * lines[OWN, n] + y * lines[OWN, n + 1]  # added up, as Bullet does
                worst = max(worst, both * both)
        x, y = next_x, next_y
    return worst


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
