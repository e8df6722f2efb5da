"""Rows solved in turn, with their entries and the velocities that they change side by side for the processor.

Velocities of each tree begin at a multiple of `BLOCK`, as do the entries of a row for each of its trees, so
that a free body is one vector of eight numbers. All that is known of a row stands in one stretch of memory:
`HEAD` numbers (`GOAL` and those that follow), the row's scaled Jacobian (see `scale`), which
both gives its velocity and says what an impulse changes.
"""

from __future__ import annotations

import numpy as np

from roboyard.sim.stepping.impulses.records import BLOCK

GOAL, INVERSE, KEPT, OWN, LOW, HIGH, IMPULSE, NEXT, OVER, ACROSS, CUT = range(11)
"""Numbers of a row: the impulse that it asks for at rest, impulse for a unit of velocity, share of the last
impulse that remains (less than 1 where the row yields), velocity for a unit of impulse, bounds (or the
coefficient of friction), impulse; what a unit of it changes in rows that follow, see `couple`."""
HEAD = 16
"""Numbers before a row's entries."""
START, FIRST, SECOND, WIDTH, OTHER, NORMAL, PLACES = range(7)
"""Whole numbers of a row: where its numbers begin, where the velocities of both its trees, how many blocks
both have (the second may have none), and where the impulse of its contact's normal is."""


def lay_out(  # pragma: no cover
    rows, spans, goals, ends, scaled, tree_dofs, slots, places, lanes, velocities
):
    """Write the places and numbers of all rows, and no velocity."""
    at = 0
    for tree in range(tree_dofs.shape[0]):
        slots[tree] = at
        at += (tree_dofs[tree] + BLOCK - 1) // BLOCK * BLOCK
    for k in range(at):
        velocities[k] = 0.0
    at = 0
    for n in range(ends[4]):
        size, others, x, y = spans[n, 1], spans[n, 3], 0, spans[n, 1]
        first, second = rows[n, 1], rows[n, 2]
        if size == 0:
            first, second, size, others, x, y = second, first, others, size, y, x
        width, other = (size + BLOCK - 1) // BLOCK, (others + BLOCK - 1) // BLOCK
        places[n, START], places[n, WIDTH], places[n, OTHER] = at, width, other
        places[n, FIRST] = slots[first] if first >= 0 else 0
        places[n, SECOND] = slots[second] if second >= 0 else 0
        whole = BLOCK * (width + other)
        for k in range(HEAD + whole):
            lanes[at + k] = 0.0
        own = goals[n, 4]
        for k in range(size + others):
            own += scaled[n, k] * scaled[n, k]
        inverse = 1.0 / own if own > 1e-15 else 0.0
        lanes[at + GOAL] = goals[n, 0] * inverse
        lanes[at + INVERSE] = inverse
        lanes[at + KEPT] = 1.0 - goals[n, 4] * inverse
        lanes[at + OWN] = own
        lanes[at + LOW], lanes[at + HIGH] = goals[n, 1], goals[n, 2]
        at += HEAD
        for k in range(size):
            lanes[at + k] = scaled[n, x + k]
        for k in range(others):
            lanes[at + BLOCK * width + k] = scaled[n, y + k]
        at += whole
    for n in range(ends[1], ends[4]):
        places[n, NORMAL] = places[rows[n, 3], START] + IMPULSE


def couple(spans, ends, scaled, places, lanes):  # pragma: no cover
    """Write what units of impulse change in rows that follow.

    These are the next two normals for a normal, the next pair for a sliding row.
    """
    first, last = ends[0], ends[1]
    for n in range(first, last):
        at = places[n, START]
        if n + 1 < last:
            lanes[at + NEXT] = coupling(spans, scaled, n, n + 1)
        if n + 2 < last:
            lanes[at + OVER] = coupling(spans, scaled, n, n + 2)
    for n in range(ends[2], ends[4] - 2):
        after = n + 2 - (n - ends[2]) % 2
        lanes[places[n, START] + NEXT] = coupling(spans, scaled, n, after)
        lanes[places[n, START] + ACROSS] = coupling(spans, scaled, n, after + 1)


