"""Rows solved in turn, with their entries and the velocities that they change side by side for the processor.

Velocities of each tree begin at a multiple of `BLOCK`. A row takes `STRIDE` numbers: its own (`GOAL` and
those that follow), then a block of entries for each of its trees, so that all that is known of a row of free
bodies is three lines of the processor's cache, found by the row's place in the order. What is fixed has a
block, too, of velocities that remain zero. Further blocks, of trees with more than `BLOCK` degrees of
freedom, come after all rows. Entries are scaled (see `scale`): they both give a row's velocity and say what
an impulse changes.
"""

from __future__ import annotations

import numpy as np

from roboyard.sim.stepping.impulses.records import BLOCK

GOAL, IMPULSE, OWN, YIELD, INVERSE, NEXT, OVER, HIGH = range(8)
"""Numbers of a row: the impulse that it asks for at rest, impulse, velocity for a unit of impulse, share of
its impulse that a row gives up where it yields, impulse for a unit of velocity, what a unit of impulse
changes in the wishes of rows that follow (see `couple`), largest impulse (or coefficient of friction)."""
LOW = NEXT
"""Least impulse of a row of joints, which has no couplings."""
CUT = HIGH
"""Share of its wishes that a sliding pair gets: of the second row, which is bounded by the first one's."""
HEAD = 8
"""Numbers before a row's entries."""
STRIDE = HEAD + 2 * BLOCK
FIRST, SECOND, NORMAL, FURTHER, WIDTH, OTHER, PLACES = range(7)
"""Whole numbers of a row: where the velocities of both its trees begin, where the impulse of its contact's
normal is, where its further blocks begin (0 for none), and how many of them each tree has."""


def lay_out(  # pragma: no cover
    rows, spans, goals, ends, jacobian, scaled, roots, diagonal, tree_dofs, slots, places, lanes, velocities
):  # fmt: skip
    """Write the places and numbers of all rows, and no velocity; see `couple`."""
    still = 0
    for tree in range(tree_dofs.shape[0]):
        slots[tree] = still
        still += (tree_dofs[tree] + BLOCK - 1) // BLOCK * BLOCK
    for k in range(still + BLOCK):
        velocities[k] = 0.0
    further = STRIDE * ends[4]
    for n in range(ends[4]):
        at, a, b = STRIDE * n, rows[n, 1], rows[n, 2]
        size, others = spans[n, 1], spans[n, 3]
        places[n, FIRST] = slots[a] if size > 0 else still
        places[n, SECOND] = slots[b] if others > 0 else still
        places[n, NORMAL] = STRIDE * rows[n, 3] + IMPULSE
        places[n, FURTHER] = 0
        number, step, to = at, 1, at + HEAD
        if n >= ends[2]:
            step = 2
            if (n - ends[2]) % 2 == 0:
                to += HEAD
            else:
                number = at - STRIDE + 1
        own = goals[n, 4]
        if size > 0 and diagonal[a] == 1:
            own += scale_block(lanes, to, jacobian, n, 0, size, roots, spans[n, 0])
        else:
            own += copy_block(lanes, to, scaled, n, 0, size)
        if others > 0 and diagonal[b] == 1:
            own += scale_block(lanes, to + BLOCK, jacobian, n, size, others, roots, spans[n, 2])
        else:
            own += copy_block(lanes, to + BLOCK, scaled, n, size, others)
        if size > BLOCK or others > BLOCK:
            places[n, FURTHER] = further
            places[n, WIDTH] = max(size - 1, 0) // BLOCK
            places[n, OTHER] = max(others - 1, 0) // BLOCK
            for k in range(BLOCK, size, BLOCK):
                own += copy_block(lanes, further, scaled, n, k, size - k)
                further += BLOCK
            for k in range(BLOCK, others, BLOCK):
                own += copy_block(lanes, further, scaled, n, size + k, others - k)
                further += BLOCK
        inverse = 1.0 / own if own > 1e-15 else 0.0
        lanes[number + GOAL * step] = goals[n, 0] * inverse
        lanes[number + IMPULSE * step] = 0.0
        lanes[number + OWN * step] = own
        lanes[number + YIELD * step] = goals[n, 4] * inverse
        lanes[number + INVERSE * step] = inverse
        lanes[number + LOW * step] = goals[n, 1]
        lanes[number + HIGH * step] = goals[n, 2]


