"""How deep two rounded shapes are in each other, by the steps in which Bullet finds it.

A tetrahedron around 0 in the shapes' difference grows: its face that is nearest to 0 is moved out to the
difference's surface, 128 times at most. Round shapes have no nearest face of their own, and of flat ones any
part may be it; so the points of a contact depend on the steps.

Source:
    G. van den Bergen, Collision Detection in Interactive 3D Environments, 4.3.8; the order of steps and the
    tolerances are those of Bullet, btGjkEpa2.cpp, in double precision.
"""

from __future__ import annotations

import numpy as np

from roboyard.sim.stepping.narrow_phase.closest_points import FIRST, FOUND, SECOND
from roboyard.sim.stepping.narrow_phase.simplex import (
    CORNERS,
    SEEN,
    SHORT,
    crossed,
    tetrahedron_around,
    volume,
    write_corner,
    write_frame,
)

MOST_CORNERS = 128
NORMAL, AWAY, OF, BESIDE, EDGE, BEFORE, AFTER, LOOKED, FACE = 0, 3, 4, 7, 10, 13, 14, 15, 16
"""Numbers of a face: its normal, the distance from 0, the places of three corners, the faces at its edges,
which of their edges these are, the faces before and after it in its list, -1 for none, and the last round in
which it was looked at."""
FACES = CORNERS + 9 * (MOST_CORNERS + 4)
MOST_FACES = 2 * MOST_CORNERS
HULL, FREE = FACES + FACE * MOST_FACES, FACES + FACE * MOST_FACES + 1
"""The first faces of the lists of those of the polytope and of those that are free."""
BEST = FREE + 1
"""Copy of the nearest face: normal, distance, corners."""
STACK = BEST + 7
WORK = STACK + max(3 * MOST_FACES, SEEN)
"""Length of the work array."""
MOST_ROUNDS = 255
IN_PLANE = 1e-14
"""Distance (m) under a plane up to which a corner is on it."""
UNKNOWN = 1.0
"""Answer where no way out was found."""


def deepest_in_turn(shapes, hulls, radii, work):  # pragma: no cover
    """Find the shortest way by which two rounded cores come apart; return minus its length (m).

    shapes: types of both cores, and first and number of the corners of each. radii: of the balls at their
    points (m). The cores are at FIRST and SECOND in the work array. Written at FOUND are the points of both
    cores, without the balls, and the direction from the second to the first core once they are apart. What
    is returned is of the cores, too; it may be above 0.

    Returns:
        Whether the way was found, and its length.
    """
    write_frame(work)
    x, y, z = (
        work[SECOND] - work[FIRST],
        work[SECOND + 1] - work[FIRST + 1],
        work[SECOND + 2] - work[FIRST + 2],
    )
    length = np.sqrt(x * x + y * y + z * z)
    if length > SHORT:
        x, y, z = x / length, y / length, z / length
    else:
        x, y, z = 1.0, 0.0, 0.0
    if not tetrahedron_around(shapes, hulls, radii, STACK, x, y, z, work) or not begin(work):
        return False, 0.0
    grow(shapes, hulls, radii, work)
    nx, ny, nz, depth = work[BEST], work[BEST + 1], work[BEST + 2], work[BEST + 3]
    px = py = pz = total = 0.0
    for k in range(3):
        a, b = int(work[BEST + 4 + k]), int(work[BEST + 4 + (k + 1) % 3])
        c = int(work[BEST + 4 + (k + 2) % 3])
        share = crossed(
            work[b + 3] - depth * nx, work[b + 4] - depth * ny, work[b + 5] - depth * nz,
            work[c + 3] - depth * nx, work[c + 4] - depth * ny, work[c + 5] - depth * nz,
        )  # fmt: skip
        px, py, pz = px + share * work[a + 6], py + share * work[a + 7], pz + share * work[a + 8]
        total += share
    if total <= 0.0:
        return False, 0.0
    px, py, pz = px / total, py / total, pz / total
    one, two = radii[0], radii[1]
    qx, qy, qz = px - (depth - two) * nx, py - (depth - two) * ny, pz - (depth - two) * nz
    px, py, pz = px - one * nx, py - one * ny, pz - one * nz
    for k in range(3):
        u, v, w = work[FIRST + 3 + 3 * k], work[FIRST + 4 + 3 * k], work[FIRST + 5 + 3 * k]
        work[FOUND + k] = work[FIRST + k] + u * px + v * py + w * pz
        work[FOUND + 3 + k] = work[FIRST + k] + u * qx + v * qy + w * qz
        work[FOUND + 6 + k] = -(u * nx + v * ny + w * nz)
    return True, one + two - depth


