"""Slides made of the rows of welds, where contacts are rigid."""

from __future__ import annotations

from math import sqrt

from roboyard.native import compiled
from roboyard.sim.constraints.bounded_rows import PARALLEL
from roboyard.sim.stepping.impulses.records import SEARCH
from roboyard.sim.stepping.step_row_kernels import ROWS, are_found


@compiled(ROWS, SEARCH, "f8[:,::1] i8 i8 f8[::1] -> i8")
def free_slide(rows, search, frames, equality, site, axis):  # pragma: no cover
    """Free a weld along an axis, between the halves of a step; return whether its rows were found.

    Does what `free_axis` does where distances are measured at each body's own point: those along two
    directions across the axis are sums of those along the axes of the world, which the rows are of. The
    third row becomes empty. The turn about the third axis of the frame is the first of the turns, as in
    Bullet, whose order of rows matters where rounds end before forces have converged.

    frames: (nsite, 9) of sites in the world. equality: row of the weld, site: that of the frame in which the
    axis (3,) is fixed.
    """
    if not are_found(search):
        return 0
    at, first = rows.starts, -1
    for row in range(search.counts[1]):
        if rows.ids[at[1] + row] == equality:
            first = row
            break
    if first < 0:
        return 0
    frame = frames[site]
    x = frame[0] * axis[0] + frame[1] * axis[1] + frame[2] * axis[2]
    y = frame[3] * axis[0] + frame[4] * axis[1] + frame[5] * axis[2]
    z = frame[6] * axis[0] + frame[7] * axis[1] + frame[8] * axis[2]
    a = b = c = 0.0
    for column in range(3):
        i, j, k = frame[column], frame[3 + column], frame[6 + column]
        a, b, c = j * z - k * y, k * x - i * z, i * y - j * x
        length = sqrt(a * a + b * b + c * c)
        if length > PARALLEL:
            a, b, c = a / length, b / length, c / length
            break
    d, e, f = y * c - z * b, z * a - x * c, x * b - y * a
    start, count = at[2] + first * search.degrees, search.degrees
    if search.is_sparse > 0:
        start, count = at[2] + rows.addresses[at[11] + first], rows.entries[at[10] + first]
    turn(rows.jacobian, start, count, count, a, b, c, d, e, f)
    turn(rows.position, at[3] + first, 1, 1, a, b, c, d, e, f)
    turn(rows.velocity, at[7] + first, 1, 1, a, b, c, d, e, f)
    turn(rows.reference, at[8] + first, 1, 1, a, b, c, d, e, f)
    exchange(rows.jacobian, start + 3 * count, count)
    exchange(rows.position, at[3] + first + 3, 1)
    exchange(rows.velocity, at[7] + first + 3, 1)
    exchange(rows.reference, at[8] + first + 3, 1)
    return 1


def exchange(values, start, count):
    """Put the last of three rows of so many numbers in front of the others."""
    for k in range(start, start + count):
        values[k], values[k + count], values[k + 2 * count] = (
            values[k + 2 * count],
            values[k],
            values[k + count],
        )


def turn(values, start, count, step, a, b, c, d, e, f):
    """Replace three rows of so many numbers by their sums along two directions, and zeros."""
    for k in range(start, start + count):
        x, y, z = values[k], values[k + step], values[k + 2 * step]
        values[k] = a * x + b * y + c * z
        values[k + step] = d * x + e * y + f * z
        values[k + 2 * step] = 0.0
