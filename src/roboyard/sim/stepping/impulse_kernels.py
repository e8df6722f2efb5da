"""Compiled loops that solve the constraints of robots one after the other, as an impulse solver does."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.sim.stepping.impulse_rows import choose_trees, contact_rows, order_rows, set_goals


@compiled(
    "i4[::1] i4[::1] i4[:,:] i4[:] i4[:] i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] f8[::1] i4[::1] i4[::1]"
    " f8[:,::1] i8 i8 u1[::1] i4[::1] i4[:,::1] i4[::1] f8[::1] f8[:,::1] -> f8"
)
def arrange(  # pragma: no cover
    kind, index, geom, address, dim, geom_tree, dof_tree, joint_dof, joint_type, joint_qpos, qpos, slot,
    limit_slot, limits, count, dense, taken, places, rows, ends, every, jacobian,
):  # fmt: skip
    """Choose the trees to solve, list their rows and copy their Jacobian.

    every: (nefc nv,) Jacobian of all rows. jacobian: (n, nv) of the rows listed, written. The rest is that of
    `choose_trees` and `order_rows`. Returns the number of rows, -1 where a row is of another kind.
    """
    if not choose_trees(
        kind, index, geom, address, geom_tree, dof_tree, joint_dof, joint_type, slot, limit_slot, count,
        dense, taken,
    ):  # fmt: skip
        return -1.0
    found = order_rows(
        kind, index, geom, address, dim, geom_tree, dof_tree, joint_dof, joint_qpos, qpos, slot, limit_slot,
        limits, taken, count, places, rows, ends,
    )  # fmt: skip
    width = jacobian.shape[1]
    for n in range(found):
        start = rows[n, 0] * width
        for d in range(width):
            jacobian[n, d] = every[start + d]
    return found


@compiled(
    "i4[:,::1] i4[::1] i4[::1] f8[::1] f8[::1] f8[::1] f8[::1] i4[::1] i4[::1] i4[::1] f8[:,::1] f8[:,::1]"
    " f8[::1] f8[::1] f8[::1] f8[:,::1] f8[:,::1] i4[::1] i4[::1] i4[::1] f8[:,::1] f8[::1] f8[::1]"
    " i4[:,:] i4[:] i4[:] f8[:,:] f8[:,::1] f8[::1] f8[::1] f8[:,::1] f8[::1] f8[::1] u1[::1] i4[::1]"
    " f8[::1] f8[::1] f8[::1] f8 i8 f8 i8",
    fast_math=True,
)
def solve(  # pragma: no cover
    rows, kind, index, velocity, aref, base, loss, dof_joint, joint_type, joint_qpos, motors, targets, qpos,
    qvel, smooth, jacobian, response, ends, tree_dof, tree_dofs, goals, mu, soft, geom, address, dim,
    friction, compliance, R, own, influence, step, change, taken, dof_tree, qacc, force, constraint, timestep,
    rounds, residual, alone,
):  # fmt: skip
    """Write what each row asks for and solve the rows in turn; see `set_goals` and `solve_in_turn`.

    alone: 1 where these are all rows; the solution is written then.
    """
    contact_rows(geom, address, dim, friction, compliance, R, mu, soft)
    set_goals(
        rows, kind, index, velocity, aref, base, loss, mu, soft, dof_joint, joint_type, joint_qpos, motors,
        targets, qpos, qvel, smooth, jacobian, ends, tree_dof, tree_dofs, timestep, goals,
    )  # fmt: skip
    if ends[4] <= influence.shape[0]:
        solve_by_table(
            rows, goals, ends, jacobian, response, tree_dof, tree_dofs, rounds, residual, own, influence,
            step, change,
        )  # fmt: skip
    else:
        solve_in_turn(
            rows, goals, ends, jacobian, response, tree_dof, tree_dofs, rounds, residual, own, step, change
        )
    if alone == 1:
        for dof in range(qacc.shape[0]):
            qacc[dof] = smooth[dof]  # of trees that nothing holds
            constraint[dof] = 0.0
        write_rows(
            rows, goals, ends, jacobian, change, smooth, taken, dof_tree, tree_dof, tree_dofs, timestep, qacc,
            force, constraint,
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
