"""Compiled loops that take MuJoCo's rows of joints and equalities, and number those of contacts after."""

from __future__ import annotations

from roboyard.native import compiled
from roboyard.sim.stepping.impulses.records import DONE, LOST, OTHERS, ROOM, ROWS_OF_CONTACT, SEARCH
from roboyard.sim.stepping.step_row_kernels import CONTACTS, ROWS, are_found

NUMBERED = -2
"""Address in MuJoCo's array of the contact with the first row, 0; those of others are lower by their rows. To
MuJoCo a contact with a negative address has no rows."""


@compiled(ROWS, CONTACTS, SEARCH, ROWS, "f8[::1] f8[::1] i4[::1] i4[::1] -> i8")
def take_rows(  # pragma: no cover
    rows, contacts, search, own, margins, reaches, address, counts
):
    """Copy MuJoCo's rows, none of which are of contacts, into other arrays, and number those of contacts.

    own: arrays that begin at 0; the Jacobian is sparse. margins, reaches: (ngeom,) as of `hard_contacts`;
    contacts across gaps that do not push have no rows. address: (ncon,) or more, first row of each contact,
    -1 for none, written. counts: (6,) of `Search`, written. Returns DONE, ROOM where the arrays are too
    short, OTHERS where soft bodies touch something, or LOST.
    """
    if not are_found(search):
        return LOST
    contact_count, count, at = search.counts[0], search.counts[4], rows.starts
    for k in range(4):
        counts[k] = search.counts[k]
    counts[4], counts[5] = count + ROWS_OF_CONTACT * contact_count, count * search.degrees
    if contact_count > address.shape[0] or counts[4] > own.kind.shape[0] or counts[5] > own.jacobian.shape[0]:
        return ROOM
    entry = 0
    for row in range(count):
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
    row = count
    for i in range(contact_count):
        a, b = contacts.geom[i, 0], contacts.geom[i, 1]
        address[i], contacts.address[i] = -1, -1
        if a < 0 or b < 0:
            return OTHERS
        gap = contacts.dist[i] - (margins[a] + margins[b])
        if contacts.exclude[i] != 0 or gap > min(reaches[a], reaches[b]):
            continue
        address[i], contacts.address[i] = row, NUMBERED - row
        for k in range(contacts.dim[i]):
            own.kind[row + k], own.ids[row + k] = -1, i
            own.position[row + k] = own.loss[row + k] = own.reference[row + k] = 0.0
            own.R[row + k] = own.D[row + k] = 1.0
        row += contacts.dim[i]
    counts[4] = row
    return DONE


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
