"""Dividing efforts by the inertia of kinematic trees, and the accelerations by forces alone."""

from __future__ import annotations

from roboyard.sim.stepping.impulses.records import BLOCK
from roboyard.sim.stepping.kernels import drag_on


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
    solve_inertia(mechanism, state, state.smooth, 0, force.shape[0], 0)


def solve_inertia(mechanism, state, x, start, stop, place):  # pragma: no cover
    """Divide efforts of whole trees, dofs start ... stop, by the inertia: accelerations, in place.

    place: of the effort of dof `start` in x; those of the others follow.
    """
    shift = place - start
    for i in range(stop - 1, start - 1, -1):
        if x[shift + i] != 0.0:
            first = mechanism.factor_start[i]
            for a in range(first, first + mechanism.factor_count[i] - 1):
                x[shift + mechanism.factor_column[a]] -= state.factor[a] * x[shift + i]
    for i in range(start, stop):
        x[shift + i] *= state.factor_inverse[i]
        first = mechanism.factor_start[i]
        for a in range(first, first + mechanism.factor_count[i] - 1):
            x[shift + i] -= state.factor[a] * x[shift + mechanism.factor_column[a]]


def find_diagonal(mechanism, state, trees):  # pragma: no cover
    """Write 1 into `trees` (ntree,) for those whose inertia is diagonal in this position, else 0.

    That of a free body is where its frame is that of its principal axes at its centre of mass.
    """
    for tree in range(trees.shape[0]):
        is_diagonal = 1
        first = mechanism.tree_dof[tree]
        for i in range(first, first + mechanism.tree_dofs[tree]):
            start = mechanism.factor_start[i]
            for a in range(start, start + mechanism.factor_count[i] - 1):
                if state.factor[a] != 0.0:
                    is_diagonal = 0
        trees[tree] = is_diagonal


def respond(mechanism, state, is_diagonal, jacobian, response, first, size, place):  # pragma: no cover
    """Write what a unit of a row's impulse changes in the velocities of a tree, dofs first ... first + size.

    jacobian, response: the row's entries, those of the tree from `place` on.
    """
    if is_diagonal == 1:
        for k in range(size):
            response[place + k] = jacobian[place + k] * state.factor_inverse[first + k]
        return
    for k in range(size):
        response[place + k] = jacobian[place + k]
    solve_inertia(mechanism, state, response, first, first + size, place)


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
