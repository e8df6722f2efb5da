"""Where rows that are solved in turn have their numbers, their entries and the velocities that they change.

Velocities of each tree begin at a multiple of `BLOCK`. A row takes `STRIDE` numbers: its own (`GOAL` and
those that follow), then two blocks of entries: one for each of its trees, or two of the only one, so that
all that is known of a row of free bodies is three lines of the processor's cache, found by the row's place in
the order. Pairs of friction rows have their own numbers together, alternately, before the entries of both.
The second block of a row that needs none is of velocities that remain zero. Further blocks, of trees with
many degrees of freedom, come after all rows. Entries are scaled (see `scale`): they both give a row's
velocity and say what an impulse changes.
"""

from __future__ import annotations

from roboyard.sim.stepping.impulses.grouping import end_of_uncounted
from roboyard.sim.stepping.impulses.records import BLOCK, HALF_TURN

GOAL, IMPULSE, OWN, INVERSE, HIGH, YIELD, NEXT, OVER = range(8)
"""Numbers of a row: the impulse that it asks for at rest, impulse, velocity for a unit of impulse, impulse
for a unit of velocity, largest impulse (or coefficient of friction), share of its impulse that a row gives up
where it yields, what a unit of a normal's impulse changes in the wishes of the next two; see `couple`."""
BEYOND = HIGH
"""The same of the third normal after this one; normals have no largest impulse."""
LOW = NEXT
"""Least impulse of a row of joints, which has no couplings."""
CUT = HIGH
"""Of the second row of a pair, whose bound is the first one's: the share of its wishes that a pair got when
it last slid."""
HEAD = 8
"""Numbers before a row's entries."""
STRIDE = HEAD + 2 * BLOCK
COUPLED = 10
"""The first of six places of couplings among the 16 numbers of a pair."""
FIRST, SECOND, NORMAL, FURTHER, WIDTH, THIRD, OTHER, FOURTH, RUN, PLACES = range(10)
"""Whole numbers of a row: where the velocities of its blocks begin; where the impulse of its contact's normal
is; where its further blocks begin (0 for none), how many of them each tree has and where their velocities
begin; the end of its run of rows that are solved alike, see `couple`."""


def lay_out(  # pragma: no cover
    rows, spans, goals, ends, jacobian, scaled, roots, diagonal, tree_dofs, slots, places, lanes, velocities
):  # fmt: skip
    """Write the places and numbers of all rows, and no velocity; see `couple`.

    Returns the number of the last row that no impulse moves, or -1.
    """
    still, unmoved = 0, -1
    for tree in range(tree_dofs.shape[0]):
        slots[tree] = still
        still += (tree_dofs[tree] + BLOCK - 1) // BLOCK * BLOCK
    for k in range(still + BLOCK):
        velocities[k] = 0.0
    further = STRIDE * ends[4]
    for n in range(ends[4]):
        at, a, b = STRIDE * n, rows[n, 1], rows[n, 2]
        size, others, dof = spans[n, 1], spans[n, 3], spans[n, 0]
        if size == 0:
            a, size, others, dof = b, others, 0, spans[n, 2]
        if n < ends[0] and others == 0 and diagonal[a] == 0:  # motors move no links beyond theirs
            while size > BLOCK and scaled[n, size - 1] == 0.0:
                size -= 1
        number, step, to = at, 1, at + HEAD
        if n >= ends[2]:  # of a pair
            step = 2
            if (n - ends[2]) % 2 == 0:
                to += HEAD
            else:
                number = at - STRIDE + 1
        own = goals[n, 4] - goals[n, 5]
        if diagonal[a] == 1:
            own += scale_block(lanes, to, jacobian, n, 0, size, roots, dof)
        else:
            own += copy_block(lanes, to, scaled, n, 0, size)
        first, second = slots[a], slots[b] if others > 0 else still
        if others > 0 and diagonal[b] == 1:
            own += scale_block(lanes, to + BLOCK, jacobian, n, size, others, roots, spans[n, 2])
        elif others > 0:
            own += copy_block(lanes, to + BLOCK, scaled, n, size, others)
        else:
            own += copy_block(lanes, to + BLOCK, scaled, n, BLOCK, size - BLOCK)
            if size > BLOCK:
                second = first + BLOCK
        places[n, FIRST], places[n, SECOND] = first, second
        places[n, NORMAL] = STRIDE * rows[n, 3] + IMPULSE
        places[n, FURTHER] = places[n, WIDTH] = places[n, OTHER] = 0
        done = BLOCK if others > 0 else 2 * BLOCK
        if size > done or others > BLOCK:
            places[n, FURTHER], places[n, THIRD], places[n, FOURTH] = further, first + done, second + BLOCK
            for k in range(done, size, BLOCK):
                own += copy_block(lanes, further, scaled, n, k, size - k)
                further += BLOCK
                places[n, WIDTH] += 1
            for k in range(BLOCK, others, BLOCK):
                own += copy_block(lanes, further, scaled, n, size + k, others - k)
                further += BLOCK
                places[n, OTHER] += 1
        inverse = 1.0 / own if own > 1e-15 else 0.0
        if inverse == 0.0:
            unmoved, goals[n, 3] = n, -1.0
        lanes[number + GOAL * step] = goals[n, 0] * inverse
        lanes[number + IMPULSE * step] = 0.0
        lanes[number + OWN * step] = 2.0 * own if rows[n, 3] == HALF_TURN else own
        lanes[number + INVERSE * step] = inverse
        lanes[number + HIGH * step] = goals[n, 2]
        if n < ends[2]:
            lanes[at + YIELD], lanes[at + LOW] = goals[n, 4] * inverse, goals[n, 1]
    return unmoved


def leave_uncounted(parts, part, goals, ends, lanes, residual):
    """Let rows not count whose changes Bullet loses; return the residual at which the rounds end."""
    last, end = end_of_uncounted(parts, part, goals)
    for kind in range(last + 1 if last > 0 else 0):
        for n in range(parts[part, 2 * kind], end if kind == last else parts[part, 2 * kind + 1]):
            if n < ends[2]:
                lanes[STRIDE * n + OWN] = 0.0
            else:
                lanes[STRIDE * (n - (n - ends[2]) % 2) + 2 * OWN + (n - ends[2]) % 2] = 0.0
    return -1.0 if last == 4 and end == parts[part, 9] else residual


def scale_block(lanes, to, entries, n, at, size, roots, first):
    """Write a tree's entries, at most `BLOCK`, into a block, scaled; return its square."""
    if size == 6:  # written out, as in `dot_block`
        a, b = entries[n, at] * roots[first], entries[n, at + 1] * roots[first + 1]
        c, d = entries[n, at + 2] * roots[first + 2], entries[n, at + 3] * roots[first + 3]
        e, f = entries[n, at + 4] * roots[first + 4], entries[n, at + 5] * roots[first + 5]
        lanes[to], lanes[to + 1], lanes[to + 2], lanes[to + 3], lanes[to + 4] = a, b, c, d, e
        lanes[to + 5], lanes[to + 6], lanes[to + 7] = f, 0.0, 0.0
        return a * a + b * b + c * c + d * d + e * e + f * f
    total = 0.0
    for k in range(BLOCK):
        value = entries[n, at + k] * roots[first + k] if k < size else 0.0
        lanes[to + k] = value
        total += value * value
    return total


def copy_block(lanes, to, entries, n, at, size):
    """Write scaled entries, of which there may be more, into a block; return its square."""
    total = 0.0
    for k in range(BLOCK):
        value = entries[n, at + k] if k < size else 0.0
        lanes[to + k] = value
        total += value * value
    return total
