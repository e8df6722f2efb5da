"""The Jacobian of contacts, from MuJoCo's motion axes of degrees of freedom.

Where Roboyard solves all rows, MuJoCo need not make those of contacts. What is written here is what it would
write, but that each body is pushed where its point is kept, and along the surface at the surface, instead of
at the middle between both.
"""

from __future__ import annotations

from roboyard.sim.stepping.impulses.point_pairs import slid_from_contact
from roboyard.sim.stepping.impulses.records import TABLE
from roboyard.sim.stepping.impulses.slide_directions import turn_frame


def write_contact_rows(  # pragma: no cover
    contacts, sequence, mechanism, state, surface, points, solver, of_links_of_a_tree
):
    """Write the entries of the rows of contacts, whose places and trees are known.

    sequence: the contacts in the order of solution. Frames of contacts are turned to Bullet's directions
    where surfaces have boxes. of_links_of_a_tree: 1 to write only rows of contacts between links of one tree,
    whose frames are turned already: those that are kept by link, see `keep_first`.
    """
    order, ends, frame, address = solver.order, solver.ends, contacts.frame, contacts.address
    normal, spinning, rolling, sliding = ends[0], ends[1], ends[2], ends[3]
    kept = points.points[points.notes[TABLE]]
    for k in range(sequence.shape[0]):
        i = sequence[k]
        if address[i] < 0 or normal >= ends[1] or order[normal, 0] != address[i]:
            continue
        dim = contacts.dim[i]
        a, b = contacts.geom[i, 0], contacts.geom[i, 1]
        if of_links_of_a_tree == 1 and mechanism.geom_tree[a] != mechanism.geom_tree[b]:
            normal += 1
            sliding += 2 if dim > 2 else 0
            spinning += 1 if dim > 3 else 0
            rolling += 2 if dim > 5 else 0
            continue
        slot = points.slots[i] if surface.boxes.shape[0] > 0 else -1
        if of_links_of_a_tree == 0 and dim > 2 and surface.boxes.shape[0] > 0:
            turn_frame(frame, i, a, b, mechanism.geom_type, surface.compound, points.entered)
        if dim > 2:
            write_moves(
                contacts, i, mechanism, state, surface.margins, kept, slot, solver, normal, sliding
            )  # fmt: skip
            sliding += 2
        else:
            clear(solver, normal, 1)
            write_approach(contacts, i, mechanism, state, kept, slot, solver, normal)
        if dim > 3:
            clear(solver, spinning, 1)
            write_turn(contacts, i, mechanism, state, solver, spinning, 0)
            spinning += 1
        if dim > 5:
            clear(solver, rolling, 2)
            write_turn(contacts, i, mechanism, state, solver, rolling, 1)
            write_turn(contacts, i, mechanism, state, solver, rolling + 1, 2)
            rolling += 2
        normal += 1


def clear(solver, first, count):
    """Write 0 into all entries of rows."""
    for n in range(first, first + count):
        for k in range(solver.spans[n, 1] + solver.spans[n, 3]):
            solver.jacobian[n, k] = 0.0


def keep_first(solver, first, count):
    """Keep the entries of rows that are of a contact's first link alone; see `note_links_apart`."""
    for n in range(first, first + count):
        for k in range(solver.spans[n, 1]):
            solver.scaled[n, k] = solver.jacobian[n, k]


def first_place(solver, n, tree):
    """Return the place in row n of the entry of degree of freedom 0, if the tree began there."""
    if tree == solver.order[n, 1]:
        return -solver.spans[n, 0]
    return solver.spans[n, 1] - solver.spans[n, 2]


def is_one_body(mechanism, tree):
    """Return whether a tree is one body that moves freely."""
    return (
        mechanism.tree_dofs[tree] == 6
        and mechanism.joint_type[mechanism.dof_joint[mechanism.tree_dof[tree]]] == 0
    )


def arm_of(contacts, i, mechanism, state, kept, slot, side):
    """Return the way (m) to a contact's place on one body from the centre of mass of the body's tree."""
    body = mechanism.geom_body[contacts.geom[i, side]]
    root = mechanism.body_root[body]
    x = contacts.position[i, 0] - state.subtree_com[root, 0]
    y = contacts.position[i, 1] - state.subtree_com[root, 1]
    z = contacts.position[i, 2] - state.subtree_com[root, 2]
    if slot < 0:
        return x, y, z
    u, v, w = slid_from_contact(contacts, i, kept, slot, side, body, state.xpos, state.xmat)
    return x + u, y + v, z + w


