"""Clearance of a robot's spheres from obstacles and from each other, for one configuration and for many.

A gap is exact below the reach that the caller asks for and at least that reach otherwise, so that most links
are settled by one sphere around them.
"""

from __future__ import annotations

import math

from roboyard.kinematics._kernels import place_nodes
from roboyard.planning.kernels.arrays import ROBOT, WORK, WORLD, kernel
from roboyard.planning.kernels.distances import box_distance, box_squares, obstacle_distance


def place(robot, q, work):
    """Place nodes and the spheres around links for q (n,)."""
    place_nodes(robot.whole, robot.real, q, work.frames)
    frames = work.frames
    for l in range(robot.node.shape[0]):
        i = robot.node[l]
        x, y, z = robot.around[l, 0], robot.around[l, 1], robot.around[l, 2]
        if i >= 0:
            for r in range(3):
                work.centers[l, r] = (
                    frames[i, r]
                    + frames[i, 3 + 3 * r] * x
                    + frames[i, 4 + 3 * r] * y
                    + frames[i, 5 + 3 * r] * z
                )
        else:
            work.centers[l, 0], work.centers[l, 1], work.centers[l, 2] = x, y, z
        work.fresh[l] = 0


def place_spheres(robot, l, work):
    """Place the spheres of link l, once for each `place`."""
    if work.fresh[l] == 1:
        return
    work.fresh[l] = 1
    i, frames = robot.node[l], work.frames
    if i < 0:
        for s in range(robot.start[l], robot.start[l + 1]):
            for r in range(3):
                work.placed[s, r] = robot.spheres[s, r]
        return
    # Read the frame once: a compiler cannot know that writing `placed` leaves it as it is.
    px, py, pz = frames[i, 0], frames[i, 1], frames[i, 2]
    xx, xy, xz = frames[i, 3], frames[i, 4], frames[i, 5]
    yx, yy, yz = frames[i, 6], frames[i, 7], frames[i, 8]
    zx, zy, zz = frames[i, 9], frames[i, 10], frames[i, 11]
    for s in range(robot.start[l], robot.start[l + 1]):
        x, y, z = robot.spheres[s, 0], robot.spheres[s, 1], robot.spheres[s, 2]
        work.placed[s, 0] = px + xx * x + xy * y + xz * z
        work.placed[s, 1] = py + yx * x + yy * y + yz * z
        work.placed[s, 2] = pz + zx * x + zy * y + zz * z


def link_gap(robot, world, l, reach, margin, work):
    """Smallest distance of link l's padded spheres to obstacles, exact below `reach`; stops below 0."""
    x, y, z = work.centers[l, 0], work.centers[l, 1], work.centers[l, 2]
    pad = robot.pad[l] + margin
    radius = robot.around[l, 3] + pad
    least = reach
    boxes = world.boxes.shape[1]
    near = 0
    if boxes > 0:
        box_squares(world.boxes, x, y, z, work.square)
        limit = (radius + reach) ** 2
        for b in range(boxes):
            if work.square[b] < limit:
                work.near[near] = b
                near += 1
    if near > 0:
        place_spheres(robot, l, work)
        for k in range(near):
            b = work.near[k]
            for s in range(robot.start[l], robot.start[l + 1]):
                d = box_distance(world.boxes, b, work.placed[s, 0], work.placed[s, 1], work.placed[s, 2])[0]
                least = min(least, d - robot.spheres[s, 3] - pad)
            if least < 0.0:
                return least
    for o in range(world.kind.shape[0]):
        dx, dy, dz = x - world.around[o, 0], y - world.around[o, 1], z - world.around[o, 2]
        far = radius + least + world.around[o, 3]
        if dx * dx + dy * dy + dz * dz >= far * far:
            continue
        if obstacle_distance(world, o, x, y, z)[0] - radius >= least:
            continue
        place_spheres(robot, l, work)
        for s in range(robot.start[l], robot.start[l + 1]):
            d = obstacle_distance(world, o, work.placed[s, 0], work.placed[s, 1], work.placed[s, 2])[0]
            least = min(least, d - robot.spheres[s, 3] - pad)
        if least < 0.0:
            return least
    return least


