"""Three-component vectors and matrices as tuples, which a compiled function keeps in registers."""

from __future__ import annotations

import math


def dot(a, b):
    """Return the dot product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    """Return the cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def subtract(a, b):
    """Return `a - b`."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scaled(a, factor):
    """Return `factor * a`."""
    return a[0] * factor, a[1] * factor, a[2] * factor


def along(a, distance, direction):
    """Return `a + distance * direction`."""
    return a[0] + distance * direction[0], a[1] + distance * direction[1], a[2] + distance * direction[2]


def unit(a):
    """Return `a` at length 1; zero stays zero."""
    return scaled(a, 1.0 / math.sqrt(dot(a, a) + 1e-300))


def product(m, a):
    """Return `m @ a` of a matrix, a tuple of three rows."""
    return dot(m[0], a), dot(m[1], a), dot(m[2], a)


def transposed_product(m, a):
    """Return `m.T @ a` of a matrix, a tuple of three rows."""
    return (
        m[0][0] * a[0] + m[1][0] * a[1] + m[2][0] * a[2],
        m[0][1] * a[0] + m[1][1] * a[1] + m[2][1] * a[2],
        m[0][2] * a[0] + m[1][2] * a[1] + m[2][2] * a[2],
    )


def row_of(array, i):
    """Return row i of an (n, 3) array."""
    return array[i, 0], array[i, 1], array[i, 2]


def row3_of(array, i, j):
    """Return row (i, j) of an (n, m, 3 or more) array."""
    return array[i, j, 0], array[i, j, 1], array[i, j, 2]


def at_pixel(rows, x, y):
    """Return `rows[0] + x * rows[1] + y * rows[2]` of a (3, 3) array."""
    return (
        rows[0, 0] + rows[1, 0] * x + rows[2, 0] * y,
        rows[0, 1] + rows[1, 1] * x + rows[2, 1] * y,
        rows[0, 2] + rows[1, 2] * x + rows[2, 2] * y,
    )
