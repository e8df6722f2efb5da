"""Products and sums of blocks of numbers, written out: so LLVM makes one or two instructions of each."""

from __future__ import annotations

from roboyard.sim.stepping.impulses.records import BLOCK


def dot_block(x, i, y, j):
    """Return the product of two blocks."""
    return (
        x[i] * y[j]
        + x[i + 1] * y[j + 1]
        + x[i + 2] * y[j + 2]
        + x[i + 3] * y[j + 3]
        + x[i + 4] * y[j + 4]
        + x[i + 5] * y[j + 5]
        + x[i + 6] * y[j + 6]
        + x[i + 7] * y[j + 7]
    )


def dot_two_blocks(x, i, y, j, k, m):
    """Return the sum of the products of x's blocks at i and k with y's at j and m.

    The lanes of both are summed before they are summed across, which takes longest.
    """
    return (
        (x[i] * y[j] + x[k] * y[m])
        + (x[i + 1] * y[j + 1] + x[k + 1] * y[m + 1])
        + (x[i + 2] * y[j + 2] + x[k + 2] * y[m + 2])
        + (x[i + 3] * y[j + 3] + x[k + 3] * y[m + 3])
        + (x[i + 4] * y[j + 4] + x[k + 4] * y[m + 4])
        + (x[i + 5] * y[j + 5] + x[k + 5] * y[m + 5])
        + (x[i + 6] * y[j + 6] + x[k + 6] * y[m + 6])
        + (x[i + 7] * y[j + 7] + x[k + 7] * y[m + 7])
    )


def dot_four_blocks(x, i, y, j):
    """Return the product of four blocks of x, one after the other, and four of y; see `dot_two_blocks`."""
    return (
        dot_in_four(x, i, y, j)
        + dot_in_four(x, i + 1, y, j + 1)
        + dot_in_four(x, i + 2, y, j + 2)
        + dot_in_four(x, i + 3, y, j + 3)
        + dot_in_four(x, i + 4, y, j + 4)
        + dot_in_four(x, i + 5, y, j + 5)
        + dot_in_four(x, i + 6, y, j + 6)
        + dot_in_four(x, i + 7, y, j + 7)
    )


def dot_in_four(x, i, y, j):
    """Return the sum of products of numbers of four blocks, one in each."""
    k, m, n = BLOCK, 2 * BLOCK, 3 * BLOCK
    return (x[i] * y[j] + x[i + k] * y[j + k]) + (x[i + m] * y[j + m] + x[i + n] * y[j + n])


def add_block(y, j, factor, x, i):
    """Add a multiple of a block to another."""
    a, b = y[j] + factor * x[i], y[j + 1] + factor * x[i + 1]
    c, d = y[j + 2] + factor * x[i + 2], y[j + 3] + factor * x[i + 3]
    e, f = y[j + 4] + factor * x[i + 4], y[j + 5] + factor * x[i + 5]
    g, h = y[j + 6] + factor * x[i + 6], y[j + 7] + factor * x[i + 7]
    y[j], y[j + 1], y[j + 2], y[j + 3], y[j + 4], y[j + 5], y[j + 6], y[j + 7] = a, b, c, d, e, f, g, h


def add_blocks(y, j, factor, x, i, other_factor, k):
    """Add multiples of two blocks of x to another block."""
    a, b = y[j] + factor * x[i] + other_factor * x[k], y[j + 1] + factor * x[i + 1] + other_factor * x[k + 1]
    c = y[j + 2] + factor * x[i + 2] + other_factor * x[k + 2]
    d = y[j + 3] + factor * x[i + 3] + other_factor * x[k + 3]
    e = y[j + 4] + factor * x[i + 4] + other_factor * x[k + 4]
    f = y[j + 5] + factor * x[i + 5] + other_factor * x[k + 5]
    g = y[j + 6] + factor * x[i + 6] + other_factor * x[k + 6]
    h = y[j + 7] + factor * x[i + 7] + other_factor * x[k + 7]
    y[j], y[j + 1], y[j + 2], y[j + 3], y[j + 4], y[j + 5], y[j + 6], y[j + 7] = a, b, c, d, e, f, g, h


