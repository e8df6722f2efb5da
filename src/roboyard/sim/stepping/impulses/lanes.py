"""Rows solved in turn, one after the other, each with the changes of velocity that the others have made."""

from __future__ import annotations

from roboyard.sim.stepping.impulses.blocks import add_block, add_blocks, dot_block, dot_four_blocks
from roboyard.sim.stepping.impulses.coupling import couple
from roboyard.sim.stepping.impulses.layout import (
    COUPLED,
    FIRST,
    FOURTH,
    FURTHER,
    HEAD,
    HIGH,
    IMPULSE,
    INVERSE,
    LOW,
    NEXT,
    NORMAL,
    OTHER,
    OVER,
    OWN,
    RUN,
    SECOND,
    STRIDE,
    THIRD,
    WIDTH,
    YIELD,
    lay_out,
    leave_uncounted,
)
from roboyard.sim.stepping.impulses.quads import push_quad, slide, slide_quad, wish_along, wish_pair_along
from roboyard.sim.stepping.impulses.records import BLOCK


def solve_in_turn(  # pragma: no cover
    rows, spans, goals, ends, parts, jacobian, scaled, roots, diagonal, tree_dof, tree_dofs, slots, places,
    lanes, velocities, rounds, residual, is_pyramid, change,
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
    unmoved = lay_out(
        rows, spans, goals, ends, jacobian, scaled, roots, diagonal, tree_dofs, slots, places, lanes,
        velocities,
    )  # fmt: skip
    couple(parts, places, lanes)
    most = 0.0
    for part in range(parts[parts.shape[0] - 1, 0]):
        done = 0.0
        least = residual
        if unmoved >= ends[0]:
            least = leave_uncounted(parts, part, goals, ends, lanes, residual)
        joints, joints_end = parts[part, 0], parts[part, 1]
        normals, normals_end = parts[part, 2], parts[part, 3]
        while done < rounds:
            worst = 0.0
            for i in range(joints_end - joints):
                n = joints + i if done % 2.0 == 1.0 else joints_end - 1 - i
                at = STRIDE * n
                old = lanes[at + IMPULSE]
                wish = old + wish_of(lanes, places, n, velocities) - lanes[at + YIELD] * old
                impulse = min(max(wish, lanes[at + LOW]), lanes[at + HIGH])
                worst = max(worst, set_impulse(lanes, places, n, impulse, velocities))
            worst = max(worst, push_normals(lanes, places, normals, normals_end, velocities))
            for n in range(parts[part, 4], parts[part, 4] if is_pyramid else parts[part, 5]):
                at = STRIDE * n
                bound = lanes[at + HIGH] * max(lanes[places[n, NORMAL]], 0.0)
                if bound > 0.0:
                    wish = lanes[at + IMPULSE] + wish_of(lanes, places, n, velocities)
                    impulse = min(max(wish, -bound), bound)
                    worst = max(worst, set_impulse(lanes, places, n, impulse, velocities))
            for kind in range(6, 10, 2):
                first, end = parts[part, kind], parts[part, kind + 1]
                if is_pyramid:
                    for n in range(first, end, 2):
                        worst = max(worst, slide_singly(lanes, places, n, velocities))
                elif first < end:
                    worst = max(worst, slide_pairs(lanes, places, first, end, kind == 8, velocities))
            done += 1.0
            if worst <= least:
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
    """Set the impulses of all normals, run by run; return the square of the largest change of velocity."""
    worst, n = 0.0, first
    while n < last:
        end = places[n, RUN]
        if end < 0:
            end = -end
            for m in range(n, end, 4):
                worst = max(worst, push_quad(lanes, places, m, velocities))
        else:
            worst = max(worst, push_run(lanes, places, n, end, velocities))
        n = end
    return worst


def slide_pairs(lanes, places, first, last, slides, velocities):
    """Do what `push_normals` does for pairs of friction rows; see `slide`."""
    worst, n = 0.0, first
    while n < last:
        end = places[n, RUN]
        if end < 0:
            end = -end
            for m in range(n, end, 8):
                worst = max(worst, slide_quad(lanes, places, m, slides, velocities))
        else:
            worst = max(worst, slide_run(lanes, places, n, end, slides, velocities))
        n = end
    return worst


def slide_singly(lanes, places, n, velocities):
    """Set the impulses of a pair of friction rows one after the other, each within the bound of its own.

    Without a normal impulse they remain. Returns the square of the largest change of their velocities.
    """
    at, normal, worst = STRIDE * n, max(lanes[places[n, NORMAL]], 0.0), 0.0
    for k in range(2):
        bound = lanes[at + 2 * HIGH + k] * normal
        if bound <= 0.0:
            continue
        asked, place = wish_pair_of(lanes, places, n, velocities), at + 2 * IMPULSE + k
        old = lanes[place]
        lanes[place] = min(max(old + asked[k], -bound), bound)
        delta = lanes[place] - old
        push_pair(lanes, places, n, delta if k == 0 else 0.0, delta if k == 1 else 0.0, velocities)
        delta *= lanes[at + 2 * OWN + k]
        worst = max(worst, delta * delta)
    return worst


def push_run(lanes, places, first, last, velocities):
    """Set the impulses of normals, one after the other; return the square of the largest change.

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


def slide_run(lanes, places, first, last, slides, velocities):
    """Do what `push_run` does for pairs of friction rows."""
    worst = 0.0
    x, y = wish_pair_of(lanes, places, first, velocities)
    for n in range(first, last, 2):
        next_x, next_y = wish_pair_of(lanes, places, n + 2 if n + 2 < last else n, velocities)
        at = STRIDE * n
        x, y = slide(lanes, at, places[n, NORMAL], x, y, slides)
        if x != 0.0 or y != 0.0:
            i = at + COUPLED
            next_x += x * lanes[i] + y * lanes[i + 2]
            next_y += x * lanes[i + 1] + y * lanes[i + 3]
            push_pair(lanes, places, n, x, y, velocities)
            both = x * lanes[at + 2 * OWN] + y * lanes[at + 2 * OWN + 1]  # added up, as Bullet does
            worst = max(worst, both * both)
        x, y = next_x, next_y
    return worst


def wish_of(lanes, places, n, velocities):
    """Return the change of impulse with which a row, unless it yields, would get what it asks for."""
    at, a, b = STRIDE * n, places[n, FIRST], places[n, SECOND]
    wish = wish_along(lanes, at, a, b, velocities)
    further = places[n, FURTHER]
    if further > 0:
        wish -= lanes[at + INVERSE] * speed_further(lanes, places, n, further, velocities)
    return wish


def wish_pair_of(lanes, places, n, velocities):
    """Do what `wish_of` does for both rows of a pair."""
    at = STRIDE * n
    x, y = wish_pair_along(lanes, at, places[n, FIRST], places[n, SECOND], velocities)
    if places[n, FURTHER] > 0:
        x -= lanes[at + 2 * INVERSE] * speed_further(lanes, places, n, places[n, FURTHER], velocities)
        y -= lanes[at + 2 * INVERSE + 1] * speed_further(lanes, places, n, places[n + 1, FURTHER], velocities)
    return x, y


def speed_further(lanes, places, n, at, velocities):
    """Return the part of a row's velocity that is of further blocks, of which the row's begin at `at`."""
    width, other = BLOCK * places[n, WIDTH], BLOCK * places[n, OTHER]
    speed = dot_blocks(lanes, at, velocities, places[n, THIRD], width)
    return speed + dot_blocks(lanes, at + width, velocities, places[n, FOURTH], other)


def dot_blocks(x, i, y, j, size):
    """Return the product of blocks, of so many numbers."""
    total = 0.0
    end = i + size
    while i + 3 * BLOCK < end:
        total += dot_four_blocks(x, i, y, j)
        i += 4 * BLOCK
        j += 4 * BLOCK
    while i < end:
        total += dot_block(x, i, y, j)
        i += BLOCK
        j += BLOCK
    return total


def push_row(lanes, places, n, impulse, velocities):
    """Change velocities by an impulse of a row."""
    at, further = STRIDE * n + HEAD, places[n, FURTHER]
    add_block(velocities, places[n, FIRST], impulse, lanes, at)
    add_block(velocities, places[n, SECOND], impulse, lanes, at + BLOCK)
    if further > 0:
        width, other = BLOCK * places[n, WIDTH], BLOCK * places[n, OTHER]
        for j in range(0, width, BLOCK):
            add_block(velocities, places[n, THIRD] + j, impulse, lanes, further + j)
        for j in range(0, other, BLOCK):
            add_block(velocities, places[n, FOURTH] + j, impulse, lanes, further + width + j)


def push_pair(lanes, places, n, impulse, other_impulse, velocities):
    """Change velocities by impulses of row n and the next one, of the same trees."""
    at, i, k = STRIDE * n + 2 * HEAD, places[n, FURTHER], places[n + 1, FURTHER]
    add_blocks(velocities, places[n, FIRST], impulse, lanes, at, other_impulse, at + 2 * BLOCK)
    add_blocks(velocities, places[n, SECOND], impulse, lanes, at + BLOCK, other_impulse, at + 3 * BLOCK)
    if i > 0:
        width, other = BLOCK * places[n, WIDTH], BLOCK * places[n, OTHER]
        for j in range(0, width, BLOCK):
            add_blocks(velocities, places[n, THIRD] + j, impulse, lanes, i + j, other_impulse, k + j)
        i, k = i + width, k + width
        for j in range(0, other, BLOCK):
            add_blocks(velocities, places[n, FOURTH] + j, impulse, lanes, i + j, other_impulse, k + j)


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
