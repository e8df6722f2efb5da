"""Compiled loops that make the rows of joints, or take MuJoCo's, and number those of contacts after them."""

from __future__ import annotations

from roboyard.native import compiled
from roboyard.sim.stepping.impulses.point_pairs import slid_from_contact
from roboyard.sim.stepping.impulses.records import DONE, OTHERS, ROOM_FOR_ROWS, ROWS_OF_CONTACT, SEARCH
from roboyard.sim.stepping.step_row_kernels import CONTACTS, ROWS

FRICTION, LIMIT = 1, 3
"""MuJoCo's kinds of these rows."""
OWN_CONTACT = -1
"""Kind of the rows of contacts that are made here."""
SLIDER = 2
"""MuJoCo's type of this joint, and the least of those with one degree of freedom."""
NUMBERED = -2
"""Address in MuJoCo's array of the contact with the first row, 0; those of others are lower by their rows. To
MuJoCo a contact with a negative address has no rows."""


def make_rows(  # pragma: no cover
    rows, contacts, search, mechanism, state, surface, own, own_contacts, own_search, makes_joints
):
    """Write the rows of joints into own arrays, or copy MuJoCo's, and number those of contacts.

    rows, search: MuJoCo's, none of which are of contacts. own: arrays that begin at 0; the Jacobian is
    sparse. own_contacts.address: (ncon,) or more, first row of each contact, -1 for none, written: contacts
    across gaps that do not push have no rows. own_search.counts: written. makes_joints: whether MuJoCo has
    made no rows at all. Returns DONE, ROOM_FOR_ROWS where the arrays are too short, or OTHERS where soft
    bodies touch something.
    """
    contact_count, address, counts = search.counts[0], own_contacts.address, own_search.counts
    joints = search.counts[4]
    if makes_joints:
        joints = mechanism.dry.shape[0] + 2 * mechanism.limited.shape[0]
    counts[0], counts[4] = contact_count, joints + ROWS_OF_CONTACT * contact_count
    counts[5] = joints * (1 if makes_joints else search.degrees)
    if contact_count > address.shape[0] or counts[4] > own.kind.shape[0] or counts[5] > own.jacobian.shape[0]:
        return ROOM_FOR_ROWS
    if makes_joints:
        row = write_joints(mechanism, state, own, counts)
    else:
        for k in range(1, 4):
            counts[k] = search.counts[k]
        copy_joints(rows, search, own)
        row = joints
    for i in range(contact_count):
        a, b = contacts.geom[i, 0], contacts.geom[i, 1]
        address[i], contacts.address[i] = -1, -1
        if a < 0 or b < 0:
            return OTHERS
        gap = contacts.dist[i] - (surface.margins[a] + surface.margins[b])
        if contacts.exclude[i] != 0 or gap > min(surface.reaches[a], surface.reaches[b]):
            continue
        address[i], contacts.address[i] = row, NUMBERED - row
        for k in range(contacts.dim[i]):
            own.kind[row + k], own.ids[row + k] = OWN_CONTACT, i
            own.position[row + k] = own.loss[row + k] = own.reference[row + k] = 0.0
            own.R[row + k] = own.D[row + k] = 1.0
        row += contacts.dim[i]
    counts[4] = row
    return DONE


def write_joints(mechanism, state, own, counts):
    """Write the rows of motors, then those of limits in sight, as MuJoCo would; return their number."""
    row = counts[1] = 0
    for dof in range(mechanism.dry.shape[0]):
        if mechanism.dry[dof] > 0.0:
            write_joint(own, row, FRICTION, dof, dof, 1.0, 0.0, mechanism.dry[dof], state)
            row += 1
    counts[2] = row
    for joint in range(mechanism.limited.shape[0]):
        if mechanism.limited[joint] == 0 or mechanism.joint_type[joint] < SLIDER:
            continue
        dof, angle = mechanism.joint_dof[joint], state.qpos[mechanism.joint_qpos[joint]]
        for side in range(2):
            sign = 1.0 if side == 0 else -1.0
            away = sign * (angle - mechanism.limits[joint, side])
            if away < mechanism.limit_margin[joint]:
                write_joint(own, row, LIMIT, joint, dof, sign, away, 0.0, state)
                row += 1
    counts[3] = row - counts[2]
    return row


def write_joint(own, row, kind, number, dof, sign, away, loss, state):
    """Write a row that has one degree of freedom."""
    own.kind[row], own.ids[row], own.position[row], own.loss[row] = kind, number, away, loss
    own.R[row] = own.D[row] = 1.0
    own.velocity[row], own.reference[row] = sign * state.qvel[dof], 0.0
    own.addresses[row], own.entries[row], own.columns[row], own.jacobian[row] = row, 1, dof, sign


