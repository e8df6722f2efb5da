"""Listing the rows of a step in the order in which an impulse solver takes them, with their Jacobian."""

from __future__ import annotations

import numpy as np

from roboyard.sim.constraints.kinds import SLIDE
from roboyard.sim.stepping.impulses.contact_jacobian import write_contact_rows
from roboyard.sim.stepping.impulses.contact_order import order_contacts
from roboyard.sim.stepping.impulses.entries import copy_entries, entry_of, place_of
from roboyard.sim.stepping.impulses.grouping import gather_groups, order_parts
from roboyard.sim.stepping.impulses.point_pairs import push_at_points
from roboyard.sim.stepping.impulses.records import BY_ENTRY, HALF_TURN, SORTED, TAKEN_UP, WITHOUT_CONTACTS
from roboyard.sim.stepping.impulses.rows import choose_trees, order_rows
from roboyard.sim.stepping.impulses.slide_directions import turn_slides


def arrange(rows, contacts, search, mechanism, state, points, surface, solver, wanted):  # pragma: no cover
    """Choose the trees to solve, list their rows and copy their Jacobian, for contacts on their surfaces.

    wanted: number of rows of equalities, motors and limits. The number of rows listed, and of those of
    contacts that do not push, becomes the sixth of `ends`, -1 where a row is of another kind.
    """
    at, count = rows.starts, search.counts[4]
    kind, index = rows.kind[at[0] : at[0] + count], rows.ids[at[1] : at[1] + count]
    geom, address = contacts.geom[: search.counts[0]], contacts.address[: search.counts[0]]
    if not choose_trees(
        kind, index, geom, address, mechanism.geom_tree, mechanism.dof_tree, mechanism.joint_dof,
        mechanism.joint_type, mechanism.slot, mechanism.limit_slot, mechanism.equality_tree, wanted,
        solver.taken,
    ):  # fmt: skip
        return
    left = order_contacts(
        contacts, geom.shape[0], mechanism, state, surface, points, solver.groups,
        solver.rules[BY_ENTRY] > 0.0,
    )  # fmt: skip
    if points.notes[SORTED] == 1:
        order_parts(mechanism, points, solver.groups)
        points.notes[SORTED] = 2
    sequence = points.sequence[: points.notes[TAKEN_UP]]
    found = order_rows(
        kind, index, geom, address, contacts.dim, mechanism.geom_tree, mechanism.dof_tree,
        mechanism.joint_dof, mechanism.joint_qpos, state.qpos, mechanism.slot, mechanism.limit_slot,
        mechanism.limits, mechanism.equality_slot, mechanism.equality_tree, solver.taken, wanted,
        sequence, sequence.shape[0], solver.places, solver.order, solver.ends,
    )  # fmt: skip
    gather_groups(mechanism, points, solver, surface.boxes.shape[0] > 0)
    spans, jacobian = solver.spans, solver.jacobian
    has_contacts = search.is_sparse != WITHOUT_CONTACTS
    for n in range(found):
        for side in range(2):
            tree = solver.order[n, 1 + side]
            spans[n, 2 * side] = mechanism.tree_dof[tree] if tree >= 0 else 0
            spans[n, 2 * side + 1] = mechanism.tree_dofs[tree] if tree >= 0 else 0
        if has_contacts or n < solver.ends[0]:
            copy_entries(rows, search, solver.order[n, 0], n, spans, jacobian)
    solver.ends[5] = found + left
    velocity = rows.velocity[at[7] : at[7] + count]
    position = rows.position[at[3] : at[3] + count]
    if not has_contacts:
        write_contact_rows(contacts, sequence, mechanism, state, surface, points, solver, 0)
    else:
        if found + left == count and surface.boxes.shape[0] > 0:
            turn_slides(contacts, sequence, mechanism, surface, points, solver, velocity)
        slide_on_margins(geom, address, sequence, contacts, mechanism, state, surface, solver, velocity)
        if surface.boxes.shape[0] > 0:
            push_at_points(geom, address, sequence, contacts, mechanism, state, points, solver, velocity)
        write_contact_rows(contacts, sequence, mechanism, state, surface, points, solver, 1)
    for n in range(solver.ends[0]):
        row = solver.order[n, 0]
        if kind[row] == 0:
            equality = index[row]
            aux = mechanism.equality_aux[equality]
            if aux >= 0:
                velocity[row] -= entry_of(rows, search, row, aux) * state.qvel[aux]
                place = place_of(aux, n, spans)
                if place >= 0:
                    jacobian[n, place] = 0.0
            if row >= 3 and index[row - 3] == equality:
                axis = 0
                while axis < 2 and row >= 4 + axis and index[row - 4 - axis] == equality:
                    axis += 1
                if aux == SLIDE:
                    axis = (axis + 2) % 3  # see `free_slide`
                turn_about_axis(mechanism, state, equality, axis, n, row, solver, velocity, position)


def turn_about_axis(  # pragma: no cover
    mechanism, state, equality, axis, n, row, solver, velocity, position
):
    """Let a weld's row n hold half the turn about an axis of its first frame, 0 ... 2, as Euler angles.

    MuJoCo's is the imaginary part of a quaternion, in which a torque's bound depends on the angle.
    """
    site_a, site_b = mechanism.equality_site[equality, 0], mechanism.equality_site[equality, 1]
    a, b = state.site_xmat[site_a], state.site_xmat[site_b]
    spans, jacobian = solver.spans, solver.jacobian
    solver.order[n, 3] = HALF_TURN
    for k in range(spans[n, 1] + spans[n, 3]):
        jacobian[n, k] = 0.0
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
                place = place_of(d, n, spans)
                if place >= 0:
                    jacobian[n, place] += turn
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
    geom, address, sequence, contacts, mechanism, state, surface, solver, velocity
):
    """Move each contact's sliding rows from between MuJoCo's shapes to a point on each of the two surfaces.

    These lie outside the shapes by margins: a wheel whose hull has one rolls on a radius larger by it. The
    rows' velocities change, too.
    """
    jacobian, order, tree, frame = solver.jacobian, solver.order, mechanism.geom_tree, contacts.frame
    spans = solver.spans
    n = solver.ends[3]
    for k in range(sequence.shape[0]):
        i = sequence[k]
        if address[i] < 0 or contacts.dim[i] < 3:
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
                        jacobian[n + k, place_of(d, n + k, spans)] += shift * more
                        velocity[order[n + k, 0]] += shift * more * state.qvel[d]
                    body = mechanism.body_parent[body]
        n += 2
