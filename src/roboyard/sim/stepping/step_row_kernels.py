"""A step's contacts and constraint rows as arguments of compiled loops; see `step_rows`."""

from __future__ import annotations

import numpy as np

from roboyard._records import NamedTuple
from roboyard.native import compiled, record


class Rows(NamedTuple):
    """Blocks of memory that hold the arrays of constraint rows, and where in each block the array begins."""

    kind: np.ndarray
    ids: np.ndarray
    jacobian: np.ndarray
    position: np.ndarray
    loss: np.ndarray
    R: np.ndarray
    D: np.ndarray
    velocity: np.ndarray
    reference: np.ndarray
    force: np.ndarray
    entries: np.ndarray
    """Number of entries of each row of the Jacobian, where that is sparse."""
    addresses: np.ndarray
    """Place of each row's first entry."""
    columns: np.ndarray
    """Column of each entry."""
    starts: np.ndarray
    """(13,) place of each array's first number in its block."""


class Contacts(NamedTuple):
    """Fields of MuJoCo's contacts; the arrays may be longer than there are contacts."""

    geom: np.ndarray
    address: np.ndarray
    dim: np.ndarray
    dist: np.ndarray
    position: np.ndarray
    frame: np.ndarray
    friction: np.ndarray
    mu: np.ndarray
    exclude: np.ndarray
    """Not 0 where MuJoCo makes no rows for the contact."""


ROWS = record(
    Rows,
    "i4[::1] i4[::1] f8[::1] f8[::1] f8[::1] f8[::1] f8[::1] f8[::1] f8[::1] f8[::1] i4[::1] i4[::1] i4[::1]"
    " i8[::1]",
)
CONTACTS = record(Contacts, "i4[:,:] i4[:] i4[:] f8[:] f8[:,:] f8[:,:] f8[:,:] f8[:] i4[:]")


@compiled("i8[::1] i8[::1] i4[::1] i8[::1] i8 i8 i8 i8 i8 -> i8")
def find_rows(  # pragma: no cover
    words, places, counts, starts, address, size, contact, degrees, is_sparse
):
    """Write where the arrays of rows begin in MuJoCo's block; return 1 where all are within it, else 0.

    words: addresses in MjData, the second one the block's. places: (14,) of those of the arrays of rows, two
    of integers, eight of numbers, of which the first is the Jacobian, three of integers of a sparse Jacobian,
    and of the contacts. counts: (6,) numbers of contacts, of rows, the last one of all rows, and of entries
    of the Jacobian. starts: (13,) written. address, size: of the block (bytes). contact:
    bytes of a contact. degrees: columns of the Jacobian. is_sparse: 1 where it has only some entries of each
    row.
    """
    if words[1] != address:
        return 0
    if counts[0] < 0 or counts[4] < 0 or counts[5] < 0:
        return 0
    if counts[0] > 0 and (words[places[13]] != address or counts[0] * contact > size):
        return 0
    for k in range(13):
        width = 4 if k < 2 or k > 9 else 8
        count = counts[4]
        if k == 2 or k == 12:
            count = counts[5]
        if k > 9 and is_sparse == 0:
            count = 0
        offset = words[places[k]] - address
        if count == 0:
            starts[k] = 0
        elif offset < 0 or offset % width != 0 or offset + width * count > size:
            return 0
        else:
            starts[k] = offset // width
    return 1


def are_found(search):
    """Return whether the arrays of rows are where they were, or passed as such; see `find_rows`."""
    if search.places.shape[0] == 0:
        return True
    return find_rows(
        search.words, search.places, search.counts, search.starts, search.address, search.size,
        search.contact, search.degrees, search.is_sparse,
    ) == 1  # fmt: skip