def scale_block(lanes, to, entries, n, at, size, roots, first):
    """Write entries of a tree of at most `BLOCK` degrees of freedom into a block, scaled; return its square."""
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


def couple(ends, places, lanes):  # pragma: no cover
    """Write what impulses change in the wishes of rows that follow.

    These are the next two normals for a normal, the next pair for a row of a pair.
    """
    first, last = ends[0], ends[1]
    for n in range(first, last):
        at = STRIDE * n
        if n + 1 < last:
            lanes[at + NEXT] = -lanes[at + STRIDE + INVERSE] * coupling(
                places, lanes, n, at + HEAD, n + 1, at + STRIDE + HEAD
            )
        if n + 2 < last:
            lanes[at + OVER] = -lanes[at + 2 * STRIDE + INVERSE] * coupling(
                places, lanes, n, at + HEAD, n + 2, at + 2 * STRIDE + HEAD
            )
    for n in range(ends[2], ends[4] - 2, 2):
        x, y = STRIDE * n + 2 * HEAD, STRIDE * (n + 1) + HEAD
        at = STRIDE * n + 2 * NEXT
        to, other = -lanes[STRIDE * (n + 2) + 2 * INVERSE], -lanes[STRIDE * (n + 2) + 2 * INVERSE + 1]
        xx = coupling(places, lanes, n, x, n + 2, x + 2 * STRIDE)
        xy = coupling(places, lanes, n, x, n + 3, y + 2 * STRIDE)
        yx = coupling(places, lanes, n + 1, y, n + 2, x + 2 * STRIDE)
        yy = coupling(places, lanes, n + 1, y, n + 3, y + 2 * STRIDE)
        lanes[at], lanes[at + 1], lanes[at + 2], lanes[at + 3] = to * xx, other * xy, to * yx, other * yy


def coupling(places, lanes, n, x, m, y):
    """Return what a unit of impulse of row n changes in the velocity of row m."""
    a, b, c, d = places[n, FIRST], places[n, SECOND], places[m, FIRST], places[m, SECOND]
    if a == c and b == d:
        total = dot_two_blocks(lanes, x, lanes, y, x + BLOCK, y + BLOCK)
    else:
        total = 0.0
        if a == c:
            total += dot_block(lanes, x, lanes, y)
        elif a == d:
            total += dot_block(lanes, x, lanes, y + BLOCK)
        if b == d:
            total += dot_block(lanes, x + BLOCK, lanes, y + BLOCK)
        elif b == c:
            total += dot_block(lanes, x + BLOCK, lanes, y)
    if places[n, FURTHER] > 0 and places[m, FURTHER] > 0:
        x, y = places[n, FURTHER], places[m, FURTHER]
        wide, high = BLOCK * places[n, WIDTH], BLOCK * places[m, WIDTH]
        if a == c:
            total += dot_further(lanes, x, y, places[n, WIDTH])
        elif a == d:
            total += dot_further(lanes, x, y + high, places[n, WIDTH])
        if b == d:
            total += dot_further(lanes, x + wide, y + high, places[n, OTHER])
        elif b == c:
            total += dot_further(lanes, x + wide, y, places[n, OTHER])
    return total


def dot_further(lanes, x, y, blocks):
    """Return the product of so many blocks."""
    total = 0.0
    for j in range(0, BLOCK * blocks, BLOCK):
        total += dot_block(lanes, x + j, lanes, y + j)
    return total