def write_moves(  # pragma: no cover
    contacts, i, mechanism, state, margins, kept, slot, solver, n, m
):
    """Write the velocity of contact i's second body less that of the first into rows n, m and m + 1.

    Those are along the normal, at the place that the contact's point has on each body, and along both
    tangents, there at the surface. kept, slot: the points and the place of this one, -1 for none.
    """
    frame, jacobian, cdof = contacts.frame, solver.jacobian, state.cdof
    x, y, z = frame[i, 0], frame[i, 1], frame[i, 2]
    ux, uy, uz = frame[i, 3], frame[i, 4], frame[i, 5]
    vx, vy, vz = frame[i, 6], frame[i, 7], frame[i, 8]
    half = 0.5 * contacts.dist[i]
    for side in range(2):
        geom = contacts.geom[i, side]
        tree = mechanism.geom_tree[geom]
        if tree < 0:
            continue
        body = mechanism.geom_body[geom]
        sign = -1.0 if side == 0 else 1.0
        shift = half - margins[geom]
        px, py, pz = arm_of(contacts, i, mechanism, state, kept, slot, side)
        px, py, pz = sign * px, sign * py, sign * pz
        ax, ay, az = py * z - pz * y, pz * x - px * z, px * y - py * x
        # arms of the tangents; the normal times the first one is the second, times that less the first
        bx, by, bz = py * uz - pz * uy, pz * ux - px * uz, px * uy - py * ux
        cx, cy, cz = py * vz - pz * vy, pz * vx - px * vz, px * vy - py * vx
        bx, by, bz = bx + shift * vx, by + shift * vy, bz + shift * vz
        cx, cy, cz = cx - shift * ux, cy - shift * uy, cz - shift * uz
        place = first_place(solver, n, tree)
        is_alone = mechanism.geom_tree[contacts.geom[i, 0]] != mechanism.geom_tree[contacts.geom[i, 1]]
        if is_alone and is_one_body(mechanism, tree):
            dof = mechanism.tree_dof[tree]  # the first of three along the world's axes, and three of turns
            k = place + dof
            o = m + 1
            jacobian[n, k], jacobian[n, k + 1], jacobian[n, k + 2] = sign * x, sign * y, sign * z
            jacobian[m, k], jacobian[m, k + 1], jacobian[m, k + 2] = sign * ux, sign * uy, sign * uz
            jacobian[o, k], jacobian[o, k + 1], jacobian[o, k + 2] = sign * vx, sign * vy, sign * vz
            k += 3
            for d in range(dof + 3, dof + 6):
                tx, ty, tz = cdof[d, 0], cdof[d, 1], cdof[d, 2]
                sx, sy, sz = sign * cdof[d, 3], sign * cdof[d, 4], sign * cdof[d, 5]
                jacobian[n, k] = (ax * tx + ay * ty + az * tz) + (x * sx + y * sy + z * sz)
                jacobian[m, k] = (bx * tx + by * ty + bz * tz) + (ux * sx + uy * sy + uz * sz)
                jacobian[m + 1, k] = (cx * tx + cy * ty + cz * tz) + (vx * sx + vy * sy + vz * sz)
                k += 1
            continue
        if side == 0 or tree != mechanism.geom_tree[contacts.geom[i, 0]]:
            first = place + mechanism.tree_dof[tree]
            for k in range(first, first + mechanism.tree_dofs[tree]):
                jacobian[n, k] = jacobian[m, k] = jacobian[m + 1, k] = 0.0
        while body > 0:
            start = mechanism.body_dof[body]
            for d in range(start, start + mechanism.body_dofs[body]):
                tx, ty, tz = cdof[d, 0], cdof[d, 1], cdof[d, 2]
                sx, sy, sz = sign * cdof[d, 3], sign * cdof[d, 4], sign * cdof[d, 5]
                k = place + d
                jacobian[n, k] += (ax * tx + ay * ty + az * tz) + (x * sx + y * sy + z * sz)
                jacobian[m, k] += (bx * tx + by * ty + bz * tz) + (ux * sx + uy * sy + uz * sz)
                jacobian[m + 1, k] += (cx * tx + cy * ty + cz * tz) + (vx * sx + vy * sy + vz * sz)
            body = mechanism.body_parent[body]
        if side == 0 and tree == mechanism.geom_tree[contacts.geom[i, 1]]:
            keep_first(solver, n, 1)
            keep_first(solver, m, 2)


def write_approach(contacts, i, mechanism, state, kept, slot, solver, n):  # pragma: no cover
    """Do what `write_moves` does, along the normal alone."""
    frame, jacobian, cdof = contacts.frame, solver.jacobian, state.cdof
    x, y, z = frame[i, 0], frame[i, 1], frame[i, 2]
    for side in range(2):
        geom = contacts.geom[i, side]
        tree = mechanism.geom_tree[geom]
        if tree < 0:
            continue
        body = mechanism.geom_body[geom]
        sign = -1.0 if side == 0 else 1.0
        px, py, pz = arm_of(contacts, i, mechanism, state, kept, slot, side)
        ax, ay, az = py * z - pz * y, pz * x - px * z, px * y - py * x
        place = first_place(solver, n, tree)
        while body > 0:
            start = mechanism.body_dof[body]
            for d in range(start, start + mechanism.body_dofs[body]):
                turned = ax * cdof[d, 0] + ay * cdof[d, 1] + az * cdof[d, 2]
                jacobian[n, place + d] += sign * (turned + x * cdof[d, 3] + y * cdof[d, 4] + z * cdof[d, 5])
            body = mechanism.body_parent[body]
        if side == 0 and tree == mechanism.geom_tree[contacts.geom[i, 1]]:
            keep_first(solver, n, 1)


def write_turn(contacts, i, mechanism, state, solver, n, axis):  # pragma: no cover
    """Add the angular velocity about an axis of contact i's frame to row n, as `write_moves` does."""
    frame, jacobian, cdof = contacts.frame, solver.jacobian, state.cdof
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
                jacobian[n, place + d] += sign * (x * cdof[d, 0] + y * cdof[d, 1] + z * cdof[d, 2])
            body = mechanism.body_parent[body]
        if side == 0 and tree == mechanism.geom_tree[contacts.geom[i, 1]]:
            keep_first(solver, n, 1)
