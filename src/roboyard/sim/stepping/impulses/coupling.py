"""Couplings of rows that are solved in turn: what an impulse changes in the wishes of those that follow."""

from __future__ import annotations

from roboyard.sim.stepping.impulses.blocks import dot_block, dot_two_blocks
from roboyard.sim.stepping.impulses.layout import (
    BEYOND,
    COUPLED,
    FIRST,
    FOURTH,
    FURTHER,
    HEAD,
    INVERSE,
    NEXT,
    OTHER,
    OVER,
    RUN,
    SECOND,
    STRIDE,
    THIRD,
    WIDTH,
)
from roboyard.sim.stepping.impulses.records import BLOCK


def couple(parts, places, lanes):  # pragma: no cover
    """Write the ends of runs and what units of impulse change in the wishes of rows that follow.

    A run is of quads, four contacts each of the same blocks and no further ones, or of other
    rows. Rows of a quad are coupled with all that follow in it, others with the next two normals or the next
    pair of their run. `RUN` of the first row is the end of its run, negative for one of quads.
    """
    for part in range(parts[parts.shape[0] - 1, 0]):
        n, last = parts[part, 2], parts[part, 3]
        while n < last:
            end = end_of_run(places, n, last, 1)
            places[n, RUN] = end
            if end < 0:
                end = -end
                for m in range(n, end, 4):
                    couple_quad(lanes, STRIDE * m)
            else:
                for m in range(n, end - 1):
                    couple_normal(places, lanes, m, m + 1, NEXT)
                    if m + 2 < end:
                        couple_normal(places, lanes, m, m + 2, OVER)
            n = end
        for kind in range(6, 10, 2):
            n, last = parts[part, kind], parts[part, kind + 1]
            while n < last:
                end = end_of_run(places, n, last, 2)
                places[n, RUN] = end
                if end < 0:
                    end = -end
                    for m in range(n, end, 8):
                        couple_quad_of_pairs(lanes, STRIDE * m)
                else:
                    for m in range(n, end - 2, 2):
                        couple_pair(places, lanes, m)
                n = end


def end_of_run(places, n, last, step):
    """Return the end of the rows from n on that are four of the same trees each, negative, or of others."""
    end = n
    while end + 3 * step < last and are_alike(places, end, step):
        end += 4 * step
    if end > n:
        return -end
    end = n + step
    while end < last and not (end + 3 * step < last and are_alike(places, end, step)):
        end += step
    return end


def are_alike(places, n, step):
    """Return whether four contacts are of the same two blocks and no further ones."""
    a, b, m = places[n, FIRST], places[n, SECOND], n + step
    o, p = m + step, m + 2 * step
    return (
        places[n, FURTHER] == 0
        and places[m, FIRST] == a
        and places[o, FIRST] == a
        and places[p, FIRST] == a
        and places[m, SECOND] == b
        and places[o, SECOND] == b
        and places[p, SECOND] == b
    )


def couple_normal(places, lanes, n, m, number):
    """Write what normal n changes in the wish of another one, which follows."""
    at, to = STRIDE * n, STRIDE * m
    lanes[at + number] = -lanes[to + INVERSE] * coupling(places, lanes, n, at + HEAD, m, to + HEAD)


def couple_quad(lanes, at):
    """Write what the first three normals of a quad change in the wishes of those that follow."""
    for k in range(3):
        x = at + STRIDE * k
        for m in range(k + 1, 4):
            y, number = at + STRIDE * m, NEXT
            if m == k + 2:
                number = OVER
            elif m == k + 3:
                number = BEYOND
            change = dot_two_blocks(lanes, x + HEAD, lanes, y + HEAD, x + HEAD + BLOCK, y + HEAD + BLOCK)
            lanes[x + number] = -lanes[y + INVERSE] * change


def couple_quad_of_pairs(lanes, at):
    """Write what the first three pairs of a quad change in the wishes of those that follow.

    There are four numbers for any two pairs, and six places in each: the first four are of the next pair,
    those of the last pair of the first and the third one. What remains are halves of the others.
    """
    second, third, last = at + 2 * STRIDE, at + 4 * STRIDE, at + 6 * STRIDE
    i, j, k, m = at + COUPLED, second + COUPLED, third + COUPLED, last + COUPLED
    couple_pairs(lanes, at, second, i, i + 2)
    couple_pairs(lanes, second, third, j, j + 2)
    couple_pairs(lanes, third, last, k, k + 2)
    couple_pairs(lanes, at, third, m, m + 2)
    couple_pairs(lanes, at, last, i + 4, j + 4)
    couple_pairs(lanes, second, last, k + 4, m + 4)


