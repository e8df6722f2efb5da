"""RRT-Connect (Kuffner and LaValle, 2000) between several starts and goals, in one kernel."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from roboyard.kinematics._lm import next_random
from roboyard.native import record
from roboyard.planning.kernels.arrays import ROBOT, WORK, WORLD, Array, Indices, kernel
from roboyard.planning.kernels.checker import is_free
from roboyard.planning.kernels.motion import SWEEP, motion_free

LOCAL = 0.08
"""Share of samples near starts and goals: tight goals need small steps around them."""


class Trees(NamedTuple):
    """The tree of the starts and that of the goals."""

    q: Array
    """(2, c, n) configurations."""
    parent: Indices
    """(2, c) parents, -1 for roots."""
    counts: Indices
    """(2,) numbers of nodes."""
    random: np.ndarray
    """(1,) uint64 state of the random numbers."""
    sample: Array
    """(2, n) sample and new configuration."""


TREES = record(Trees, "f8[:,:,::1] i8[:,::1] i8[::1] u8[::1] f8[:,::1]")


def trees_for(joints: int, nodes: int, seed: int) -> Trees:
    """Return empty trees with room for `nodes` configurations each."""
    state = np.array([np.uint64((seed * 0x9E3779B97F4A7C15 + 0x632BE59BD9B4E019) % 2**64 | 1)])
    return Trees(
        q=np.zeros((2, nodes, joints)),
        parent=np.zeros((2, nodes), dtype=np.int64),
        counts=np.zeros(2, dtype=np.int64),
        random=state.astype(np.uint64),
        sample=np.zeros((2, joints)),
    )


def nearest_node(q, count, to):
    """Index of the row of q nearest to `to` (n,), and the distance."""
    best, least = 0, 1e300
    for i in range(count):
        total = 0.0
        for j in range(to.shape[0]):
            total += (q[i, j] - to[j]) ** 2
        if total < least:
            best, least = i, total
    return best, math.sqrt(least)


def add_node(trees, side, q, parent):
    """Add a configuration to a tree; return its index."""
    i = trees.counts[side]
    trees.counts[side] = i + 1
    trees.parent[side, i] = parent
    for j in range(q.shape[0]):
        trees.q[side, i, j] = q[j]
    return i


def draw_sample(robot, trees, roots, spread):
    """Write a random configuration to trees.sample[0]: uniform, or near a root."""
    local = next_random(trees.random) < LOCAL
    side = 1 if next_random(trees.random) < 0.7 else 0
    root = int(next_random(trees.random) * roots[side])
    width = spread * next_random(trees.random) ** 2
    for j in range(robot.lower.shape[0]):
        u = next_random(trees.random)
        low, high = robot.lower[j], robot.upper[j]
        if local:
            value = trees.q[side, root, j] + (2.0 * u - 1.0) * width * (high - low)
            trees.sample[0, j] = min(max(value, low), high)
        else:
            trees.sample[0, j] = low + u * (high - low)


def extend(robot, world, trees, side, to, step, margin, work, sweep):
    """Grow a tree from its nearest node towards `to`; return the new node and whether it is there.

    A blocked motion is tried again at a quarter of its length, so that trees grow out of tight places.
    """
    i, distance = nearest_node(trees.q[side], trees.counts[side], to)
    if distance < 1e-12:
        return i, True
    share = min(1.0, step / distance)
    new = trees.sample[1]
    for _ in range(2):
        for j in range(to.shape[0]):
            new[j] = trees.q[side, i, j] + share * (to[j] - trees.q[side, i, j])
        if is_free(robot, world, new, margin, work) and motion_free(
            robot, world, trees.q[side, i], new, margin, work, sweep
        ):
            return add_node(trees, side, new, i), share == 1.0
        share *= 0.25
    return -1, False


def connect(robot, world, trees, side, to, step, margin, work, sweep):
    """Grow a tree towards `to` until it is there or blocked; return the node that reached it, or -1."""
    i, distance = nearest_node(trees.q[side], trees.counts[side], to)
    new = trees.sample[1]
    while trees.counts[side] < trees.q.shape[1]:
        if distance < 1e-12:
            return i
        share = min(1.0, step / distance)
        for j in range(to.shape[0]):
            new[j] = trees.q[side, i, j] + share * (to[j] - trees.q[side, i, j])
        if share < 1.0 and not is_free(robot, world, new, margin, work):
            return -1
        if not motion_free(robot, world, trees.q[side, i], new, margin, work, sweep):
            return -1
        i = add_node(trees, side, new, i)
        if share == 1.0:
            return i
        distance -= step
    return -1


def trace(trees, ends, path):
    """Write the path through nodes ends (2,) to path (k, n); return its length, 0 if too long."""
    count = 0
    i = ends[0]
    while i >= 0:
        count += 1
        i = trees.parent[0, i]
    i, row = ends[0], count
    other = trees.parent[1, ends[1]]
    k = other
    total = count
    while k >= 0:
        total += 1
        k = trees.parent[1, k]
    if total > path.shape[0]:
        return 0
    while i >= 0:
        row -= 1
        for j in range(path.shape[1]):
            path[row, j] = trees.q[0, i, j]
        i = trees.parent[0, i]
    while other >= 0:
        for j in range(path.shape[1]):
            path[count, j] = trees.q[1, other, j]
        count += 1
        other = trees.parent[1, other]
    return count


@kernel(ROBOT, WORLD, TREES, "i8[::1] i8[::1] i8 f8 f8", WORK, SWEEP, "f8[:,::1] -> i8")
def search(robot, world, trees, roots, ends, steps, step, margin, work, sweep, path):
    """Grow both trees for up to `steps` samples; return the number of way points of a path, or 0.

    Args:
        robot: the robot.
        world: obstacles.
        trees: with the starts and goals added as roots.
        roots: (2,) numbers of starts and goals.
        ends: (2,) work space.
        steps: samples in this call; calling again goes on.
        step: longest motion of one extension (rad).
        margin: additional padding (m).
        work: work space.
        sweep: work space.
        path: (k, n) out.
    """
    if trees.counts[0] == roots[0] and trees.counts[1] == roots[1]:
        for a in range(roots[0]):
            for b in range(roots[1]):
                if motion_free(robot, world, trees.q[0, a], trees.q[1, b], margin, work, sweep):
                    ends[0] = a
                    ends[1] = add_node(trees, 1, trees.q[0, a], b)
                    return trace(trees, ends, path)
    for _ in range(steps):
        side = 0 if trees.counts[0] <= trees.counts[1] else 1
        if trees.counts[side] + 1 >= trees.q.shape[1]:
            return 0
        draw_sample(robot, trees, roots, 0.3)
        new, _ = extend(robot, world, trees, side, trees.sample[0], step, margin, work, sweep)
        if new < 0:
            continue
        other = connect(robot, world, trees, 1 - side, trees.q[side, new], step, margin, work, sweep)
        if other >= 0:
            ends[side], ends[1 - side] = new, other
            if side == 1:  # the start's tree reached the goal's node: both nodes are equal
                ends[0], ends[1] = other, new
            return trace(trees, ends, path)
    return 0
