"""Four contacts between the same two bodies, solved in turn at once.

What all of them wish for is summed before any impulse is known, and corrected for those that come before:
the velocities of both bodies are read and written once.
"""

from __future__ import annotations

import numpy as np

from roboyard.sim.stepping.impulses.blocks import add_eight_blocks, add_four_blocks, dot_two_blocks
from roboyard.sim.stepping.impulses.layout import (
    BEYOND,
    COUPLED,
    CUT,
    FIRST,
    GOAL,
    HEAD,
    HIGH,
    IMPULSE,
    INVERSE,
    NEXT,
    NORMAL,
    OVER,
    OWN,
    SECOND,
    STRIDE,
    YIELD,
)
from roboyard.sim.stepping.impulses.records import BLOCK


def push_quad(lanes, places, n, velocities):
    """Set the impulses of four normals; return the square of the largest change of their velocities."""
    a, b, i = places[n, FIRST], places[n, SECOND], STRIDE * n
    j, k, m = i + STRIDE, i + 2 * STRIDE, i + 3 * STRIDE
    x, y, z, w = lanes[i + IMPULSE], lanes[j + IMPULSE], lanes[k + IMPULSE], lanes[m + IMPULSE]
    d = wish_along(lanes, i, a, b, velocities) - lanes[i + YIELD] * x
    e = wish_along(lanes, j, a, b, velocities) - lanes[j + YIELD] * y
    f = wish_along(lanes, k, a, b, velocities) - lanes[k + YIELD] * z
    g = wish_along(lanes, m, a, b, velocities) - lanes[m + YIELD] * w
    d = max(d, -x)
    e = max(e + d * lanes[i + NEXT], -y)
    f = max((f + d * lanes[i + OVER]) + e * lanes[j + NEXT], -z)
    g = max(((g + d * lanes[i + BEYOND]) + e * lanes[j + OVER]) + f * lanes[k + NEXT], -w)
    lanes[i + IMPULSE], lanes[j + IMPULSE], lanes[k + IMPULSE], lanes[m + IMPULSE] = (
        x + d,
        y + e,
        z + f,
        w + g,
    )
    add_four_blocks(velocities, a, lanes, i + HEAD, STRIDE, d, e, f, g)
    add_four_blocks(velocities, b, lanes, i + HEAD + BLOCK, STRIDE, d, e, f, g)
    d *= lanes[i + OWN]
    e *= lanes[j + OWN]
    f *= lanes[k + OWN]
    g *= lanes[m + OWN]
    return max(max(d * d, e * e), max(f * f, g * g))


def wish_along(lanes, at, a, b, velocities):
    """Return the change of impulse with which a row of two blocks would get what it asks for."""
    speed = dot_two_blocks(lanes, at + HEAD, velocities, a, at + HEAD + BLOCK, b)
    return lanes[at + GOAL] - lanes[at + INVERSE] * speed


def slide_quad(lanes, places, n, slides, velocities):
    """Do what `push_quad` does for four pairs of friction rows; see `slide`."""
    a, b, i = places[n, FIRST], places[n, SECOND], STRIDE * n
    j, k, m = i + 2 * STRIDE, i + 4 * STRIDE, i + 6 * STRIDE
    x, y = wish_pair_along(lanes, i, a, b, velocities)
    z, w = wish_pair_along(lanes, j, a, b, velocities)
    p, q = wish_pair_along(lanes, k, a, b, velocities)
    r, s = wish_pair_along(lanes, m, a, b, velocities)
    x, y = slide(lanes, i, places[n, NORMAL], x, y, slides)
    z += x * lanes[i + COUPLED] + y * lanes[i + COUPLED + 2]
    w += x * lanes[i + COUPLED + 1] + y * lanes[i + COUPLED + 3]
    p += x * lanes[m + COUPLED] + y * lanes[m + COUPLED + 2]
    q += x * lanes[m + COUPLED + 1] + y * lanes[m + COUPLED + 3]
    r += x * lanes[i + COUPLED + 4] + y * lanes[j + COUPLED + 4]
    s += x * lanes[i + COUPLED + 5] + y * lanes[j + COUPLED + 5]
    z, w = slide(lanes, j, places[n + 2, NORMAL], z, w, slides)
    p += z * lanes[j + COUPLED] + w * lanes[j + COUPLED + 2]
    q += z * lanes[j + COUPLED + 1] + w * lanes[j + COUPLED + 3]
    r += z * lanes[k + COUPLED + 4] + w * lanes[m + COUPLED + 4]
    s += z * lanes[k + COUPLED + 5] + w * lanes[m + COUPLED + 5]
    p, q = slide(lanes, k, places[n + 4, NORMAL], p, q, slides)
    r += p * lanes[k + COUPLED] + q * lanes[k + COUPLED + 2]
    s += p * lanes[k + COUPLED + 1] + q * lanes[k + COUPLED + 3]
    r, s = slide(lanes, m, places[n + 6, NORMAL], r, s, slides)
    add_eight_blocks(velocities, a, lanes, i + 2 * HEAD, 2 * STRIDE, x, y, z, w, p, q, r, s)
    add_eight_blocks(velocities, b, lanes, i + 2 * HEAD + BLOCK, 2 * STRIDE, x, y, z, w, p, q, r, s)
    first = x * lanes[i + 2 * OWN] + y * lanes[i + 2 * OWN + 1]  # added up, as Bullet does
    second = z * lanes[j + 2 * OWN] + w * lanes[j + 2 * OWN + 1]
    third = p * lanes[k + 2 * OWN] + q * lanes[k + 2 * OWN + 1]
    last = r * lanes[m + 2 * OWN] + s * lanes[m + 2 * OWN + 1]
    return max(max(first * first, second * second), max(third * third, last * last))


def wish_pair_along(lanes, at, a, b, velocities):
    """Do what `wish_along` does for both rows of a pair."""
    i, k = at + 2 * HEAD, at + 2 * HEAD + 2 * BLOCK
    x = dot_two_blocks(lanes, i, velocities, a, i + BLOCK, b)
    y = dot_two_blocks(lanes, k, velocities, a, k + BLOCK, b)
    goal, inverse = at + 2 * GOAL, at + 2 * INVERSE
    return lanes[goal] - lanes[inverse] * x, lanes[goal + 1] - lanes[inverse + 1] * y


def slide(lanes, at, normal, x, y, slides):
    """Set the impulses of a pair, whose bound they share; return their changes.

    x, y: the changes that it wishes for. slides: whether it has none without a normal impulse, else they
    remain.
    """
    bound = lanes[at + 2 * HIGH] * max(lanes[normal], 0.0)
    impulse = at + 2 * IMPULSE
    old, other_old = lanes[impulse], lanes[impulse + 1]
    if bound > 0.0 or (slides and (old != 0.0 or other_old != 0.0)):
        new, other_new = old + x, other_old + y
        square = new * new + other_new * other_new
        if square > bound * bound:
            factor = bound / np.sqrt(square)
            new *= factor
            other_new *= factor
            lanes[at + 2 * CUT + 1] = factor  # without a store LLVM takes the root of all rows
            x, y = new - old, other_new - other_old
        lanes[impulse], lanes[impulse + 1] = new, other_new
        return x, y
    return 0.0, 0.0