def couple_pairs(lanes, at, to, x, y):
    """Write what a pair changes in the wishes of another one of its quad, its first row at x."""
    i, k, j, m = at + 2 * HEAD, at + 2 * HEAD + 2 * BLOCK, to + 2 * HEAD, to + 2 * HEAD + 2 * BLOCK
    lanes[x] = dot_two_blocks(lanes, i, lanes, j, i + BLOCK, j + BLOCK)
    lanes[x + 1] = dot_two_blocks(lanes, i, lanes, m, i + BLOCK, m + BLOCK)
    lanes[y] = dot_two_blocks(lanes, k, lanes, j, k + BLOCK, j + BLOCK)
    lanes[y + 1] = dot_two_blocks(lanes, k, lanes, m, k + BLOCK, m + BLOCK)
    over_wish(lanes, to, x)
    over_wish(lanes, to, y)


def couple_pair(places, lanes, n):
    """Write what a pair changes in the wishes of the next one."""
    at = STRIDE * n
    to, i, k, at = at + 2 * STRIDE, at + 2 * HEAD, at + 2 * HEAD + 2 * BLOCK, at + COUPLED
    lanes[at] = coupling(places, lanes, n, i, n + 2, i + 2 * STRIDE)
    lanes[at + 1] = coupling(places, lanes, n, i, n + 3, k + 2 * STRIDE)
    lanes[at + 2] = coupling(places, lanes, n + 1, k, n + 2, i + 2 * STRIDE)
    lanes[at + 3] = coupling(places, lanes, n + 1, k, n + 3, k + 2 * STRIDE)
    over_wish(lanes, to, at)
    over_wish(lanes, to, at + 2)


def over_wish(lanes, to, at):
    """Turn changes of the velocities of a pair into those of its wishes."""
    lanes[at] *= -lanes[to + 2 * INVERSE]
    lanes[at + 1] *= -lanes[to + 2 * INVERSE + 1]


def coupling(places, lanes, n, x, m, y):
    """Return what a unit of impulse of row n changes in the velocity of row m.

    x, y: where the entries of both begin.
    """
    a, b, c, d = places[n, FIRST], places[n, SECOND], places[m, FIRST], places[m, SECOND]
    if a == c and b == d:
        total = dot_two_blocks(lanes, x, lanes, y, x + BLOCK, y + BLOCK)
        at, to = places[n, FURTHER], places[m, FURTHER]
        for j in range(0, BLOCK * (places[n, WIDTH] + places[n, OTHER]), BLOCK):
            total += dot_block(lanes, at + j, lanes, to + j)
        return total
    total = 0.0
    if a == c:
        total += dot_block(lanes, x, lanes, y)
    elif a == d:
        total += dot_block(lanes, x, lanes, y + BLOCK)
    if b == d:
        total += dot_block(lanes, x + BLOCK, lanes, y + BLOCK)
    elif b == c:
        total += dot_block(lanes, x + BLOCK, lanes, y)
    if places[n, FURTHER] > 0 or places[m, FURTHER] > 0:
        for i in range(2 + places[n, WIDTH] + places[n, OTHER]):
            for j in range(2 if i < 2 else 0, 2 + places[m, WIDTH] + places[m, OTHER]):
                if velocities_of(places, n, i) == velocities_of(places, m, j):
                    at, to = block_of(places, n, x, i), block_of(places, m, y, j)
                    total += dot_block(lanes, at, lanes, to)
    return total


def velocities_of(places, n, block):
    """Return where the velocities of a row's block begin."""
    if block < 2:
        return places[n, SECOND] if block == 1 else places[n, FIRST]
    block -= 2
    if block < places[n, WIDTH]:
        return places[n, THIRD] + BLOCK * block
    return places[n, FOURTH] + BLOCK * (block - places[n, WIDTH])


def block_of(places, n, at, block):
    """Return where a row's block begins, of which the first one begins at `at`."""
    return at + BLOCK * block if block < 2 else places[n, FURTHER] + BLOCK * (block - 2)