def pair_gap(robot, p, reach, margin, work):
    """Smallest distance between the padded spheres of pair p, exact below `reach`; stops below 0."""
    a, b = robot.pairs[p, 0], robot.pairs[p, 1]
    pad = robot.pair_pad[p] + margin
    dx = work.centers[a, 0] - work.centers[b, 0]
    dy = work.centers[a, 1] - work.centers[b, 1]
    dz = work.centers[a, 2] - work.centers[b, 2]
    far = robot.around[a, 3] + robot.around[b, 3] + pad + reach
    if dx * dx + dy * dy + dz * dz >= far * far:
        return reach
    place_spheres(robot, a, work)
    x, y, z = work.centers[b, 0], work.centers[b, 1], work.centers[b, 2]
    least = reach
    for s in range(robot.start[a], robot.start[a + 1]):
        sx, sy, sz = work.placed[s, 0], work.placed[s, 1], work.placed[s, 2]
        own = robot.spheres[s, 3] + pad
        far = own + robot.around[b, 3] + least
        if (sx - x) ** 2 + (sy - y) ** 2 + (sz - z) ** 2 >= far * far:
            continue
        place_spheres(robot, b, work)
        for t in range(robot.start[b], robot.start[b + 1]):
            dx, dy, dz = sx - work.placed[t, 0], sy - work.placed[t, 1], sz - work.placed[t, 2]
            far = own + robot.spheres[t, 3] + least
            square = dx * dx + dy * dy + dz * dz
            if square < far * far:
                least = math.sqrt(square) - own - robot.spheres[t, 3]
                if least < 0.0:
                    return least
    return least


@kernel(ROBOT, WORLD, "f8[::1] f8", WORK, "-> i8")
def is_free(robot, world, q, margin, work):
    """Whether no padded sphere of a moving link touches anything at q (n,)."""
    place(robot, q, work)
    for p in range(robot.pairs.shape[0]):
        if pair_gap(robot, p, 0.0, margin, work) < 0.0:
            return False
    for l in range(robot.node.shape[0]):
        if robot.node[l] >= 0 and link_gap(robot, world, l, 0.0, margin, work) < 0.0:
            return False
    return True


@kernel(ROBOT, WORLD, "f8[:,::1] f8", WORK, "u1[::1]")
def free_batch(robot, world, qs, margin, work, out):
    """out (b,): `is_free` of each row of qs (b, n)."""
    for i in range(qs.shape[0]):
        out[i] = is_free(robot, world, qs[i], margin, work)


def add_motion(robot, work, l, s, gx, gy, gz, slope):
    """Add to slope (n,) the derivative by q of g · centre, for placed sphere s of link l."""
    x, y, z = work.placed[s, 0], work.placed[s, 1], work.placed[s, 2]
    node = robot.node[l]
    while node >= 0:
        k = robot.real[node, 12]
        ax, ay, az = work.frames[node, 5], work.frames[node, 8], work.frames[node, 11]
        if robot.whole[node, 1] == 1:
            slope[robot.whole[node, 2]] += k * (ax * gx + ay * gy + az * gz)
        else:
            dx, dy, dz = x - work.frames[node, 0], y - work.frames[node, 1], z - work.frames[node, 2]
            slope[robot.whole[node, 2]] += k * (
                (ay * dz - az * dy) * gx + (az * dx - ax * dz) * gy + (ax * dy - ay * dx) * gz
            )
        node = robot.whole[node, 0]


