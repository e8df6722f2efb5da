"""Whether a straight motion between two configurations is free, without a fixed step.

A link that is farther from everything than its points can move until the ends of an interval is settled for
the whole interval; only the others are checked again on its halves. The search ends where motions are below
`FINE`, by which all spheres are padded, so that nothing slips through between steps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from roboyard.native import record
from roboyard.planning.kernels.arrays import ROBOT, WORK, WORLD, Array, Indices, RobotArrays, kernel
from roboyard.planning.kernels.checker import place, place_spheres
from roboyard.planning.kernels.distances import box_squares, obstacle_distance

FINE = 0.001
"""Motion of a point between checks that padding covers (m)."""
BLOCKED, NEAR, CLEAR = 0, 1, 2


class Sweep(NamedTuple):
    """Space for motion checks; one for each thread."""

    bound: Array
    """(l + p,) most that points of a link or pair move over the whole motion (m)."""
    middle: Array
    """(i,) middles of the intervals still to be checked, as shares of the motion."""
    half: Array
    """(i,) half their lengths."""
    listed: Indices
    """(i, 2) first entry and number of entries in `pool`."""
    pool: Indices
    """(k,) links, or l + pairs, not settled on an interval."""
    q: Array
    """(n,) configuration."""


SWEEP = record(Sweep, "f8[::1] f8[::1] f8[::1] i8[:,::1] i8[::1] f8[::1]")


def sweep_for(robot: RobotArrays, intervals: int = 4096) -> Sweep:
    """Return space for motion checks of up to `intervals` intervals; longer searches count as blocked."""
    items = len(robot.node) + len(robot.pairs)
    return Sweep(
        bound=np.zeros(items),
        middle=np.zeros(intervals),
        half=np.zeros(intervals),
        listed=np.zeros((intervals, 2), dtype=np.int64),
        pool=np.zeros(items + 16 * intervals, dtype=np.int64),
        q=np.zeros(len(robot.lower)),
    )


def link_state(robot, world, l, need, margin, work):
    """BLOCKED, NEAR (closer than `need`) or CLEAR for link l against all obstacles."""
    x, y, z = work.centers[l, 0], work.centers[l, 1], work.centers[l, 2]
    pad = robot.pad[l] + margin
    radius = robot.around[l, 3] + pad
    state = CLEAR
    near = 0
    boxes = world.boxes
    if boxes.shape[1] > 0:
        box_squares(boxes, x, y, z, work.square)
        limit = (radius + need) ** 2
        for b in range(boxes.shape[1]):
            if work.square[b] < limit:
                work.near[near] = b
                near += 1
    if near > 0:
        place_spheres(robot, l, work)
    for k in range(near):
        b = work.near[k]
        if state == NEAR and work.square[b] >= radius * radius:
            continue
        for s in range(robot.start[l], robot.start[l + 1]):
            dx = work.placed[s, 0] - boxes[0, b]
            dy = work.placed[s, 1] - boxes[1, b]
            dz = work.placed[s, 2] - boxes[2, b]
            u = abs(boxes[3, b] * dx + boxes[6, b] * dy + boxes[9, b] * dz) - boxes[12, b]
            v = abs(boxes[4, b] * dx + boxes[7, b] * dy + boxes[10, b] * dz) - boxes[13, b]
            w = abs(boxes[5, b] * dx + boxes[8, b] * dy + boxes[11, b] * dz) - boxes[14, b]
            u, v, w = max(u, 0.0), max(v, 0.0), max(w, 0.0)
            square = u * u + v * v + w * w
            own = max(robot.spheres[s, 3] + pad, 1e-9)
            if square < own * own:
                return BLOCKED
            if square < (own + need) ** 2:
                state = NEAR
    for o in range(world.kind.shape[0]):
        dx, dy, dz = x - world.around[o, 0], y - world.around[o, 1], z - world.around[o, 2]
        ask = need if state == CLEAR else 0.0
        far = radius + ask + world.around[o, 3]
        if dx * dx + dy * dy + dz * dz >= far * far:
            continue
        if obstacle_distance(world, o, x, y, z)[0] - radius >= ask:
            continue
        place_spheres(robot, l, work)
        for s in range(robot.start[l], robot.start[l + 1]):
            d = obstacle_distance(world, o, work.placed[s, 0], work.placed[s, 1], work.placed[s, 2])[0]
            gap = d - robot.spheres[s, 3] - pad
            if gap < 0.0:
                return BLOCKED
            if gap < need:
                state = NEAR
    return state


def pair_state(robot, p, need, margin, work):
    """BLOCKED, NEAR (closer than `need`) or CLEAR for a pair of links."""
    a, b = robot.pairs[p, 0], robot.pairs[p, 1]
    pad = robot.pair_pad[p] + margin
    dx = work.centers[a, 0] - work.centers[b, 0]
    dy = work.centers[a, 1] - work.centers[b, 1]
    dz = work.centers[a, 2] - work.centers[b, 2]
    far = robot.around[a, 3] + robot.around[b, 3] + pad + need
    if dx * dx + dy * dy + dz * dz >= far * far:
        return CLEAR
    place_spheres(robot, a, work)
    place_spheres(robot, b, work)
    x, y, z = work.centers[b, 0], work.centers[b, 1], work.centers[b, 2]
    state = CLEAR
    for s in range(robot.start[a], robot.start[a + 1]):
        sx, sy, sz = work.placed[s, 0], work.placed[s, 1], work.placed[s, 2]
        own = robot.spheres[s, 3] + pad
        far = own + robot.around[b, 3] + (need if state == CLEAR else 0.0)
        if (sx - x) ** 2 + (sy - y) ** 2 + (sz - z) ** 2 >= far * far:
            continue
        for t in range(robot.start[b], robot.start[b + 1]):
            dx, dy, dz = sx - work.placed[t, 0], sy - work.placed[t, 1], sz - work.placed[t, 2]
            touch = max(own + robot.spheres[t, 3], 0.0)
            square = dx * dx + dy * dy + dz * dz
            if square < touch * touch:
                return BLOCKED
            if square < (touch + need) ** 2:
                state = NEAR
    return state


@kernel(ROBOT, WORLD, "f8[::1] f8[::1] f8", WORK, SWEEP, "-> i8")
def motion_free(robot, world, a, b, margin, work, sweep):
    """Whether the straight motion from a (n,) to b (n,) is free; the ends themselves are not checked."""
    links = robot.node.shape[0]
    n = a.shape[0]
    top = 0
    for l in range(links):
        if robot.node[l] < 0:
            continue
        total = 0.0
        for j in range(n):
            total += robot.reach[l, j] * abs(b[j] - a[j])
        sweep.bound[l] = total
        if total > 0.0:
            sweep.pool[top] = l
            top += 1
    for p in range(robot.pairs.shape[0]):
        total = 0.0
        for j in range(n):
            total += robot.pair_reach[p, j] * abs(b[j] - a[j])
        sweep.bound[links + p] = total
        if total > 0.0:
            sweep.pool[top] = links + p
            top += 1
    head, tail = 0, 1
    sweep.middle[0], sweep.half[0] = 0.5, 0.5
    sweep.listed[0, 0], sweep.listed[0, 1] = 0, top
    while head < tail:
        t, half = sweep.middle[head], sweep.half[head]
        first, count = sweep.listed[head, 0], sweep.listed[head, 1]
        head += 1
        if top + count > sweep.pool.shape[0]:
            return False
        for j in range(n):
            sweep.q[j] = a[j] + t * (b[j] - a[j])
        place(robot, sweep.q, work)
        left = top
        for k in range(first, first + count):
            item = sweep.pool[k]
            need = max(sweep.bound[item] * half - FINE, 0.0)
            if item < links:
                state = link_state(robot, world, item, need, margin + FINE, work)
            else:
                state = pair_state(robot, item - links, need, margin + FINE, work)
            if state == BLOCKED:
                return False
            if state == NEAR:
                sweep.pool[top] = item
                top += 1
        if top > left:
            if tail + 2 > sweep.middle.shape[0]:
                return False
            for side in range(2):
                sweep.middle[tail] = t + (side - 0.5) * half
                sweep.half[tail] = 0.5 * half
                sweep.listed[tail, 0], sweep.listed[tail, 1] = left, top - left
                tail += 1
    return True
