"""Effects on each other of links that a spherical joint joins, through their tree, in linear time.

Spatial vectors are MuJoCo's: turns, then moves, about one point for the whole tree, so that nothing has to be
moved from link to link.

Source:
    Featherstone, Rigid Body Dynamics Algorithms (2008), section 7.3: the inertia I of a link, as its
    descendants hang on it, loses U U' / D at each degree of freedom s, with U = I s and D = s' U. What an
    impulse on the parent changes reaches the link by L = 1 - s U' / D; on the link itself, s s' / D is added.
"""

from __future__ import annotations

BALL = 1
"""MuJoCo's type of this joint."""
SIZE = 6
"""Numbers of a spatial vector."""


def note_neighbours(rows, kind, index, mechanism, state, solver, friction):  # pragma: no cover
    """Write what both links of motors of spherical joints give each other, for which Bullet does not allow.

    It divides by the sum of what an impulse on each link changes in the velocity of that link alone. kind,
    index: type and degree of freedom of each row. friction: type of the rows of motors.
    """
    has_any = False
    for n in range(solver.ends[0]):
        row = rows[n, 0]
        has_any = has_any or (kind[row] == friction and is_ball(mechanism, index[row]))
    if not has_any:
        return
    trees = solver.slots
    for tree in range(trees.shape[0]):
        trees[tree] = 0
    for joint in range(mechanism.joint_type.shape[0]):
        if mechanism.joint_type[joint] == BALL:
            trees[mechanism.dof_tree[mechanism.joint_dof[joint]]] = 1
    gather_inertias(mechanism, state, solver, trees)
    spread_impulses(mechanism, state, solver, trees)
    for n in range(solver.ends[0]):
        row = rows[n, 0]
        if kind[row] == friction and is_ball(mechanism, index[row]):
            solver.goals[n, 5] -= 2.0 * solver.neighbours[index[row], SIZE + 1]


def is_ball(mechanism, dof):
    """Return whether a degree of freedom is of a spherical joint."""
    return mechanism.joint_type[mechanism.dof_joint[dof]] == BALL


def gather_inertias(mechanism, state, solver, trees):  # pragma: no cover
    """Write U and D of each degree of freedom, from the last links on; see the source."""
    links, dofs, parent = solver.links, solver.neighbours, mechanism.body_parent
    for b in range(1, parent.shape[0]):
        if is_in(mechanism, trees, b):
            write_inertia(links, b, state.link_inertia)
    for i in range(1, parent.shape[0]):
        b = parent.shape[0] - i
        if not is_in(mechanism, trees, b):
            continue
        first = mechanism.body_dof[b]
        for d in range(first + mechanism.body_dofs[b] - 1, first - 1, -1):
            total = mechanism.armature[d]
            for j in range(SIZE):
                product = 0.0
                for k in range(SIZE):
                    product += links[b, SIZE * j + k] * state.cdof[d, k]
                dofs[d, j] = product
                total += product * state.cdof[d, j]
            dofs[d, SIZE] = total
            for j in range(SIZE):
                for k in range(SIZE):
                    links[b, SIZE * j + k] -= dofs[d, j] * dofs[d, k] / total
        p = parent[b]
        if p > 0 and is_in(mechanism, trees, p):
            for k in range(SIZE * SIZE):
                links[p, k] += links[b, k]


def spread_impulses(mechanism, state, solver, trees):  # pragma: no cover
    """Write what unit impulses on links change in their own velocities, and on parents for spherical joints.

    Over the inertias, from the first links on. Of a degree of freedom of a spherical joint the last number is
    the change of the link's turn about its axis by an angular impulse on the parent about the same axis.
    """
    links, dofs, parent = solver.links, solver.neighbours, mechanism.body_parent
    of_parent, work = solver.pair[:36], solver.pair[36:]
    for b in range(1, parent.shape[0]):
        if not is_in(mechanism, trees, b):
            continue
        p = parent[b]
        has_parent = p > 0 and is_in(mechanism, trees, p)
        for k in range(SIZE * SIZE):
            links[b, k] = of_parent[k] = links[p, k] if has_parent else 0.0
        first = mechanism.body_dof[b]
        for d in range(first, first + mechanism.body_dofs[b]):
            lead_rows(of_parent, work, 0, dofs, d, state.cdof)
            lead(links, b, work, dofs, d, state.cdof)
        for d in range(first, first + mechanism.body_dofs[b]):
            if not is_ball(mechanism, d):
                continue
            total = 0.0
            for j in range(3):
                for k in range(3):
                    total += state.cdof[d, j] * of_parent[SIZE * j + k] * state.cdof[d, k]
            dofs[d, SIZE + 1] = total


def is_in(mechanism, trees, body):
    """Return whether a body is of one of these trees."""
    tree = mechanism.body_tree[body]
    return tree >= 0 and trees[tree] == 1


def write_inertia(links, b, inertias):
    """Write the inertia of a link alone, of which MuJoCo has ten numbers: tensor, mass by place, and mass."""
    for k in range(SIZE * SIZE):
        links[b, k] = 0.0
    x, y, z, m = inertias[b, 6], inertias[b, 7], inertias[b, 8], inertias[b, 9]
    for k in range(3):
        links[b, 7 * k], links[b, 7 * (3 + k)] = inertias[b, k], m
    links[b, 1] = links[b, 6] = inertias[b, 3]
    links[b, 2] = links[b, 12] = inertias[b, 4]
    links[b, 8] = links[b, 13] = inertias[b, 5]
    links[b, 4] = links[b, 24] = -z
    links[b, 5] = links[b, 30] = y
    links[b, 9] = links[b, 19] = z
    links[b, 11] = links[b, 31] = -x
    links[b, 15] = links[b, 20] = -y
    links[b, 16] = links[b, 26] = x


def lead_rows(matrix, work, at, dofs, d, axes):
    """Multiply a matrix from the left by L of a degree of freedom, in place."""
    for k in range(SIZE):
        total = 0.0
        for j in range(SIZE):
            total += dofs[d, j] * matrix[at + SIZE * j + k]
        work[k] = total / dofs[d, SIZE]
    for j in range(SIZE):
        for k in range(SIZE):
            matrix[at + SIZE * j + k] -= axes[d, j] * work[k]


def lead(links, b, work, dofs, d, axes):
    """Write what impulses on a link change from what they change before a degree of freedom.

    With X for the latter, it is L X L' + s s' / D.
    """
    lead_rows(links[b], work, 0, dofs, d, axes)
    for j in range(SIZE):
        total = 0.0
        for k in range(SIZE):
            total += links[b, SIZE * j + k] * dofs[d, k]
        work[j] = total / dofs[d, SIZE]
    for j in range(SIZE):
        for k in range(SIZE):
            links[b, SIZE * j + k] += axes[d, j] * axes[d, k] / dofs[d, SIZE] - work[j] * axes[d, k]