def begin(work):  # pragma: no cover
    """Write the faces of the tetrahedron at CORNERS; return whether there are four."""
    work[HULL], work[FREE] = -1.0, -1.0
    for f in range(MOST_FACES - 1, -1, -1):
        add_to_list(work, FREE, f)
    if volume(work) < 0.0:
        for k in range(9):
            one = work[CORNERS + k]
            work[CORNERS + k], work[CORNERS + 9 + k] = work[CORNERS + 9 + k], one
    has_all = True
    for k in range(4):
        a, b, c = (0 if k == 0 else (1 if k == 1 else (2 if k == 2 else 0))), 1, 2
        if k == 1:
            b, c = 0, 3
        elif k == 2:
            b, c = 1, 3
        elif k == 3:
            b, c = 2, 3
        has_all &= new_face(work, CORNERS + 9 * a, CORNERS + 9 * b, CORNERS + 9 * c, True) == k
    if not has_all:
        return False
    bind(work, 0, 0, 1, 0)
    bind(work, 0, 1, 2, 0)
    bind(work, 0, 2, 3, 0)
    bind(work, 1, 1, 3, 2)
    bind(work, 1, 2, 2, 1)
    bind(work, 2, 2, 3, 1)
    return True


def grow(shapes, hulls, radii, work):  # pragma: no cover
    """Move out the nearest face until it is on the surface, and leave a copy of the last one at BEST."""
    best = nearest_face(work)
    copy_best(work, best)
    for turn in range(min(MOST_ROUNDS, MOST_CORNERS)):
        face = FACES + FACE * best
        corner = CORNERS + 9 * (4 + turn)
        work[face + LOOKED] = turn + 1
        nx, ny, nz = work[face], work[face + 1], work[face + 2]
        write_corner(shapes, hulls, radii, corner, nx, ny, nz, work)
        over = nx * work[corner + 3] + ny * work[corner + 4] + nz * work[corner + 5] - work[face + AWAY]
        if over <= SHORT:
            return
        first = last = -1
        count = 0
        for edge in range(3):
            is_whole, first, last, count = replace_seen(
                work, turn + 1, corner, best, edge, first, last, count
            )
            if not is_whole:
                return
        if count < 3:
            return
        bind(work, last, 1, first, 2)
        take_from_list(work, HULL, best)
        add_to_list(work, FREE, best)
        best = nearest_face(work)
        copy_best(work, best)


def replace_seen(work, turn, corner, start, edge, first, last, count):  # pragma: no cover
    """Remove the faces behind an edge that a corner is above, and add faces from their rim to the corner.

    Returns:
        Whether there is such a rim, the first and the last new face, and their number.
    """
    begin_at = FACES + FACE * start
    work[STACK], work[STACK + 1], work[STACK + 2] = (
        work[begin_at + BESIDE + edge],
        work[begin_at + EDGE + edge],
        0,
    )
    depth = 1
    while depth > 0:
        at = STACK + 3 * (depth - 1)
        f, e = int(work[at]), int(work[at + 1])
        face = FACES + FACE * f
        if work[at + 2] == 0.0:
            if work[face + LOOKED] == turn:
                return False, first, last, count
            height = work[face] * work[corner + 3] + work[face + 1] * work[corner + 4]
            height += work[face + 2] * work[corner + 5] - work[face + AWAY]
            if height < -IN_PLANE:
                new = new_face(
                    work, int(work[face + OF + (e + 1) % 3]), int(work[face + OF + e]), corner, False
                )  # fmt: skip
                if new < 0:
                    return False, first, last, count
                bind(work, new, 0, f, e)
                if last >= 0:
                    bind(work, last, 1, new, 2)
                else:
                    first = new
                last = new
                count += 1
                depth -= 1
                continue
            work[face + LOOKED] = turn
        if work[at + 2] == 2.0:
            take_from_list(work, HULL, f)
            add_to_list(work, FREE, f)
            depth -= 1
            continue
        side = (e + 1 + int(work[at + 2])) % 3
        work[at + 2] += 1.0
        if depth >= MOST_FACES:
            return False, first, last, count
        work[at + 3], work[at + 4], work[at + 5] = work[face + BESIDE + side], work[face + EDGE + side], 0.0
        depth += 1
    return True, first, last, count


