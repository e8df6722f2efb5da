"""Rows of contacts whose two points have slid apart since they met.

A point that is kept from earlier steps has a place on each body. Bullet pushes each body at its own place,
while MuJoCo's row is for the middle between them.
"""

from __future__ import annotations

from roboyard.sim.stepping.impulses.entries import place_of
from roboyard.sim.stepping.impulses.records import TABLE

TOGETHER = 1e-20
"""Square of the distance (m²) up to which a point of a body is where the contact is."""


def push_at_points(geom, address, sequence, contacts, mechanism, state, points, solver, velocity):
    """Move the rows of normals and of sliding along the surface to the points that each body has kept.

    The rows' velocities change, too.
    """
    tree = mechanism.geom_tree
    normal, sliding = solver.ends[0], solver.ends[3]
    kept = points.points[points.notes[TABLE]]
    for k in range(sequence.shape[0]):
        i = sequence[k]
        if address[i] < 0:
            continue
        a, b = tree[geom[i, 0]], tree[geom[i, 1]]
        if not ((a >= 0 and solver.taken[a] == 1) or (b >= 0 and solver.taken[b] == 1)):
            continue
        slot = points.slots[i]
        for side in range(2 if slot >= 0 else 0):
            body = mechanism.geom_body[geom[i, side]]
            if body == 0:
                continue
            x, y, z = slid_from_contact(contacts, i, kept, slot, side, body, state.xpos, state.xmat)
            if x * x + y * y + z * z <= TOGETHER:
                continue
            if side == 0:
                x, y, z = -x, -y, -z
            shift_row(contacts.frame, i, 0, x, y, z, body, normal, mechanism, state, solver, velocity)
            if contacts.dim[i] > 2:
                shift_row(contacts.frame, i, 3, x, y, z, body, sliding, mechanism, state, solver, velocity)
                shift_row(
                    contacts.frame, i, 6, x, y, z, body, sliding + 1, mechanism, state, solver, velocity
                )
        normal += 1
        if contacts.dim[i] > 2:
            sliding += 2


def slid_from_contact(contacts, i, kept, slot, side, body, xpos, xmat):
    """Return the way (m) along the surface from a contact to the place that its point has on one body."""
    n, m, first = slot // 4, slot % 4, 3 * side
    x = xpos[body, 0] - contacts.position[i, 0]
    y = xpos[body, 1] - contacts.position[i, 1]
    z = xpos[body, 2] - contacts.position[i, 2]
    for k in range(3):
        x += xmat[body, k] * kept[n, m, first + k]
        y += xmat[body, 3 + k] * kept[n, m, first + k]
        z += xmat[body, 6 + k] * kept[n, m, first + k]
    along = x * contacts.frame[i, 0] + y * contacts.frame[i, 1] + z * contacts.frame[i, 2]
    return (
        x - along * contacts.frame[i, 0],
        y - along * contacts.frame[i, 1],
        z - along * contacts.frame[i, 2],
    )


def shift_row(frame, i, axis, x, y, z, body, n, mechanism, state, solver, velocity):
    """Move the row n of a contact's axis (0, 3 or 6 in its frame) by a way (m) on one body."""
    u, v, w = frame[i, axis], frame[i, axis + 1], frame[i, axis + 2]
    tx, ty, tz = y * w - z * v, z * u - x * w, x * v - y * u
    row = solver.order[n, 0]
    while body > 0:
        first = mechanism.body_dof[body]
        for d in range(first, first + mechanism.body_dofs[body]):
            more = tx * state.cdof[d, 0] + ty * state.cdof[d, 1] + tz * state.cdof[d, 2]
            solver.jacobian[n, place_of(d, n, solver.spans)] += more
            velocity[row] += more * state.qvel[d]
        body = mechanism.body_parent[body]
