"""Compiled loops that solve the constraints of robots one after the other, as an impulse solver does."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.sim.stepping.impulse_rows import choose_trees, contact_rows, order_rows, set_goals
from roboyard.sim.stepping.kernels import compliant_contacts, hard_contacts, hard_limits, product_friction
from roboyard.sim.stepping.step_row_kernels import CONTACTS, ROWS


@compiled(
    ROWS,
    CONTACTS,
    "i8 i8 i8 i8 i4[:,::1] f8[:,::1]",
    "i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] f8[::1] i4[::1] i4[::1] f8[:,::1] i8 u1[::1] i4[::1] i4[::1] i8",
    "-> i8",
)
def arrange(  # pragma: no cover
    rows, contacts, contact_count, motors, limit_count, count, order, jacobian, geom_tree, dof_tree,
    joint_dof, joint_type, joint_qpos, qpos, slot, limit_slot, limits, dense, taken, places, ends, width,
):  # fmt: skip
    """Choose the trees to solve, list their rows and copy their Jacobian.

    rows, contacts: of the step. contact_count: number of contacts. motors, limit_count, count: numbers of
    rows of dry friction, of limits and of all. order: rows in the order of solution, written. jacobian:
    (n, nv) of the rows listed, written; width is nv. The rest is that of `choose_trees` and `order_rows`.
    Returns the number of rows, -1 where a row is of another kind.
    """
    at = rows.starts
    kind, index = rows.kind[at[0] : at[0] + count], rows.ids[at[1] : at[1] + count]
    geom, address = contacts.geom[:contact_count], contacts.address[:contact_count]
    if not choose_trees(
        kind, index, geom, address, geom_tree, dof_tree, joint_dof, joint_type, slot, limit_slot,
        motors + limit_count, dense, taken,
    ):  # fmt: skip
        return -1
    found = order_rows(
        kind, index, geom, address, contacts.dim, geom_tree, dof_tree, joint_dof, joint_qpos, qpos, slot,
        limit_slot, limits, taken, motors + limit_count, places, order, ends,
    )  # fmt: skip
    for n in range(found):
        start = at[2] + order[n, 0] * width
        for d in range(width):
            jacobian[n, d] = rows.jacobian[start + d]
    return found


@compiled(
    ROWS,
    CONTACTS,
    "i8 i8 i8 i8 f8[:,:] f8[:] f8[:,:] f8[:] f8[:] f8[:] f8 f8 f8 f8 f8 i8 i8",
)
def ask_of_rows(  # pragma: no cover
    rows, contacts, contact_count, motors, limit_count, count, coefficients, restitution, compliance, margins,
    reaches, base, timestep, erp, contact_erp, deep, slow, is_product, is_compliant,
):  # fmt: skip
    """Write what limits and contacts ask for, where no row is left to MuJoCo's solver.

    Does what `hard_limits`, `product_friction`, `hard_contacts` and `compliant_contacts` do, the second and
    the last where is_product and is_compliant are 1. contact_count, motors, limit_count, count: as of
    `arrange`.
    """
    at = rows.starts
    velocity = rows.velocity[at[7] : at[7] + count]
    reference = rows.reference[at[8] : at[8] + count]
    if limit_count > 0:
        kind, position = rows.kind[at[0] : at[0] + count], rows.position[at[3] : at[3] + count]
        hard_limits(kind, position, velocity, motors, limit_count, timestep, erp, deep, reference)
    if contact_count > 0:
        R, D = rows.R[at[5] : at[5] + count], rows.D[at[6] : at[6] + count]
        geom, address = contacts.geom[:contact_count], contacts.address[:contact_count]
        dim, dist, friction, mu = contacts.dim, contacts.dist, contacts.friction, contacts.mu
        if is_product == 1:
            product_friction(coefficients, geom, dim, address, friction, mu, R, D)
        hard_contacts(
            restitution, geom, dim, address, dist, friction, velocity, timestep, contact_erp, slow, base,
            reference, R, D, margins, reaches, contacts.position, contacts.frame,
        )  # fmt: skip
        if is_compliant == 1:
            compliant_contacts(
                compliance, geom, dim, address, dist, friction, mu, timestep, contact_erp, base, reference, R,
                D,
            )  # fmt: skip


@compiled(
    ROWS,
    CONTACTS,
    "i8 i8 i8 f8 i8 f8 f8[:,::1] f8[:,::1]",
    "i4[:,::1] f8[::1] i4[::1] i4[::1] i4[::1] f8[:,::1] f8[:,::1] f8[::1] f8[::1] f8[::1] i4[::1] i4[::1]",
    "i4[::1] f8[:,::1] f8[::1] f8[::1] f8[:,::1] f8[::1] f8[:,::1] f8[::1] f8[::1] u1[::1] i4[::1] f8[::1]",
    "f8[::1]",
    fast_math=True,
)
def solve(  # pragma: no cover
    rows, contacts, contact_count, count, alone, timestep, rounds, residual, jacobian, response, order, base,
    dof_joint, joint_type, joint_qpos, motors, targets, qpos, qvel, smooth, ends, tree_dof, tree_dofs, goals,
    mu, soft, compliance, own, influence, step, change, taken, dof_tree, qacc, constraint,
):  # fmt: skip
    """Write what each row asks for and solve the rows in turn; see `set_goals` and `solve_in_turn`.

    rows, contacts, contact_count, count, order: as of `arrange`. alone: 1 where these are all rows; the
    solution is written then.
    """
    at = rows.starts
    kind, index = rows.kind[at[0] : at[0] + count], rows.ids[at[1] : at[1] + count]
    loss, R = rows.loss[at[4] : at[4] + count], rows.R[at[5] : at[5] + count]
    velocity = rows.velocity[at[7] : at[7] + count]
    reference, force = rows.reference[at[8] : at[8] + count], rows.force[at[9] : at[9] + count]
    geom, address = contacts.geom[:contact_count], contacts.address[:contact_count]
    contact_rows(geom, address, contacts.dim, contacts.friction, compliance, R, mu, soft)
    set_goals(
        order, kind, index, velocity, reference, base, loss, mu, soft, dof_joint, joint_type, joint_qpos,
        motors, targets, qpos, qvel, smooth, jacobian, ends, tree_dof, tree_dofs, timestep, goals,
    )  # fmt: skip
    if ends[4] <= influence.shape[0]:
        solve_by_table(
            order, goals, ends, jacobian, response, tree_dof, tree_dofs, rounds, residual, own, influence,
            step, change,
        )  # fmt: skip
    else:
        solve_in_turn(
            order, goals, ends, jacobian, response, tree_dof, tree_dofs, rounds, residual, own, step, change
        )
    if alone == 1:
        for dof in range(qacc.shape[0]):
            qacc[dof] = smooth[dof]  # of trees that nothing holds
            constraint[dof] = 0.0
        write_rows(
            order, goals, ends, jacobian, change, smooth, taken, dof_tree, tree_dof, tree_dofs, timestep,
            qacc, force, constraint,
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
    for turn in range(rounds):
        worst = 0.0
        n = 0
        while n < ends[4]:
            at = n
            size = 1
            if n < ends[0] and turn % 2 == 0:
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


def solve_by_table(
    rows, goals, ends, jacobian, response, tree_dof, tree_dofs, rounds, residual, own, influence, speeds,
    change,
):  # fmt: skip
    """Do what `solve_in_turn` does, for a bounded number of rows, with their effect on each other.

    influence: (n, n) or larger, change of each row's velocity by unit impulses of the others, written. own,
    speeds: (n,) or longer, work arrays. The sixth column of goals is one, too.
    """
    count = ends[4]
    for n in range(count):
        speeds[n] = 0.0
        for k in range(n + 1):
            influence[n, k] = 0.0
        for side in range(1, 3):
            tree = rows[n, side]
            if tree >= 0:
                for d in range(tree_dof[tree], tree_dof[tree] + tree_dofs[tree]):
                    part = jacobian[n, d]
                    if part != 0.0:
                        for k in range(n + 1):
                            influence[n, k] += part * response[k, d]
        for k in range(n):
            influence[k, n] = influence[n, k]
        own[n] = influence[n, n] + goals[n, 4]
        goals[n, 5] = 1.0 / own[n] if own[n] > 1e-15 else 0.0
    done = 0.0
    for turn in range(rounds):
        worst = 0.0
        for i in range(ends[1]):
            n = ends[0] - 1 - i if i < ends[0] and turn % 2 == 0 else i
            delta = min(max(wished(goals, speeds, n), goals[n, 1]), goals[n, 2]) - goals[n, 3]
            worst = max(worst, push(goals, speeds, own, influence, n, delta, count))
        for n in range(ends[1], ends[2]):
            bound = goals[n, 2] * max(goals[rows[n, 3], 3], 0.0)
            if bound > 0.0:
                delta = min(max(wished(goals, speeds, n), -bound), bound) - goals[n, 3]
                worst = max(worst, push(goals, speeds, own, influence, n, delta, count))
        for n in range(ends[2], count, 2):
            bound = goals[n, 2] * max(goals[rows[n, 3], 3], 0.0)
            if bound <= 0.0 and n < ends[3]:
                continue
            x, y = wished(goals, speeds, n), wished(goals, speeds, n + 1)
            length = np.sqrt(x * x + y * y)
            if length > bound:
                x *= bound / length
                y *= bound / length
            x, y = x - goals[n, 3], y - goals[n + 1, 3]
            if x != 0.0 or y != 0.0:
                goals[n, 3] += x
                goals[n + 1, 3] += y
                for k in range(count):
                    speeds[k] += x * influence[n, k] + y * influence[n + 1, k]
                worst = max(worst, max((x * own[n]) ** 2, (y * own[n + 1]) ** 2))
        done += 1.0
        if worst <= residual:
            break
    for d in range(change.shape[0]):
        change[d] = 0.0
    for n in range(count):
        for side in range(1, 3):
            tree = rows[n, side]
            if tree >= 0:
                for d in range(tree_dof[tree], tree_dof[tree] + tree_dofs[tree]):
                    change[d] += goals[n, 3] * response[n, d]
    return done


def wished(goals, speeds, n):
    """Impulse with which a row would get what it asks for."""
    return goals[n, 3] + (goals[n, 0] - goals[n, 4] * goals[n, 3] - speeds[n]) * goals[n, 5]


def push(goals, speeds, own, influence, n, delta, count):
    """Add to a row's impulse; return the square of the change of its velocity."""
    if delta == 0.0:
        return 0.0
    goals[n, 3] += delta
    for k in range(count):
        speeds[k] += delta * influence[n, k]
    return (delta * own[n]) ** 2


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
