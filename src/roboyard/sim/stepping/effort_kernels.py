"""Compiled loops that read the efforts of motors and of limits from the rows of a step."""

from __future__ import annotations

from roboyard.native import compiled
from roboyard.sim.stepping.impulses.contact_row_kernels import LIMIT
from roboyard.sim.stepping.impulses.entries import entry_of
from roboyard.sim.stepping.impulses.records import SEARCH
from roboyard.sim.stepping.step_row_kernels import ROWS, are_found


@compiled(ROWS, SEARCH, "f8[::1] -> i8")
def motor_efforts(rows, search, out):  # pragma: no cover
    """Write the forces of the dry friction rows (the motors) into `out` (nv,) by dof (N m or N).

    Returns 0 where MuJoCo's arrays are not where they were.
    """
    if not are_found(search):
        return 0
    kinds, ids, forces = rows.starts[0], rows.starts[1], rows.starts[9]
    first = search.counts[1]
    for row in range(first, first + search.counts[2]):
        if rows.kind[kinds + row] == 1:
            out[rows.ids[ids + row]] = rows.force[forces + row]
    return 1


@compiled(ROWS, SEARCH, "i4[::1] f8[::1] -> i8")
def limit_efforts(rows, search, dofs, out):  # pragma: no cover
    """Add the efforts of the limits of hinges and slides to `out` (nv,) (N m or N).

    dofs: (njnt,) degree of freedom of each joint. Returns 0 where MuJoCo's arrays are not where they were.
    """
    if not are_found(search):
        return 0
    kinds, ids, forces = rows.starts[0], rows.starts[1], rows.starts[9]
    first = search.counts[1] + search.counts[2]
    for row in range(first, first + search.counts[3]):
        if rows.kind[kinds + row] == LIMIT:
            dof = dofs[rows.ids[ids + row]]
            out[dof] += entry_of(rows, search, row, dof) * rows.force[forces + row]
    return 1