def new_face(work, a, b, c, is_first):  # pragma: no cover
    """Add a face with corners at these places, seen from outside; return its number, -1 where it is none."""
    f = int(work[FREE])
    if f < 0:
        return -1
    ux, uy, uz = work[b + 3] - work[a + 3], work[b + 4] - work[a + 4], work[b + 5] - work[a + 5]
    vx, vy, vz = work[c + 3] - work[a + 3], work[c + 4] - work[a + 4], work[c + 5] - work[a + 5]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if length <= SHORT:
        return -1
    away, is_beside = 0.0, False
    for k in range(3):
        if not is_beside:
            one, two = a if k == 0 else (b if k == 1 else c), b if k == 0 else (c if k == 1 else a)
            away, is_beside = edge_distance(work, one + 3, two + 3, nx, ny, nz)
    if not is_beside:
        away = (work[a + 3] * nx + work[a + 4] * ny + work[a + 5] * nz) / length
    if not is_first and away < -IN_PLANE:
        return -1
    take_from_list(work, FREE, f)
    add_to_list(work, HULL, f)
    face = FACES + FACE * f
    work[face], work[face + 1], work[face + 2] = nx / length, ny / length, nz / length
    work[face + AWAY], work[face + LOOKED] = away, 0.0
    work[face + OF], work[face + OF + 1], work[face + OF + 2] = a, b, c
    return f


def edge_distance(work, a, b, nx, ny, nz):  # pragma: no cover
    """Return the distance of 0 from an edge of a face, and whether 0 is beside it, not over the face."""
    x, y, z = work[b] - work[a], work[b + 1] - work[a + 1], work[b + 2] - work[a + 2]
    ox, oy, oz = y * nz - z * ny, z * nx - x * nz, x * ny - y * nx
    if work[a] * ox + work[a + 1] * oy + work[a + 2] * oz >= 0.0:
        return 0.0, False
    one = work[a] ** 2 + work[a + 1] ** 2 + work[a + 2] ** 2
    two = work[b] ** 2 + work[b + 1] ** 2 + work[b + 2] ** 2
    if work[a] * x + work[a + 1] * y + work[a + 2] * z > 0.0:
        return np.sqrt(one), True
    if work[b] * x + work[b + 1] * y + work[b + 2] * z < 0.0:
        return np.sqrt(two), True
    both = work[a] * work[b] + work[a + 1] * work[b + 1] + work[a + 2] * work[b + 2]
    return np.sqrt(max((one * two - both * both) / (x * x + y * y + z * z), 0.0)), True


def nearest_face(work):  # pragma: no cover
    """Return the first face of the polytope at the least distance from 0."""
    best = f = int(work[HULL])
    least = 1e300
    while f >= 0:
        away = work[FACES + FACE * f + AWAY]
        if away * away < least:
            best, least = f, away * away
        f = int(work[FACES + FACE * f + AFTER])
    return best


def copy_best(work, best):  # pragma: no cover
    """Copy normal, distance and corners of a face to BEST."""
    for k in range(7):
        work[BEST + k] = work[FACES + FACE * best + k]


def bind(work, f, edge, g, other):  # pragma: no cover
    """Note that two faces are beside each other at these edges."""
    one, two = FACES + FACE * f, FACES + FACE * g
    work[one + BESIDE + edge], work[one + EDGE + edge] = g, other
    work[two + BESIDE + other], work[two + EDGE + other] = f, edge


def add_to_list(work, head, f):  # pragma: no cover
    """Put a face before the first one of a list."""
    face, root = FACES + FACE * f, int(work[head])
    work[face + BEFORE], work[face + AFTER] = -1.0, root
    if root >= 0:
        work[FACES + FACE * root + BEFORE] = f
    work[head] = f


def take_from_list(work, head, f):  # pragma: no cover
    """Take a face out of a list."""
    before, after = int(work[FACES + FACE * f + BEFORE]), int(work[FACES + FACE * f + AFTER])
    if after >= 0:
        work[FACES + FACE * after + BEFORE] = before
    if before >= 0:
        work[FACES + FACE * before + AFTER] = after
    else:
        work[head] = after