def nearest(robot, world, q, reach, work, slope, found):
    """Signed distance of the nearest two surfaces at q (n,), exact below `reach`; negative for overlap.

    Args:
        robot: the robot; all links are checked, moving or not.
        world: obstacles.
        q: (n,) joint positions.
        reach: largest distance of interest (m).
        work: work space.
        slope: (n,) out: derivative of the distance by q; zero where nothing is within reach.
        found: (3,) out: sphere, then box b, obstacle boxes + o, or -1 - the other sphere; and 1 where found.
    """
    place(robot, q, work)
    least, best, other = reach, -1, 0
    gx, gy, gz = 0.0, 0.0, 0.0
    boxes = world.boxes.shape[1]
    for l in range(robot.node.shape[0]):
        place_spheres(robot, l, work)
        pad = robot.pad[l]
        for s in range(robot.start[l], robot.start[l + 1]):
            x, y, z = work.placed[s, 0], work.placed[s, 1], work.placed[s, 2]
            own = robot.spheres[s, 3] + pad
            for b in range(boxes):
                d, ux, uy, uz = box_distance(world.boxes, b, x, y, z)
                if d - own < least:
                    least, best, other = d - own, s, b
                    gx, gy, gz = ux, uy, uz
            for o in range(world.kind.shape[0]):
                dx, dy, dz = x - world.around[o, 0], y - world.around[o, 1], z - world.around[o, 2]
                far = max(own + least + world.around[o, 3], 0.0)
                if least < 0.0 or dx * dx + dy * dy + dz * dz < far * far:
                    d, ux, uy, uz = obstacle_distance(world, o, x, y, z)
                    if d - own < least:
                        least, best, other = d - own, s, boxes + o
                        gx, gy, gz = ux, uy, uz
    first = -1
    for p in range(robot.pairs.shape[0]):
        a, b = robot.pairs[p, 0], robot.pairs[p, 1]
        pad = robot.pair_pad[p]
        for s in range(robot.start[a], robot.start[a + 1]):
            for t in range(robot.start[b], robot.start[b + 1]):
                dx = work.placed[s, 0] - work.placed[t, 0]
                dy = work.placed[s, 1] - work.placed[t, 1]
                dz = work.placed[s, 2] - work.placed[t, 2]
                length = math.sqrt(dx * dx + dy * dy + dz * dz)
                d = length - robot.spheres[s, 3] - robot.spheres[t, 3] - pad
                if d < least:
                    least, best, other, first = d, s, -1 - t, a
                    scale = 1.0 / max(length, 1e-12)
                    gx, gy, gz = dx * scale, dy * scale, dz * scale
    for j in range(slope.shape[0]):
        slope[j] = 0.0
    found[0], found[1], found[2] = best, other, 1 if best >= 0 else 0
    if best < 0:
        return least
    l = link_of(robot, best) if other >= 0 else first
    add_motion(robot, work, l, best, gx, gy, gz, slope)
    if other < 0:
        add_motion(robot, work, link_of(robot, -1 - other), -1 - other, -gx, -gy, -gz, slope)
    return least


def link_of(robot, s):
    """Link that sphere s belongs to."""
    l = 0
    while robot.start[l + 1] <= s:
        l += 1
    return l


@kernel(ROBOT, WORLD, "f8[:,::1] f8", WORK, "f8[::1] f8[:,::1] i8[:,::1]")
def nearest_batch(robot, world, qs, reach, work, out, slopes, found):
    """`nearest` of each row of qs (b, n): out (b,), slopes (b, n), found (b, 3)."""
    for i in range(qs.shape[0]):
        out[i] = nearest(robot, world, qs[i], reach, work, slopes[i], found[i])


@kernel(ROBOT, "f8[:,::1] f8", WORK, "i8[::1] i8[::1]")
def count_pairs(robot, qs, close, work, touching, near):
    """Add to touching and near (p,) the configurations (b, n) in which a pair overlaps, or is that close."""
    for i in range(qs.shape[0]):
        place(robot, qs[i], work)
        for p in range(robot.pairs.shape[0]):
            gap = pair_gap(robot, p, close, 0.0, work)
            if gap < 0.0:
                touching[p] += 1
            if gap < close:
                near[p] += 1


@kernel(ROBOT, WORLD, "f8[::1] f8 f8", WORK, "f8[::1] f8[::1]")
def all_gaps(robot, world, q, margin, reach, work, links, pairs):
    """Exact signed gaps below `reach` of each link to obstacles, links (l,), and of each pair, pairs (p,)."""
    place(robot, q, work)
    for l in range(links.shape[0]):
        links[l] = reach
        place_spheres(robot, l, work)
        own = robot.pad[l] + margin
        for s in range(robot.start[l], robot.start[l + 1]):
            x, y, z = work.placed[s, 0], work.placed[s, 1], work.placed[s, 2]
            radius = robot.spheres[s, 3] + own
            for b in range(world.boxes.shape[1]):
                links[l] = min(links[l], box_distance(world.boxes, b, x, y, z)[0] - radius)
            for o in range(world.kind.shape[0]):
                links[l] = min(links[l], obstacle_distance(world, o, x, y, z)[0] - radius)
    for p in range(pairs.shape[0]):
        a, b = robot.pairs[p, 0], robot.pairs[p, 1]
        pairs[p] = reach
        for s in range(robot.start[a], robot.start[a + 1]):
            for t in range(robot.start[b], robot.start[b + 1]):
                dx = work.placed[s, 0] - work.placed[t, 0]
                dy = work.placed[s, 1] - work.placed[t, 1]
                dz = work.placed[s, 2] - work.placed[t, 2]
                d = math.sqrt(dx * dx + dy * dy + dz * dz) - robot.spheres[s, 3] - robot.spheres[t, 3]
                pairs[p] = min(pairs[p], d - robot.pair_pad[p] - margin)