def add_four_blocks(y, j, x, i, stride, d, e, f, g):
    """Add multiples of four blocks of x, a stride apart, to another block."""
    k, m, n = i + stride, i + 2 * stride, i + 3 * stride
    a = y[j] + d * x[i] + e * x[k] + f * x[m] + g * x[n]
    b = y[j + 1] + d * x[i + 1] + e * x[k + 1] + f * x[m + 1] + g * x[n + 1]
    c = y[j + 2] + d * x[i + 2] + e * x[k + 2] + f * x[m + 2] + g * x[n + 2]
    h = y[j + 3] + d * x[i + 3] + e * x[k + 3] + f * x[m + 3] + g * x[n + 3]
    o = y[j + 4] + d * x[i + 4] + e * x[k + 4] + f * x[m + 4] + g * x[n + 4]
    p = y[j + 5] + d * x[i + 5] + e * x[k + 5] + f * x[m + 5] + g * x[n + 5]
    q = y[j + 6] + d * x[i + 6] + e * x[k + 6] + f * x[m + 6] + g * x[n + 6]
    r = y[j + 7] + d * x[i + 7] + e * x[k + 7] + f * x[m + 7] + g * x[n + 7]
    y[j], y[j + 1], y[j + 2], y[j + 3], y[j + 4], y[j + 5], y[j + 6], y[j + 7] = a, b, c, h, o, p, q, r


def add_eight_blocks(y, j, x, i, stride, d, e, f, g, h, o, p, q):
    """Add multiples of eight blocks of x to another block: of two that are next but one, then a stride on."""
    a = y[j] + combine(x, i, stride, d, e, f, g, h, o, p, q)
    b = y[j + 1] + combine(x, i + 1, stride, d, e, f, g, h, o, p, q)
    c = y[j + 2] + combine(x, i + 2, stride, d, e, f, g, h, o, p, q)
    k = y[j + 3] + combine(x, i + 3, stride, d, e, f, g, h, o, p, q)
    m = y[j + 4] + combine(x, i + 4, stride, d, e, f, g, h, o, p, q)
    n = y[j + 5] + combine(x, i + 5, stride, d, e, f, g, h, o, p, q)
    r = y[j + 6] + combine(x, i + 6, stride, d, e, f, g, h, o, p, q)
    s = y[j + 7] + combine(x, i + 7, stride, d, e, f, g, h, o, p, q)
    y[j], y[j + 1], y[j + 2], y[j + 3], y[j + 4], y[j + 5], y[j + 6], y[j + 7] = a, b, c, k, m, n, r, s


def combine(x, i, stride, d, e, f, g, h, o, p, q):
    """Return the sum of multiples of numbers of eight blocks; see `add_eight_blocks`."""
    k, m, n, w = i + stride, i + 2 * stride, i + 3 * stride, 2 * BLOCK
    first = (d * x[i] + e * x[i + w]) + (f * x[k] + g * x[k + w])
    return first + ((h * x[m] + o * x[m + w]) + (p * x[n] + q * x[n + w]))


def take_block(y, j, x, i, factor):
    """Take a multiple of a block from another."""
    add_block(y, j, -factor, x, i)


def take_two_blocks(y, j, x, i, stride, factor, other_factor):
    """Take multiples of two blocks of x, a stride apart, from another block."""
    add_blocks(y, j, -factor, x, i, -other_factor, i + stride)


def take_four_blocks(y, j, x, i, stride, d, e, f, g):
    """Take multiples of four blocks of x, a stride apart, from another block."""
    add_four_blocks(y, j, x, i, stride, -d, -e, -f, -g)


def take_eight_blocks(y, j, x, i, stride, d, e, f, g, h, o, p, q):
    """Take multiples of eight blocks of x, a stride apart, from another block."""
    a = y[j] - sum_of_eight(x, i, stride, d, e, f, g, h, o, p, q)
    b = y[j + 1] - sum_of_eight(x, i + 1, stride, d, e, f, g, h, o, p, q)
    c = y[j + 2] - sum_of_eight(x, i + 2, stride, d, e, f, g, h, o, p, q)
    k = y[j + 3] - sum_of_eight(x, i + 3, stride, d, e, f, g, h, o, p, q)
    m = y[j + 4] - sum_of_eight(x, i + 4, stride, d, e, f, g, h, o, p, q)
    n = y[j + 5] - sum_of_eight(x, i + 5, stride, d, e, f, g, h, o, p, q)
    r = y[j + 6] - sum_of_eight(x, i + 6, stride, d, e, f, g, h, o, p, q)
    s = y[j + 7] - sum_of_eight(x, i + 7, stride, d, e, f, g, h, o, p, q)
    y[j], y[j + 1], y[j + 2], y[j + 3], y[j + 4], y[j + 5], y[j + 6], y[j + 7] = a, b, c, k, m, n, r, s


def sum_of_eight(x, i, stride, d, e, f, g, h, o, p, q):
    """Return the sum of multiples of numbers of eight blocks; see `take_eight_blocks`."""
    k, m, n = i + stride, i + 2 * stride, i + 3 * stride
    first = (d * x[i] + e * x[k]) + (f * x[m] + g * x[n])
    i, k, m, n = i + 4 * stride, k + 4 * stride, m + 4 * stride, n + 4 * stride
    return first + ((h * x[i] + o * x[k]) + (p * x[m] + q * x[n]))