def coupling(spans, scaled, n, m):
    """Return what a unit of impulse of row n changes in the velocity of row m."""
    total = 0.0
    for i in range(2):
        for j in range(2):
            size = spans[n, 2 * i + 1]
            if size > 0 and size == spans[m, 2 * j + 1] and spans[n, 2 * i] == spans[m, 2 * j]:
                x = spans[n, 1] if i == 1 else 0
                y = spans[m, 1] if j == 1 else 0
                for k in range(size):
                    total += scaled[n, x + k] * scaled[m, y + k]
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
    at, a, b = places[n, START] + HEAD, places[n, FIRST], places[n, SECOND]
    width, other = places[n, WIDTH], places[n, OTHER]
    if width == 1 and other == 1:
        return dot_two_blocks(lanes, at, velocities, a, at + BLOCK, b)
    total = dot_block(lanes, at, velocities, a)
    if width > 1:
        for j in range(1, width):
            total += dot_block(lanes, at + BLOCK * j, velocities, a + BLOCK * j)
    if other > 0:
        at += BLOCK * width
        total += dot_block(lanes, at, velocities, b)
        for j in range(1, other):
            total += dot_block(lanes, at + BLOCK * j, velocities, b + BLOCK * j)
    return total


def push_row(lanes, places, n, impulse, velocities):
    """Change velocities by an impulse of a row."""
    a, b = places[n, FIRST], places[n, SECOND]
    width, other = places[n, WIDTH], places[n, OTHER]
    at = places[n, START] + HEAD
    add_block(velocities, a, impulse, lanes, at)
    if width > 1:
        for j in range(1, width):
            add_block(velocities, a + BLOCK * j, impulse, lanes, at + BLOCK * j)
    if other > 0:
        at += BLOCK * width
        add_block(velocities, b, impulse, lanes, at)
        for j in range(1, other):
            add_block(velocities, b + BLOCK * j, impulse, lanes, at + BLOCK * j)


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
    a, b = places[n, FIRST], places[n, SECOND]
    width, other = places[n, WIDTH], places[n, OTHER]
    at = places[n, START] + HEAD
    further = at + HEAD + BLOCK * (width + other)
    add_blocks(velocities, a, impulse, lanes, at, other_impulse, further)
    if width > 1:
        for j in range(BLOCK, BLOCK * width, BLOCK):
            add_blocks(velocities, a + j, impulse, lanes, at + j, other_impulse, further + j)
    if other > 0:
        at += BLOCK * width
        further += BLOCK * width
        add_blocks(velocities, b, impulse, lanes, at, other_impulse, further)
        for j in range(BLOCK, BLOCK * other, BLOCK):
            add_blocks(velocities, b + j, impulse, lanes, at + j, other_impulse, further + j)


def wish_of(lanes, at, speed):
    """Return the impulse with which a row would get what it asks for."""
    return lanes[at + KEPT] * lanes[at + IMPULSE] + lanes[at + GOAL] - speed * lanes[at + INVERSE]


def set_impulse(lanes, places, n, impulse, velocities):
    """Set the impulse of a row; return the square of the change of its velocity."""
    at = places[n, START]
    delta = impulse - lanes[at + IMPULSE]
    if delta == 0.0:
        return 0.0
    lanes[at + IMPULSE] = impulse
    push_row(lanes, places, n, delta, velocities)
    delta *= lanes[at + OWN]
    return delta * delta


