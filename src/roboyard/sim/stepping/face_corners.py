"""The order in which Bullet finds the points of two boxes that touch with a face.

One box's face is cut to the other's, edge by edge; the points come in the order of the polygon that is left.
See R. Smith's box-box test in ODE, which Bullet took over.
"""

from __future__ import annotations

import numpy as np

ORDER, QUAD, CUT, ANGLE, AXES, SCRATCH = 16, 24, 40, 56, 64, 88
"""Places in the work array: of the order, of the polygon's corners, of those of the polygon cut next, of
angles and of both boxes' axes, four numbers each; its length."""
MOST_CORNERS, LEFT = 8, 4
"""Corners of a polygon, and most points of a pair."""
FAR = 1e9


def order_corners(  # pragma: no cover
    contacts, first, end, one, two, boxes, geom_body, xpos, xmat, thickness, work
):
    """Write the contacts first ... end in Bullet's order, counted from the first, into work[ORDER ...].

    Returns how many of them Bullet takes. Contacts further apart than `thickness` (m) come after its points.
    one, two: their geoms, that of the body which Bullet lists first, first. boxes: (ngeom, 4, 3) middles of
    the shapes and their half axes in the frames of the bodies (m).
    """
    body, other_body = geom_body[one], geom_body[two]
    write_axes(boxes, one, xmat, body, work, AXES)
    write_axes(boxes, two, xmat, other_body, work, AXES + 12)
    ax, ay, az = in_world(boxes, one, 0, xmat, body)
    ax, ay, az = ax + xpos[body, 0], ay + xpos[body, 1], az + xpos[body, 2]
    cx, cy, cz = in_world(boxes, two, 0, xmat, other_body)
    cx, cy, cz = cx + xpos[other_body, 0] - ax, cy + xpos[other_body, 1] - ay, cz + xpos[other_body, 2] - az
    side, axis = deepest_face(work, cx, cy, cz)
    if side == 1:
        ax, ay, az, cx, cy, cz = ax + cx, ay + cy, az + cz, -cx, -cy, -cz
    own, other = AXES + 12 * side, AXES + 12 * (1 - side)
    n = own + 4 * (axis - 1)
    nx, ny, nz = work[n], work[n + 1], work[n + 2]
    if nx * cx + ny * cy + nz * cz < 0.0:
        nx, ny, nz = -nx, -ny, -nz
    flat, most, sign = 1, -1.0, 1.0
    for k in range(1, 4):
        n = other + 4 * (k - 1)
        along = work[n] * nx + work[n + 1] * ny + work[n + 2] * nz
        if abs(along) > most or (k == 3 and abs(along) == most):
            flat, most, sign = k, abs(along), -1.0 if along < 0.0 else 1.0
    n = other + 4 * (flat - 1)
    depth = sign * work[n + 3]
    cx, cy, cz = cx - depth * work[n], cy - depth * work[n + 1], cz - depth * work[n + 2]
    n, m = own + (4 if axis == 1 else 0), own + (4 if axis == 3 else 8)
    ux, uy, uz, wide = work[n], work[n + 1], work[n + 2], work[n + 3]
    vx, vy, vz, high = work[m], work[m + 1], work[m + 2], work[m + 3]
    n, m = other + (4 if flat == 1 else 0), other + (4 if flat == 3 else 8)
    px, py, pz = work[n + 3] * work[n], work[n + 3] * work[n + 1], work[n + 3] * work[n + 2]
    qx, qy, qz = work[m + 3] * work[m], work[m + 3] * work[m + 1], work[m + 3] * work[m + 2]
    for k in range(4):
        p = -1.0 if k < 2 else 1.0
        q = 1.0 if k == 1 or k == 2 else -1.0
        x, y, z = cx + p * px + q * qx, cy + p * py + q * qy, cz + p * pz + q * qz
        work[QUAD + 2 * k] = ux * x + uy * y + uz * z
        work[QUAD + 2 * k + 1] = vx * x + vy * y + vz * z
    count = 4
    for edge in range(4):
        count = cut_polygon(
            work, count, edge // 2, -1.0 if edge % 2 == 0 else 1.0, wide if edge < 2 else high
        )
    number = min(end - first, MOST_CORNERS)
    listed = taken = 0
    for corner in range(count):
        best, least = -1, FAR
        for n in range(number):
            if taken & (1 << n) == 0:
                x = contacts.position[first + n, 0] - ax
                y = contacts.position[first + n, 1] - ay
                z = contacts.position[first + n, 2] - az
                apart = (ux * x + uy * y + uz * z - work[QUAD + 2 * corner]) ** 2
                apart += (vx * x + vy * y + vz * z - work[QUAD + 2 * corner + 1]) ** 2
                if apart < least:
                    best, least = n, apart
        if best >= 0 and least < 1e-6 * (wide * wide + high * high):
            taken |= 1 << best
            work[ORDER + listed], work[CUT + listed] = best, corner
            if contacts.dist[first + best] <= thickness:
                listed += 1
    if listed > LEFT:
        cull_corners(contacts, first, listed, work)
        return LEFT
    for n in range(number):
        fresh = True
        for k in range(listed):
            fresh &= work[ORDER + k] != n
        if fresh:
            work[ORDER + listed] = n
            listed += 1
    return listed


