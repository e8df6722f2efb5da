"""Rows of the Jacobian by the degrees of freedom of the one or two trees that each of them moves.

Entries of row n belong to the degrees of freedom of its first tree, then to those of its second; `spans`
holds the first degree of freedom and the number of both.
"""

from __future__ import annotations


def along(entries, n, spans, velocities):
    """Return row n times velocities (nv,)."""
    total = 0.0
    first, size, other, others = spans[n, 0], spans[n, 1], spans[n, 2], spans[n, 3]
    for k in range(size):
        total += entries[n, k] * velocities[first + k]
    for k in range(others):
        total += entries[n, size + k] * velocities[other + k]
    return total


def add_to(values, factor, entries, n, spans):
    """Add a multiple of row n to values (nv,)."""
    first, size, other, others = spans[n, 0], spans[n, 1], spans[n, 2], spans[n, 3]
    for k in range(size):
        values[first + k] += factor * entries[n, k]
    for k in range(others):
        values[other + k] += factor * entries[n, size + k]


def place_of(dof, n, spans):
    """Return the place of a degree of freedom among the entries of row n, -1 where it has none."""
    k = dof - spans[n, 0]
    if 0 <= k < spans[n, 1]:
        return k
    k = dof - spans[n, 2]
    if 0 <= k < spans[n, 3]:
        return spans[n, 1] + k
    return -1


def copy_entries(rows, search, row, n, spans, entries):
    """Copy a row of MuJoCo's Jacobian, which is dense or sparse, to row n."""
    start = rows.starts[2]
    if search.is_sparse != 0:
        first, column = rows.addresses[rows.starts[11] + row], rows.starts[12]
        count, size, others = rows.entries[rows.starts[10] + row], spans[n, 1], spans[n, 3]
        if count == size + others:  # columns ascend
            x, y = (0, size) if others == 0 or spans[n, 0] < spans[n, 2] else (others, 0)
            if (size == 0 or rows.columns[column + first + x] == spans[n, 0]) and (
                others == 0 or rows.columns[column + first + y] == spans[n, 2]
            ):
                for k in range(size):
                    entries[n, k] = rows.jacobian[start + first + x + k]
                for k in range(others):
                    entries[n, size + k] = rows.jacobian[start + first + y + k]
                return
        for k in range(size + others):
            entries[n, k] = 0.0
        for i in range(first, first + count):
            place = place_of(rows.columns[rows.starts[12] + i], n, spans)
            if place >= 0:
                entries[n, place] = rows.jacobian[start + i]
        return
    start += row * search.degrees
    for k in range(spans[n, 1]):
        entries[n, k] = rows.jacobian[start + spans[n, 0] + k]
    for k in range(spans[n, 3]):
        entries[n, spans[n, 1] + k] = rows.jacobian[start + spans[n, 2] + k]


def entry_of(rows, search, row, dof):
    """Return an entry of MuJoCo's Jacobian."""
    start = rows.starts[2]
    if search.is_sparse == 0:
        return rows.jacobian[start + row * search.degrees + dof]
    first = rows.addresses[rows.starts[11] + row]
    for i in range(first, first + rows.entries[rows.starts[10] + row]):
        if rows.columns[rows.starts[12] + i] == dof:
            return rows.jacobian[start + i]
    return 0.0
