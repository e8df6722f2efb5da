"""Compiled loops over the bytes of lists of numbers."""

from __future__ import annotations

from roboyard.native import compiled
from roboyard.shapes.readers.obj_kernels import MOST_DIGITS, NEWLINE, RETURN, SPACE, number_at


def after_blanks(data, i):  # pragma: no cover
    """Return the place of the first byte from i on that is no space and ends no line."""
    while i < data.shape[0] and (data[i] == SPACE or data[i] == NEWLINE or data[i] == RETURN):
        i += 1
    return i


@compiled("u1[::1] f8[::1] i8[::1] f8[::1] -> i8", releases_gil=True)
def read_floats(data, powers, at, values):  # pragma: no cover
    """Read numbers with blanks or line ends between them; returns how many, or -1 for a list not plain.

    data: (n,) bytes. powers: (23,) of ten. at: (1,) work array. values: (m,) output, long enough.
    """
    i, end, count = 0, data.shape[0], 0
    while True:
        i = after_blanks(data, i)
        if i >= end:
            return count
        at[0] = i
        value = number_at(data, at, powers)
        if at[0] < 0:
            return -1
        i = at[0]
        values[count] = value
        count += 1


@compiled("u1[::1] i8[::1] -> i8", releases_gil=True)
def read_integers(data, values):  # pragma: no cover
    """Read whole numbers without sign, as `read_floats`."""
    i, end, count = 0, data.shape[0], 0
    while True:
        i = after_blanks(data, i)
        if i >= end:
            return count
        value, digits = 0, 0
        while i < end and 48 <= data[i] <= 57 and digits <= MOST_DIGITS:
            value = value * 10 + (data[i] - 48)
            digits += 1
            i += 1
        if digits == 0 or digits > MOST_DIGITS:
            return -1
        if i < end and data[i] != SPACE and data[i] != NEWLINE and data[i] != RETURN:
            return -1
        values[count] = value
        count += 1