def cull_corners(contacts, first, count, work):  # pragma: no cover
    """Leave the deepest of the corners listed, and those nearest to the quarters of a turn from it."""
    area = x = y = 0.0
    for n in range(count):
        here, there = QUAD + 2 * int(work[CUT + n]), QUAD + 2 * int(work[CUT + (n + 1) % count])
        twice = work[here] * work[there + 1] - work[there] * work[here + 1]
        area += twice
        x += twice * (work[here] + work[there])
        y += twice * (work[here + 1] + work[there + 1])
    share = 1.0 / (3.0 * area) if abs(area) > 2.3e-16 else 1e18
    x, y = share * x, share * y
    deepest = 0
    for n in range(count):
        place = QUAD + 2 * int(work[CUT + n])
        work[ANGLE + n] = np.arctan2(work[place + 1] - y, work[place] - x)
        if contacts.dist[first + int(work[ORDER + n])] < contacts.dist[first + int(work[ORDER + deepest])]:
            deepest = n
    taken = 1 << deepest
    chosen = deepest
    for quarter in range(1, LEFT):
        wanted = work[ANGLE + deepest] + 0.5 * np.pi * quarter
        if wanted > np.pi:
            wanted -= 2.0 * np.pi
        best, least = deepest, FAR
        for n in range(count):
            apart = abs(work[ANGLE + n] - wanted)
            apart = 2.0 * np.pi - apart if apart > np.pi else apart
            if taken & (1 << n) == 0 and apart < least:
                best, least = n, apart
        taken |= 1 << best
        chosen |= best << (4 * quarter)
    for n in range(count):
        work[CUT + n] = work[ORDER + n]
    for quarter in range(LEFT):
        work[ORDER + quarter] = work[CUT + ((chosen >> (4 * quarter)) & 15)]
    left = LEFT
    for n in range(count):
        if taken & (1 << n) == 0:
            work[ORDER + left] = work[CUT + n]
            left += 1


def write_axes(boxes, geom, xmat, body, work, place):
    """Write the unit axes of a geom's box in the world, each and half the box's length along it (m)."""
    for axis in range(3):
        x, y, z = in_world(boxes, geom, axis + 1, xmat, body)
        half = np.sqrt(x * x + y * y + z * z)
        at = place + 4 * axis
        work[at], work[at + 1], work[at + 2], work[at + 3] = x / half, y / half, z / half, half


def deepest_face(work, x, y, z):
    """Return which of two boxes has the face of the least depth, and its axis, 1 ... 3; of equals the first.

    work: axes of both from AXES on. x, y, z: from the middle of the first to that of the second (m).
    """
    side, best, face = 0, 1, -FAR
    for k in range(2):
        for axis in range(3):
            n = AXES + 12 * k + 4 * axis
            reach = work[n + 3]
            for edge in range(3):
                m = AXES + 12 * (1 - k) + 4 * edge
                along = work[n] * work[m] + work[n + 1] * work[m + 1] + work[n + 2] * work[m + 2]
                reach += work[m + 3] * abs(along)
            gap = abs(work[n] * x + work[n + 1] * y + work[n + 2] * z) - reach
            if gap > face:
                side, best, face = k, axis + 1, gap
    return side, best


def cut_polygon(work, count, across, sign, bound):  # pragma: no cover
    """Leave of a polygon where a coordinate (0 or 1) times a sign is below a bound; return its corners."""
    left = 0
    for n in range(count):
        here, there = QUAD + 2 * n, QUAD + 2 * ((n + 1) % count)
        a, b = work[here + across], work[there + across]
        if sign * a < bound and left < MOST_CORNERS:
            work[CUT + 2 * left], work[CUT + 2 * left + 1] = work[here], work[here + 1]
            left += 1
        if (sign * a < bound) != (sign * b < bound) and left < MOST_CORNERS:
            share = (sign * bound - a) / (b - a)
            along = 1 - across
            work[CUT + 2 * left + along] = work[here + along] + share * (
                work[there + along] - work[here + along]
            )
            work[CUT + 2 * left + across] = sign * bound
            left += 1
    for k in range(2 * left):
        work[QUAD + k] = work[CUT + k]
    return left


def in_world(boxes, geom, axis, xmat, body):
    """Return a vector of a geom's box turned to the world."""
    x, y, z = boxes[geom, axis, 0], boxes[geom, axis, 1], boxes[geom, axis, 2]
    return (
        xmat[body, 0] * x + xmat[body, 1] * y + xmat[body, 2] * z,
        xmat[body, 3] * x + xmat[body, 4] * y + xmat[body, 5] * z,
        xmat[body, 6] * x + xmat[body, 7] * y + xmat[body, 8] * z,
    )