def dot_block(x, i, y, j):
    """Return the product of two blocks; written out, for LLVM makes two instructions of it so."""
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
    """Return the sum of the products of x's blocks at i and k with y's at j and m; written out, too.

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


def add_block(y, j, factor, x, i):
    """Add a multiple of a block to another; written out, too."""
    a, b = y[j] + factor * x[i], y[j + 1] + factor * x[i + 1]
    c, d = y[j + 2] + factor * x[i + 2], y[j + 3] + factor * x[i + 3]
    e, f = y[j + 4] + factor * x[i + 4], y[j + 5] + factor * x[i + 5]
    g, h = y[j + 6] + factor * x[i + 6], y[j + 7] + factor * x[i + 7]
    y[j], y[j + 1], y[j + 2], y[j + 3], y[j + 4], y[j + 5], y[j + 6], y[j + 7] = a, b, c, d, e, f, g, h


def speed_of(lanes, places, n, velocities):
    """Return the velocity of a row."""
    at, a, b = STRIDE * n + HEAD, places[n, FIRST], places[n, SECOND]
    total = dot_two_blocks(lanes, at, velocities, a, at + BLOCK, b)
    at = places[n, FURTHER]
    if at > 0:
        width, other = BLOCK * places[n, WIDTH], BLOCK * places[n, OTHER]
        for j in range(0, width, BLOCK):
            total += dot_block(lanes, at + j, velocities, a + BLOCK + j)
        for j in range(0, other, BLOCK):
            total += dot_block(lanes, at + width + j, velocities, b + BLOCK + j)
    return total


def push_row(lanes, places, n, impulse, velocities):
    """Change velocities by an impulse of a row."""
    at, a, b = STRIDE * n + HEAD, places[n, FIRST], places[n, SECOND]
    add_block(velocities, a, impulse, lanes, at)
    add_block(velocities, b, impulse, lanes, at + BLOCK)
    at = places[n, FURTHER]
    if at > 0:
        width, other = BLOCK * places[n, WIDTH], BLOCK * places[n, OTHER]
        for j in range(0, width, BLOCK):
            add_block(velocities, a + BLOCK + j, impulse, lanes, at + j)
        for j in range(0, other, BLOCK):
            add_block(velocities, b + BLOCK + j, impulse, lanes, at + width + j)


def add_blocks(y, j, factor, x, i, other_factor, k):
    """Add multiples of two blocks of x to another block; written out, too."""
    a, b = y[j] + factor * x[i] + other_factor * x[k], y[j + 1] + factor * x[i + 1] + other_factor * x[k + 1]
    c = y[j + 2] + factor * x[i + 2] + other_factor * x[k + 2]
    d = y[j + 3] + factor * x[i + 3] + other_factor * x[k + 3]
    e = y[j + 4] + factor * x[i + 4] + other_factor * x[k + 4]
    f = y[j + 5] + factor * x[i + 5] + other_factor * x[k + 5]
    g = y[j + 6] + factor * x[i + 6] + other_factor * x[k + 6]
    h = y[j + 7] + factor * x[i + 7] + other_factor * x[k + 7]
    y[j], y[j + 1], y[j + 2], y[j + 3], y[j + 4], y[j + 5], y[j + 6], y[j + 7] = a, b, c, d, e, f, g, h


def push_pair(lanes, places, n, impulse, other_impulse, velocities):
    """Change velocities by impulses of row n and the next one, of the same trees."""
    at, a, b = STRIDE * n + 2 * HEAD, places[n, FIRST], places[n, SECOND]
    add_blocks(velocities, a, impulse, lanes, at, other_impulse, at + 2 * BLOCK)
    add_blocks(velocities, b, impulse, lanes, at + BLOCK, other_impulse, at + 3 * BLOCK)
    at, further = places[n, FURTHER], places[n + 1, FURTHER]
    if at > 0:
        width, other = BLOCK * places[n, WIDTH], BLOCK * places[n, OTHER]
        for j in range(0, width, BLOCK):
            add_blocks(velocities, a + BLOCK + j, impulse, lanes, at + j, other_impulse, further + j)
        for j in range(width, width + other, BLOCK):
            add_blocks(velocities, b + BLOCK + j - width, impulse, lanes, at + j, other_impulse, further + j)


def wish_of(lanes, places, n, velocities):
    """Return the change of impulse with which a row, unless it yields, would get what it asks for."""
    at = STRIDE * n
    return lanes[at + GOAL] - lanes[at + INVERSE] * speed_of(lanes, places, n, velocities)


def wishes_of(lanes, places, n, velocities):
    """Do what `wish_of` does for row n and the next one, of the same trees."""
    at, a, b = STRIDE * n, places[n, FIRST], places[n, SECOND]
    i, k = at + 2 * HEAD, at + 2 * HEAD + 2 * BLOCK
    x = dot_two_blocks(lanes, i, velocities, a, i + BLOCK, b)
    y = dot_two_blocks(lanes, k, velocities, a, k + BLOCK, b)
    if places[n, FURTHER] > 0:
        width, others = BLOCK * places[n, WIDTH], BLOCK * places[n, OTHER]
        i, k = places[n, FURTHER], places[n + 1, FURTHER]
        for j in range(0, width, BLOCK):
            x += dot_block(lanes, i + j, velocities, a + BLOCK + j)
            y += dot_block(lanes, k + j, velocities, a + BLOCK + j)
        for j in range(0, others, BLOCK):
            x += dot_block(lanes, i + width + j, velocities, b + BLOCK + j)
            y += dot_block(lanes, k + width + j, velocities, b + BLOCK + j)
    goal, inverse = at + 2 * GOAL, at + 2 * INVERSE
    return lanes[goal] - lanes[inverse] * x, lanes[goal + 1] - lanes[inverse + 1] * y


def set_impulse(lanes, places, n, impulse, velocities):
    """Set the impulse of a row; return the square of the change of its velocity."""
    at = STRIDE * n
    delta = impulse - lanes[at + IMPULSE]
    if delta == 0.0:
        return 0.0
    lanes[at + IMPULSE] = impulse
    push_row(lanes, places, n, delta, velocities)
    delta *= lanes[at + OWN]
    return delta * delta


def solve_in_turn(  # pragma: no cover
    rows, spans, goals, ends, parts, jacobian, scaled, roots, diagonal, tree_dof, tree_dofs, slots, places,
    lanes, velocities, rounds, residual, change,
):  # fmt: skip
    """Solve row by row, each with the changes of velocity that the others have made, in several rounds.

    Motors and limits are taken backwards and forwards by turns. Rounds of a group end when none of its rows
    changes its velocity by more than the root of the residual, or after `rounds`: motors of joints with
    nearly parallel axes, or at their largest impulse, have not converged by then. Normals only push, without
    a bound. The two sliding rows of a contact share one bound, the normal's impulse in this round times the
    coefficient. Returns the largest number of rounds.

    rows, ..., diagonal: see `Solver`; scaled entries are those of trees whose inertia is not diagonal.
    slots: (ntree,), places: (n, PLACES), lanes: (m,) and velocities: (k,), work arrays. change: (nv,) sums of
    scaled entries by impulses, written.
    """
    lay_out(
        rows, spans, goals, ends, jacobian, scaled, roots, diagonal, tree_dofs, slots, places, lanes,
        velocities,
    )  # fmt: skip
    couple(ends, places, lanes)
    most = 0.0
    for part in range(parts[parts.shape[0] - 1, 0]):
        done = 0.0
        joints, joints_end = parts[part, 0], parts[part, 1]
        normals, normals_end = parts[part, 2], parts[part, 3]
        rolling, rolling_end = parts[part, 6], parts[part, 7]
        sliding, sliding_end = parts[part, 8], parts[part, 9]
        while done < rounds:
            worst = 0.0
            for i in range(joints_end - joints):
                n = joints + i if done % 2.0 == 1.0 else joints_end - 1 - i
                at = STRIDE * n
                old = lanes[at + IMPULSE]
                wish = old + wish_of(lanes, places, n, velocities) - lanes[at + YIELD] * old
                impulse = min(max(wish, lanes[at + LOW]), lanes[at + HIGH])
                worst = max(worst, set_impulse(lanes, places, n, impulse, velocities))
            if normals < normals_end:
                worst = max(worst, push_normals(lanes, places, normals, normals_end, velocities))
            for n in range(parts[part, 4], parts[part, 5]):
                at = STRIDE * n
                bound = lanes[at + HIGH] * max(lanes[places[n, NORMAL]], 0.0)
                if bound > 0.0:
                    wish = lanes[at + IMPULSE] + wish_of(lanes, places, n, velocities)
                    impulse = min(max(wish, -bound), bound)
                    worst = max(worst, set_impulse(lanes, places, n, impulse, velocities))
            if rolling < rolling_end:
                worst = max(worst, slide_pairs(lanes, places, rolling, ends[3], rolling_end, velocities))
            if sliding < sliding_end:
                worst = max(worst, slide_pairs(lanes, places, sliding, ends[3], sliding_end, velocities))
            done += 1.0
            if worst <= residual:
                break
        most = max(most, done)
    for n in range(ends[2]):
        goals[n, 3] = lanes[STRIDE * n + IMPULSE]
    for n in range(ends[2], ends[4], 2):
        goals[n, 3], goals[n + 1, 3] = lanes[STRIDE * n + 2 * IMPULSE], lanes[STRIDE * n + 2 * IMPULSE + 1]
    for tree in range(tree_dofs.shape[0]):
        for k in range(tree_dofs[tree]):
            change[tree_dof[tree] + k] = velocities[slots[tree] + k]
    return most


def push_normals(lanes, places, first, last, velocities):
    """Set the impulses of all normals, one after the other; return the largest change.

    What the next two rows wish for is summed before the impulse of this one, which many of them depend
    on, is known, and corrected for it: the processor would wait for it otherwise.
    """
    worst = 0.0
    wish = wish_of(lanes, places, first, velocities)
    following = wish_of(lanes, places, first + 1 if first + 1 < last else first, velocities)
    for n in range(first, last):
        coming = wish_of(lanes, places, n + 2 if n + 2 < last else n, velocities)
        at = STRIDE * n
        old = lanes[at + IMPULSE]
        delta = max(wish - lanes[at + YIELD] * old, -old)
        wish = following + delta * lanes[at + NEXT]
        following = coming + delta * lanes[at + OVER]
        lanes[at + IMPULSE] = old + delta
        push_row(lanes, places, n, delta, velocities)
        delta *= lanes[at + OWN]
        worst = max(worst, delta * delta)
    return worst


def slide_pairs(lanes, places, first, sliding, stop, velocities):
    """Do what `push_normals` does for pairs of friction rows, which share a bound, of the last ones slid."""
    worst = 0.0
    x, y = wishes_of(lanes, places, first, velocities)
    for n in range(first, stop, 2):
        after = n + 2 if n + 2 < stop else n
        next_x, next_y = wishes_of(lanes, places, after, velocities)
        at = STRIDE * n
        bound = lanes[at + 2 * HIGH] * max(lanes[places[n, NORMAL]], 0.0)
        impulse = at + 2 * IMPULSE
        old, other_old = lanes[impulse], lanes[impulse + 1]
        if bound > 0.0 or (n >= sliding and (old != 0.0 or other_old != 0.0)):
            new, other_new = old + x, other_old + y
            square = new * new + other_new * other_new
            if square > bound * bound:
                factor = bound / np.sqrt(square)
                new *= factor
                other_new *= factor
                lanes[at + 2 * CUT + 1] = factor  # without a store LLVM takes the root of all rows
                x, y = new - old, other_new - other_old
            i = at + 2 * NEXT
            next_x += x * lanes[i] + y * lanes[i + 2]
            next_y += x * lanes[i + 1] + y * lanes[i + 3]
            lanes[impulse], lanes[impulse + 1] = new, other_new
            push_pair(lanes, places, n, x, y, velocities)
            both = x * lanes[at + 2 * OWN] + y * lanes[at + 2 * OWN + 1]  # added up, as Bullet does
            worst = max(worst, both * both)
        x, y = next_x, next_y
    return worst
