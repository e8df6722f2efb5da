"""The distinct rows of an array of whole numbers, found many times faster than by sorting all numbers."""

from __future__ import annotations

import numpy as np

from roboyard._arrays import NDArray
from roboyard.native import compiled

MOST_ALIKE = 256
"""Rows with the same first number from which on they are sorted by NumPy."""


def distinct_rows(rows: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first places of the distinct rows of (n, 3) numbers up to 2^32, and (n,) each row's number.

    Numbers are in the order of first places.
    """
    table = np.full(1 << (2 * len(rows)).bit_length(), -1, np.int32)
    first, place = np.empty(len(rows), np.int64), np.empty(len(rows), np.int64)
    count = number_rows(rows, table, first, place)
    return first[:count], place


def sorted_rows(rows: NDArray[np.int64], most: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first places of the distinct rows of (n, 3) numbers, and (n,) each row's number.

    Numbers are in ascending order of the rows.

    Args:
        rows: whole numbers, the first of each row from 0 to `most` - 1.
        most: number of different first numbers.
    """
    order, first, place = (np.empty(len(rows), np.int64) for _ in range(3))
    count = number_sorted_rows(rows, np.zeros(most + 1, np.int64), order, first, place)
    if count >= 0:
        return first[:count], place
    order = np.lexsort(rows.T[::-1])
    is_new = np.append(True, (np.diff(rows[order], axis=0) != 0).any(axis=1))
    place[order] = np.cumsum(is_new) - 1
    return order[is_new], place


@compiled("i8[:,::1] i8[::1] i8[::1] i8[::1] i8[::1] -> i8", releases_gil=True)
def number_sorted_rows(rows, start, order, first, place):  # pragma: no cover
    """Number the distinct rows in ascending order; return how many there are.

    rows: (n, 3), the first numbers from 0 to m - 1. start: (m + 1,), all 0. order: (n,), written: the rows.
    first: (n,), written: where each number comes first. place: (n,), written: the number of each row.
    -1 is returned where `MOST_ALIKE` rows or more have the same first number.
    """
    for row in range(len(rows)):
        start[rows[row, 0]] += 1
    total = 0
    for value in range(len(start)):
        if start[value] >= MOST_ALIKE:
            return -1
        total += start[value]
        start[value] = total - start[value]
    for row in range(len(rows)):
        value = rows[row, 0]
        order[start[value]] = row
        start[value] += 1
    count, begin = 0, 0
    for value in range(len(start) - 1):
        end = start[value]
        for k in range(begin + 1, end):
            row = order[k]
            at = k
            while at > begin:
                other = order[at - 1]
                if rows[other, 1] < rows[row, 1]:
                    break
                if rows[other, 1] == rows[row, 1] and rows[other, 2] <= rows[row, 2]:
                    break
                order[at] = other
                at -= 1
            order[at] = row
        for k in range(begin, end):
            row = order[k]
            if k == begin or rows[row, 1] != rows[order[k - 1], 1] or rows[row, 2] != rows[order[k - 1], 2]:
                first[count] = row
                count += 1
            place[row] = count - 1
        begin = end
    return count


@compiled("i8[:,::1] i4[::1] i8[::1] i8[::1] -> i8", releases_gil=True)
def number_rows(rows, table, first, place):  # pragma: no cover
    """Number the distinct rows in the order of their first places; return how many there are.

    rows: (n, 3), from 0 to 2^32. table: of a power of two of at least n + 1, all -1. first: (n,), written:
    where each number comes first. place: (n,), written: the number of each row.
    """
    mask = len(table) - 1
    count = 0
    for row in range(len(rows)):
        a, b, c = rows[row, 0], rows[row, 1], rows[row, 2]
        mixed = (a * 73856093) ^ (b * 19349663) ^ (c * 83492791)
        entry = (mixed ^ (mixed >> 15) ^ (mixed >> 29)) & mask
        while table[entry] >= 0:
            other = first[table[entry]]
            if rows[other, 0] == a and rows[other, 1] == b and rows[other, 2] == c:
                break
            entry = (entry + 1) & mask
        if table[entry] < 0:
            table[entry] = count
            first[count] = row
            count += 1
        place[row] = table[entry]
    return count
