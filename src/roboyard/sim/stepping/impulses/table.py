"""Rows solved in turn with a table of their effects on each other, where there are few.

What a row wishes for, the change of its impulse with which it would get what it asks for, is kept up to date.
It is known once the rows before it have been solved. The processor would wait for each wish to be written to
memory and read again; so up to eight rows are solved at once, from their wishes before any of them and their
effects on each other, before what they take from all wishes is written.
"""

from __future__ import annotations

import numpy as np

from roboyard.sim.stepping.impulses.blocks import (
    add_block,
    add_blocks,
    take_block,
    take_eight_blocks,
    take_four_blocks,
    take_two_blocks,
)
from roboyard.sim.stepping.impulses.grouping import end_of_uncounted
from roboyard.sim.stepping.impulses.records import (
    BLOCK,
    CUT,
    HALF_TURN,
    HIGH,
    IMPULSE,
    INVERSE,
    LOW,
    OWN,
    WISH,
)


def solve_by_table(  # pragma: no cover
    rows, spans, goals, ends, parts, across, rounds, residual, is_pyramid, table, lines, change
):
    """Do what `solve_in_turn` does, for a bounded number of rows, with their effect on each other.

    across: (nv * n,) or longer, scaled entries of the rows, n rounded up to whole blocks. table: (n * n,) or
    longer, what unit impulses of a row take from the wishes of all, written. lines: (n * LINES,) or longer,
    work array.
    """
    count = ends[4]
    width = (count + BLOCK - 1) // BLOCK * BLOCK
    unmoved = write_table(rows, spans, goals, count, across, table, lines, width)
    most = 0.0
    for part in range(parts[parts.shape[0] - 1, 0]):
        done = 0.0
        least = residual
        if unmoved >= ends[0]:
            least = leave_uncounted(parts, part, goals, lines, width, residual)
        joints, joints_end = parts[part, 0], parts[part, 1]
        normals, normals_end = parts[part, 2], parts[part, 3]
        while done < rounds:
            if done % 2.0 == 1.0:
                worst = push_rows(lines, table, joints, joints_end - joints, 1, width)
            else:
                worst = push_rows(lines, table, joints_end - 1, joints_end - joints, -1, width)
            worst = max(worst, push_rows(lines, table, normals, normals_end - normals, 1, width))
            for kind in range(6 if is_pyramid else 4, 10 if is_pyramid else 6, 2):
                for n in range(parts[part, kind], parts[part, kind + 1]):
                    bound = lines[HIGH * width + n] * max(lines[IMPULSE * width + rows[n, 3]], 0.0)
                    if bound > 0.0:
                        worst = max(worst, push(lines, table, n, -bound, bound, width))
            for kind in range(10 if is_pyramid else 6, 10, 2):
                first, end = parts[part, kind], parts[part, kind + 1]
                if first < end:
                    worst = max(worst, slide_rows(lines, table, rows, first, ends[3], end, width))
            done += 1.0
            if worst <= least:
                break
        most = max(most, done)
    for n in range(count):
        goals[n, 3] = lines[IMPULSE * width + n]
    for d in range(change.shape[0]):
        total = 0.0
        for n in range(count):
            total += lines[IMPULSE * width + n] * across[d * width + n]
        change[d] = total
    return most


def write_table(rows, spans, goals, count, across, table, lines, width):
    """Write what unit impulses take from the wishes of rows, and the lines before the first round.

    Returns the number of the last row that no impulse moves, or -1.
    """
    unmoved = -1
    for k in range(count, width):
        lines[INVERSE * width + k] = lines[WISH * width + k] = 0.0
    for n in range(count):
        at = n * width
        for k in range(width):
            table[at + k] = 0.0
        first, size, other = spans[n, 0], spans[n, 1], spans[n, 2]
        listed = i = j = m = 0
        for k in range(size + spans[n, 3]):
            d = first + k if k < size else other + k - size
            if across[d * width + n] == 0.0:
                continue
            listed += 1
            if listed == 4:
                add_products(table, at, across, n, i, j, m, d, width)
                listed = 0
            i, j, m = j, m, d
        if listed > 2:
            add_product(table, at, across, n, i, width)
        if listed > 1:
            add_product(table, at, across, n, j, width)
        if listed > 0:
            add_product(table, at, across, n, m, width)
        own = table[at + n] + goals[n, 4] - goals[n, 5]
        inverse = 1.0 / own if own > 1e-15 else 0.0
        lines[INVERSE * width + n] = inverse
        lines[OWN * width + n] = 2.0 * own if rows[n, 3] == HALF_TURN else own
        if inverse == 0.0:
            unmoved, goals[n, 3] = n, -1.0
        lines[WISH * width + n] = goals[n, 0] * inverse
        lines[LOW * width + n], lines[HIGH * width + n] = goals[n, 1], goals[n, 2]
        lines[IMPULSE * width + n] = 0.0
    for n in range(count):
        at = n * width
        for k in range(width):
            table[at + k] *= lines[INVERSE * width + k]
        table[at + n] = 1.0 + goals[n, 5] * lines[INVERSE * width + n]
    return unmoved