def copy_joints(rows, search, own):
    """Copy MuJoCo's rows."""
    at, entry = rows.starts, 0
    for row in range(search.counts[4]):
        own.kind[row], own.ids[row] = rows.kind[at[0] + row], rows.ids[at[1] + row]
        own.position[row], own.loss[row] = rows.position[at[3] + row], rows.loss[at[4] + row]
        own.R[row], own.D[row] = rows.R[at[5] + row], rows.D[at[6] + row]
        own.velocity[row], own.reference[row] = rows.velocity[at[7] + row], rows.reference[at[8] + row]
        own.addresses[row] = entry
        if search.is_sparse == 1:
            first = rows.addresses[at[11] + row]
            own.entries[row] = rows.entries[at[10] + row]
            for k in range(own.entries[row]):
                own.columns[entry] = rows.columns[at[12] + first + k]
                own.jacobian[entry] = rows.jacobian[at[2] + first + k]
                entry += 1
        else:
            own.entries[row] = search.degrees
            for k in range(search.degrees):
                own.columns[entry] = k
                own.jacobian[entry] = rows.jacobian[at[2] + row * search.degrees + k]
                entry += 1


@compiled(ROWS, SEARCH, "f8[::1]")
def give_forces(rows, search, force):  # pragma: no cover
    """Write forces (n,) of the rows of joints and equalities into MuJoCo's array."""
    for row in range(search.counts[4]):
        rows.force[rows.starts[9] + row] = force[row]


@compiled(CONTACTS, "i8 f8[::1] f8[:,::1]")
def read_forces(contacts, count, force, out):  # pragma: no cover
    """Write forces (N) along and torques (N m) about the axes of the frames of contacts with numbers.

    out: (n, 6).
    """
    for i in range(count):
        row = NUMBERED - contacts.address[i]
        if row < 0:
            continue
        for k in range(contacts.dim[i]):
            out[i, k] = force[row + k]


@compiled(CONTACTS, "i8 f8[:,::1] i4[::1] f8[:,:] f8[:,:] f8[:,:] f8[::1] i4[::1] f8[:,:,::1] f8 f8[:,:]")
def add_wrenches(  # pragma: no cover
    contacts, count, forces, geom_body, centres, xpos, xmat, margins, slots, kept, share, wrenches
):  # fmt: skip
    """Add the forces (N) and torques (N m) of contacts to those on bodies.

    forces: (n, 6) along the axes of the contacts' frames, on the second body. centres: (nbody, 3) centres of
    mass (m). xpos, xmat: of bodies. margins: (ngeom,) widths (m) by which surfaces lie outside the shapes.
    slots, kept: places of the contacts' points, -1 for none, and the points. share: 1 to add all of them, 0
    what they are more than at the contacts' places, where MuJoCo adds them. wrenches: (nbody, 6) forces and
    torques about the centres of mass, in the world frame.

    As in the rows of the solver, a body is pushed where its own point is, on its surface.
    """
    for i in range(count):
        fx = fy = fz = tx = ty = tz = 0.0
        for k in range(3):
            x, y, z = contacts.frame[i, 3 * k], contacts.frame[i, 3 * k + 1], contacts.frame[i, 3 * k + 2]
            fx, fy, fz = fx + forces[i, k] * x, fy + forces[i, k] * y, fz + forces[i, k] * z
            tx, ty, tz = tx + forces[i, 3 + k] * x, ty + forces[i, 3 + k] * y, tz + forces[i, 3 + k] * z
        for side in range(2):
            if contacts.geom[i, side] < 0:
                continue
            geom, sign = contacts.geom[i, side], 2.0 * side - 1.0
            body, out = geom_body[geom], sign * (0.5 * contacts.dist[i] - margins[geom])
            x = share * (contacts.position[i, 0] - centres[body, 0]) + out * contacts.frame[i, 0]
            y = share * (contacts.position[i, 1] - centres[body, 1]) + out * contacts.frame[i, 1]
            z = share * (contacts.position[i, 2] - centres[body, 2]) + out * contacts.frame[i, 2]
            if slots[i] >= 0:
                u, v, w = slid_from_contact(contacts, i, kept, slots[i], side, body, xpos, xmat)
                x, y, z = x + u, y + v, z + w
            wrenches[body, 0] += share * sign * fx
            wrenches[body, 1] += share * sign * fy
            wrenches[body, 2] += share * sign * fz
            wrenches[body, 3] += sign * (share * tx + y * fz - z * fy)
            wrenches[body, 4] += sign * (share * ty + z * fx - x * fz)
            wrenches[body, 5] += sign * (share * tz + x * fy - y * fx)
