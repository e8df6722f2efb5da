"""The Jacobian of contacts, from MuJoCo's motion axes of degrees of freedom.

Where Roboyard solves all rows, MuJoCo need not make those of contacts. What is written here is what it would
write, for sliding rows at a point on each of the two surfaces instead of the middle between them.
"""

from __future__ import annotations

from roboyard.sim.stepping.impulses.slide_directions import turn_frame


def write_contact_rows(  # pragma: no cover
    contacts, sequence, mechanism, state, surface, points, solver
):
    """Write the entries of the rows of contacts, whose places and trees are known.

    sequence: the contacts in the order of solution. Frames of contacts are turned to Bullet's directions
    where surfaces have boxes.
    """
    order, ends, frame, address = solver.order, solver.ends, contacts.frame, contacts.address
    normal, spinning, rolling, sliding = ends[0], ends[1], ends[2], ends[3]
    for k in range(sequence.shape[0]):
        i = sequence[k]
        if address[i] < 0 or normal >= ends[1] or order[normal, 0] != address[i]:
            continue
        if contacts.dim[i] > 2 and surface.boxes.shape[0] > 0:
            a, b = contacts.geom[i, 0], contacts.geom[i, 1]
            turn_frame(frame, i, a, b, mechanism.geom_type, surface.compound, points.ages)
        clear(solver, normal, 1)
        write_moves(contacts, i, mechanism, state, solver, normal, 0, 0.0, 0.0)
        normal += 1
        if contacts.dim[i] > 3:
            clear(solver, spinning, 1)
            write_turns(contacts, i, mechanism, state, solver, spinning, 0)
            spinning += 1
        if contacts.dim[i] > 5:
            clear(solver, rolling, 2)
            write_turns(contacts, i, mechanism, state, solver, rolling, 1)
            write_turns(contacts, i, mechanism, state, solver, rolling + 1, 2)
            rolling += 2
        if contacts.dim[i] > 2:
            half = 0.5 * contacts.dist[i]
            first = surface.margins[contacts.geom[i, 0]] - half
            second = half - surface.margins[contacts.geom[i, 1]]
            clear(solver, sliding, 2)
            write_moves(contacts, i, mechanism, state, solver, sliding, 1, first, second)
            write_moves(contacts, i, mechanism, state, solver, sliding + 1, 2, first, second)
            sliding += 2


def clear(solver, first, count):
    """Write 0 into all entries of rows."""
    for n in range(first, first + count):
        for k in range(solver.spans[n, 1] + solver.spans[n, 3]):
            solver.jacobian[n, k] = 0.0


def first_place(solver, n, tree):
    """Return the place in row n of the entry of degree of freedom 0, if the tree began there."""
    if tree == solver.order[n, 1]:
        return -solver.spans[n, 0]
    return solver.spans[n, 1] - solver.spans[n, 2]


def write_moves(  # pragma: no cover
    contacts, i, mechanism, state, solver, n, axis, first, second
):
    """Add the velocity of contact i's points along an axis of its frame to row n, of the second body less
    that of the first. first, second: places of both bodies' points along the normal (m).
    """
    frame, jacobian = contacts.frame, solver.jacobian
    x, y, z = frame[i, 3 * axis], frame[i, 3 * axis + 1], frame[i, 3 * axis + 2]
    for side in range(2):
        geom = contacts.geom[i, side]
        tree = mechanism.geom_tree[geom]
        if tree < 0:
            continue
        body = mechanism.geom_body[geom]
        root = mechanism.body_root[body]
        sign, shift = (-1.0, first) if side == 0 else (1.0, second)
        px = contacts.position[i, 0] + shift * frame[i, 0] - state.subtree_com[root, 0]
        py = contacts.position[i, 1] + shift * frame[i, 1] - state.subtree_com[root, 1]
        pz = contacts.position[i, 2] + shift * frame[i, 2] - state.subtree_com[root, 2]
        mx, my, mz = sign * (py * z - pz * y), sign * (pz * x - px * z), sign * (px * y - py * x)
        fx, fy, fz = sign * x, sign * y, sign * z
        place = first_place(solver, n, tree)
        while body > 0:
            start = mechanism.body_dof[body]
            for d in range(start, start + mechanism.body_dofs[body]):
                jacobian[n, place + d] += (
                    mx * state.cdof[d, 0] + my * state.cdof[d, 1] + mz * state.cdof[d, 2]
                ) + (fx * state.cdof[d, 3] + fy * state.cdof[d, 4] + fz * state.cdof[d, 5])
            body = mechanism.body_parent[body]


def write_turns(contacts, i, mechanism, state, solver, n, axis):  # pragma: no cover
    """Add the angular velocity about an axis of contact i's frame to row n, as `write_moves` does."""
    frame, jacobian = contacts.frame, solver.jacobian
    x, y, z = frame[i, 3 * axis], frame[i, 3 * axis + 1], frame[i, 3 * axis + 2]
    for side in range(2):
        geom = contacts.geom[i, side]
        tree = mechanism.geom_tree[geom]
        if tree < 0:
            continue
        sign = -1.0 if side == 0 else 1.0
        place = first_place(solver, n, tree)
        body = mechanism.geom_body[geom]
        while body > 0:
            start = mechanism.body_dof[body]
            for d in range(start, start + mechanism.body_dofs[body]):
                jacobian[n, place + d] += sign * (
                    x * state.cdof[d, 0] + y * state.cdof[d, 1] + z * state.cdof[d, 2]
                )
            body = mechanism.body_parent[body]