def leave_uncounted(parts, part, goals, lines, width, residual):
    """Let rows not count whose changes Bullet loses; return the residual at which the rounds end."""
    last, end = end_of_uncounted(parts, part, goals)
    for kind in range(last + 1 if last > 0 else 0):
        for n in range(parts[part, 2 * kind], end if kind == last else parts[part, 2 * kind + 1]):
            lines[OWN * width + n] = 0.0
    return -1.0 if last == 4 and end == parts[part, 9] else residual


def add_products(table, at, across, n, a, b, c, d, width):
    """Add what four degrees of freedom contribute to the products of row n with all."""
    a, b, c, d = a * width, b * width, c * width, d * width
    e, f, g, h = across[a + n], across[b + n], across[c + n], across[d + n]
    for k in range(0, width, BLOCK):
        add_blocks(table, at + k, e, across, a + k, f, b + k)
        add_blocks(table, at + k, g, across, c + k, h, d + k)


def add_product(table, at, across, n, d, width):
    """Do what `add_products` does for one degree of freedom."""
    factor = across[d * width + n]
    for k in range(0, width, BLOCK):
        add_block(table, at + k, factor, across, d * width + k)


def push(lines, table, n, low, high, width):
    """Set a row's impulse between low and high; return the square of the change of its velocity."""
    delta = between(lines, n, width, lines[WISH * width + n], low, high)
    for k in range(0, width, BLOCK):
        take_block(lines, WISH * width + k, table, n * width + k, delta)
    delta *= lines[OWN * width + n]
    return delta * delta