def solve_in_turn(  # pragma: no cover
    rows, spans, goals, ends, parts, scaled, tree_dof, tree_dofs, slots, places, lanes, velocities, rounds,
    residual, change,
):  # fmt: skip
    """Solve row by row, each with the changes of velocity that the others have made, in several rounds.

    Motors and limits are taken backwards and forwards by turns. Rounds of a group end when none of its rows
    changes its velocity by more than the root of the residual, or after `rounds`: motors of joints with
    nearly parallel axes, or at their largest impulse, have not converged by then. The two sliding rows of a
    contact share one bound, the normal's impulse in this round times the coefficient. Returns the largest
    number of rounds.

    rows, ..., scaled: see `Solver`. slots: (ntree,), places: (n, PLACES), lanes: (m,) and velocities: (k,),
    work arrays. change: (nv,) sums of scaled entries by impulses, written.
    """
    lay_out(rows, spans, goals, ends, scaled, tree_dofs, slots, places, lanes, velocities)
    couple(spans, ends, scaled, places, lanes)
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
                at = places[n, START]
                wish = wish_of(lanes, at, speed_of(lanes, places, n, velocities))
                impulse = min(max(wish, lanes[at + LOW]), lanes[at + HIGH])
                worst = max(worst, set_impulse(lanes, places, n, impulse, velocities))
            if normals < normals_end:
                worst = max(worst, push_normals(lanes, places, normals, normals_end, velocities))
            for n in range(parts[part, 4], parts[part, 5]):
                at = places[n, START]
                bound = lanes[at + HIGH] * max(lanes[places[n, NORMAL]], 0.0)
                if bound > 0.0:
                    wish = wish_of(lanes, at, speed_of(lanes, places, n, velocities))
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
    for n in range(ends[4]):
        goals[n, 3] = lanes[places[n, START] + IMPULSE]
    for tree in range(tree_dofs.shape[0]):
        for k in range(tree_dofs[tree]):
            change[tree_dof[tree] + k] = velocities[slots[tree] + k]
    return most


def push_normals(lanes, places, first, last, velocities):
    """Set the impulses of all normals, one after the other; return the largest change.

    The velocities of the next two rows are summed before the impulse of this one, which many of them depend
    on, is known, and corrected for it: the processor would wait for it otherwise.
    """
    worst = 0.0
    speed = speed_of(lanes, places, first, velocities)
    following = speed_of(lanes, places, first + 1 if first + 1 < last else first, velocities)
    for n in range(first, last):
        coming = speed_of(lanes, places, n + 2 if n + 2 < last else n, velocities)
        at = places[n, START]
        impulse = min(max(wish_of(lanes, at, speed), lanes[at + LOW]), lanes[at + HIGH])
        delta = impulse - lanes[at + IMPULSE]
        speed = following + delta * lanes[at + NEXT]
        following = coming + delta * lanes[at + OVER]
        worst = max(worst, set_impulse(lanes, places, n, impulse, velocities))
    return worst


def slide_pairs(lanes, places, first, sliding, stop, velocities):
    """Do what `push_normals` does for pairs of friction rows, which share a bound, of the last ones slid."""
    worst = 0.0
    x = speed_of(lanes, places, first, velocities)
    y = speed_of(lanes, places, first + 1, velocities)
    for n in range(first, stop, 2):
        after = n + 2 if n + 2 < stop else n
        next_x = speed_of(lanes, places, after, velocities)
        next_y = speed_of(lanes, places, after + 1, velocities)
        at, other = places[n, START], places[n + 1, START]
        bound = lanes[at + HIGH] * max(lanes[places[n, NORMAL]], 0.0)
        if bound > 0.0 or n >= sliding:
            x, y = wish_of(lanes, at, x), wish_of(lanes, other, y)
            square = x * x + y * y
            if square > bound * bound:
                factor = bound / np.sqrt(square)
                x *= factor
                y *= factor
                lanes[at + CUT] = factor  # without a store LLVM takes the root of rows that do not slide, too
            delta, other_delta = x - lanes[at + IMPULSE], y - lanes[other + IMPULSE]
            next_x += delta * lanes[at + NEXT] + other_delta * lanes[other + NEXT]
            next_y += delta * lanes[at + ACROSS] + other_delta * lanes[other + ACROSS]
            if delta != 0.0 or other_delta != 0.0:
                lanes[at + IMPULSE], lanes[other + IMPULSE] = x, y
                push_pair(lanes, places, n, delta, other_delta, velocities)
                both = delta * lanes[at + OWN] + other_delta * lanes[other + OWN]  # added up, as Bullet does
                worst = max(worst, both * both)
        x, y = next_x, next_y
    return worst