def push_rows(lines, table, first, count, step, width):
    """Set the impulses of so many rows within their bounds, in turn; return the largest change."""
    worst, n, stride = 0.0, first, step * width
    for _ in range(count // 8):
        m = n + 4 * step
        x, y, z, w = asked(lines, n, step, width)
        p, q, r, s = asked(lines, m, step, width)
        at = n * width
        x, y, z, w = push_four(lines, table, n, step, at, stride, width, x, y, z, w)
        p -= effect(table, at + m, stride, x, y, z, w)
        q -= effect(table, at + m + step, stride, x, y, z, w)
        r -= effect(table, at + m + 2 * step, stride, x, y, z, w)
        s -= effect(table, at + m + 3 * step, stride, x, y, z, w)
        p, q, r, s = push_four(lines, table, m, step, at + 4 * stride, stride, width, p, q, r, s)
        for k in range(0, width, BLOCK):
            take_eight_blocks(lines, WISH * width + k, table, at + k, stride, x, y, z, w, p, q, r, s)
        worst = max(worst, change_of(lines, OWN * width + n, step, x, y, z, w))
        worst = max(worst, change_of(lines, OWN * width + m, step, p, q, r, s))
        n += 8 * step
    if count % 8 >= 4:
        at = n * width
        x, y, z, w = asked(lines, n, step, width)
        x, y, z, w = push_four(lines, table, n, step, at, stride, width, x, y, z, w)
        for k in range(0, width, BLOCK):
            take_four_blocks(lines, WISH * width + k, table, at + k, stride, x, y, z, w)
        worst = max(worst, change_of(lines, OWN * width + n, step, x, y, z, w))
        n += 4 * step
    for _ in range(count % 4):
        low, high = lines[LOW * width + n], lines[HIGH * width + n]
        worst = max(worst, push(lines, table, n, low, high, width))
        n += step
    return worst


def push_four(lines, table, n, step, at, stride, width, x, y, z, w):
    """Set the impulses of four rows, from n on, that wish for changes of x, y, z, w; return the changes."""
    i, j, k = n + step, n + 2 * step, n + 3 * step
    x = within(lines, n, width, x)
    y = within(lines, i, width, y - x * table[at + i])
    z = within(lines, j, width, (z - x * table[at + j]) - y * table[at + stride + j])
    w = (w - x * table[at + k]) - y * table[at + stride + k]
    w = within(lines, k, width, w - z * table[at + 2 * stride + k])
    return x, y, z, w


def within(lines, n, width, delta):
    """Set a row's impulse, of which it wishes for a change, within its bounds; return the change."""
    return between(lines, n, width, delta, lines[LOW * width + n], lines[HIGH * width + n])


def between(lines, n, width, delta, low, high):
    """Set a row's impulse, of which it wishes for a change, between low and high; return the change.

    Rows are within their bounds, or at them, in almost all rounds: the processor goes on with what it expects
    and need not wait for least and greatest numbers. Without the stores at CUT LLVM takes these.
    """
    at = IMPULSE * width + n
    impulse = lines[at]
    new = impulse + delta
    if new < low:
        lines[at] = lines[CUT * width + n] = low
        return low - impulse
    if new > high:
        lines[at] = lines[CUT * width + n] = high
        return high - impulse
    lines[at] = new
    return delta


def asked(lines, n, step, width):
    """Return the changes of impulse that four rows from n on ask for."""
    at = WISH * width + n
    return lines[at], lines[at + step], lines[at + 2 * step], lines[at + 3 * step]


def effect(table, at, stride, x, y, z, w):
    """Return what four impulses take from a wish, of the first of which the table has the part at `at`."""
    first = x * table[at] + y * table[at + stride]
    return first + (z * table[at + 2 * stride] + w * table[at + 3 * stride])


def change_of(lines, at, step, x, y, z, w):
    """Return the square of the largest change of velocity of four rows."""
    x *= lines[at]
    y *= lines[at + step]
    z *= lines[at + 2 * step]
    w *= lines[at + 3 * step]
    return max(max(x * x, y * y), max(z * z, w * w))


def slide_rows(lines, table, rows, first, sliding, stop, width):
    """Do what `push_rows` does for pairs of friction rows, which share a bound, of the last ones slid."""
    worst, n = 0.0, first
    for _ in range((stop - first) // 8):
        m, at = n + 4, n * width
        x, y, z, w = asked(lines, n, 1, width)
        p, q, r, s = asked(lines, m, 1, width)
        x, y, z, w = slide_two(lines, table, rows, n, sliding, width, x, y, z, w)
        p -= effect(table, at + m, width, x, y, z, w)
        q -= effect(table, at + m + 1, width, x, y, z, w)
        r -= effect(table, at + m + 2, width, x, y, z, w)
        s -= effect(table, at + m + 3, width, x, y, z, w)
        p, q, r, s = slide_two(lines, table, rows, m, sliding, width, p, q, r, s)
        for k in range(0, width, BLOCK):
            take_eight_blocks(lines, WISH * width + k, table, at + k, width, x, y, z, w, p, q, r, s)
        own = OWN * width + n
        worst = max(worst, max(slip_of(lines, own, x, y), slip_of(lines, own + 2, z, w)))
        worst = max(worst, max(slip_of(lines, own + 4, p, q), slip_of(lines, own + 6, r, s)))
        n += 8
    if (stop - first) % 8 >= 4:
        x, y, z, w = asked(lines, n, 1, width)
        x, y, z, w = slide_two(lines, table, rows, n, sliding, width, x, y, z, w)
        for k in range(0, width, BLOCK):
            take_four_blocks(lines, WISH * width + k, table, n * width + k, width, x, y, z, w)
        own = OWN * width + n
        worst = max(worst, max(slip_of(lines, own, x, y), slip_of(lines, own + 2, z, w)))
        n += 4
    if n < stop:
        x, y = lines[WISH * width + n], lines[WISH * width + n + 1]
        x, y = slide(lines, rows, n, sliding, width, x, y)
        for k in range(0, width, BLOCK):
            take_two_blocks(lines, WISH * width + k, table, n * width + k, width, x, y)
        worst = max(worst, slip_of(lines, OWN * width + n, x, y))
    return worst


def slide_two(lines, table, rows, n, sliding, width, x, y, z, w):
    """Do what `push_four` does for two pairs of friction rows; see `slide`."""
    at = n * width + n
    x, y = slide(lines, rows, n, sliding, width, x, y)
    z = (z - x * table[at + 2]) - y * table[at + width + 2]
    w = (w - x * table[at + 3]) - y * table[at + width + 3]
    z, w = slide(lines, rows, n + 2, sliding, width, z, w)
    return x, y, z, w


def slip_of(lines, at, x, y):
    """Return the square of the change of velocity of a pair of friction rows, added up as Bullet does."""
    both = x * lines[at] + y * lines[at + 1]
    return both * both


def slide(lines, rows, n, sliding, width, x, y):
    """Set the impulses of a pair of friction rows; return their changes, of which it wishes for x and y.

    The pairs from `sliding` on have none without a normal impulse, those before remain then.
    """
    at = IMPULSE * width + n
    bound = lines[HIGH * width + n] * max(lines[IMPULSE * width + rows[n, 3]], 0.0)
    if bound > 0.0 or n >= sliding:
        old, other_old = lines[at], lines[at + 1]
        new, other_new = old + x, other_old + y
        square = new * new + other_new * other_new
        if square > bound * bound:
            factor = bound / np.sqrt(square)
            new *= factor
            other_new *= factor
            lines[CUT * width + n] = factor  # without a store LLVM takes the root of all rows
            x, y = new - old, other_new - other_old
        lines[at], lines[at + 1] = new, other_new
        return x, y
    return 0.0, 0.0
