"""A tetrahedron around 0 in the difference of two rounded shapes, by the steps in which Bullet finds it.

A corner is nine numbers in the work array: the direction in which it is farthest, its place, and the first
shape's point, all in the frame of that shape.

Source:
    E. Gilbert, D. Johnson, S. Keerthi, A fast procedure for computing the distance between complex objects
    (1988); the order of steps and the tolerances are those of Bullet, btGjkEpa2.cpp, in double precision.
"""

from __future__ import annotations

import numpy as np

from roboyard.sim.stepping.narrow_phase.closest_points import FIRST, SECOND, farthest_in_core
from roboyard.sim.stepping.narrow_phase.closest_points import WORK as SEARCHED

FRAME = SEARCHED
"""Place in the work array of the second shape's frame in the first one's: rotation by rows, and place (m)."""
CORNERS = FRAME + 12
"""Place of the simplex's four corners, after which those of the polytope follow."""
MOST_STEPS = 128
SHORT = 1e-12
"""Distance (m), its square and share of one that count as 0."""
SEEN = 12
"""Numbers of the last four corners' places."""


def write_frame(work):  # pragma: no cover
    """Write the second core's frame in the first one's."""
    for i in range(3):
        for j in range(3):
            total = 0.0
            for k in range(3):
                total += work[FIRST + 3 + 3 * k + i] * work[SECOND + 3 + 3 * k + j]
            work[FRAME + 3 * i + j] = total
        total = 0.0
        for k in range(3):
            total += work[FIRST + 3 + 3 * k + i] * (work[SECOND + k] - work[FIRST + k])
        work[FRAME + 9 + i] = total


def write_corner(shapes, hulls, radii, corner, x, y, z, work):  # pragma: no cover
    """Write the corner of the difference that is farthest along a direction of any length."""
    length = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    one, two, f = radii[0], radii[1], FRAME
    ux = -(work[f] * x + work[f + 3] * y + work[f + 6] * z)
    uy = -(work[f + 1] * x + work[f + 4] * y + work[f + 7] * z)
    uz = -(work[f + 2] * x + work[f + 5] * y + work[f + 8] * z)
    px, py, pz = farthest_in_core(shapes[0], hulls, shapes[2], shapes[3], work, FIRST, x, y, z)
    qx, qy, qz = farthest_in_core(shapes[1], hulls, shapes[4], shapes[5], work, SECOND, ux, uy, uz)
    px, py, pz = px + one * x, py + one * y, pz + one * z
    qx, qy, qz = qx + two * ux, qy + two * uy, qz + two * uz
    work[corner], work[corner + 1], work[corner + 2] = x, y, z
    work[corner + 3] = px - (work[f] * qx + work[f + 1] * qy + work[f + 2] * qz + work[f + 9])
    work[corner + 4] = py - (work[f + 3] * qx + work[f + 4] * qy + work[f + 5] * qz + work[f + 10])
    work[corner + 5] = pz - (work[f + 6] * qx + work[f + 7] * qy + work[f + 8] * qz + work[f + 11])
    work[corner + 6], work[corner + 7], work[corner + 8] = px, py, pz


def tetrahedron_around(shapes, hulls, radii, seen, x, y, z, work):  # pragma: no cover
    """Find four corners at CORNERS around 0; return whether there are any.

    shapes: types of both cores, and first and number of the corners of each. radii: of the balls at their
    points (m). seen: place of SEEN numbers to work in. x, y, z: direction in which to begin.
    """
    write_corner(shapes, hulls, radii, CORNERS, x, y, z, work)
    x, y, z = work[CORNERS + 3], work[CORNERS + 4], work[CORNERS + 5]
    for k in range(0, SEEN, 3):
        work[seen + k], work[seen + k + 1], work[seen + k + 2] = x, y, z
    count, latest, along, is_inside = 1, 0, 0.0, False
    for _ in range(MOST_STEPS):
        length = np.sqrt(x * x + y * y + z * z)
        if length < SHORT:
            is_inside = True
            break
        new = CORNERS + 9 * count
        write_corner(shapes, hulls, radii, new, -x, -y, -z, work)
        wx, wy, wz = work[new + 3], work[new + 4], work[new + 5]
        is_known = False
        for k in range(0, SEEN, 3):
            apart = (wx - work[seen + k]) ** 2 + (wy - work[seen + k + 1]) ** 2
            is_known |= apart + (wz - work[seen + k + 2]) ** 2 < SHORT
        if is_known:
            break
        latest = (latest + 3) % SEEN
        work[seen + latest], work[seen + latest + 1], work[seen + latest + 2] = wx, wy, wz
        along = max((x * wx + y * wy + z * wz) / length, along)
        if length - along - SHORT * length <= 0.0:
            break
        squared, used, a, b, c, d = nearest(count + 1, work)
        if squared < 0.0:
            break
        x = y = z = 0.0
        left = 0
        for k in range(count + 1):
            if used & (1 << k) == 0:
                continue
            share = a if k == 0 else (b if k == 1 else (c if k == 2 else d))
            corner, to = CORNERS + 9 * k, CORNERS + 9 * left
            x, y, z = x + share * work[corner + 3], y + share * work[corner + 4], z + share * work[corner + 5]
            for m in range(9):
                work[to + m] = work[corner + m]
            left += 1
        count = left
        if used == 15:
            is_inside = True
            break
    if not is_inside or count < 2:
        return False
    if count == 2:
        return enclose_edge(shapes, hulls, radii, work)
    if count == 3:
        return enclose_face(shapes, hulls, radii, work)
    return volume(work) != 0.0


def nearest(count, work):  # pragma: no cover
    """Return the square of the distance of a simplex from 0, the corners used, as bits, and their shares.

    The square is -1 where the simplex is flat.
    """
    a, b, c, d = CORNERS + 3, CORNERS + 12, CORNERS + 21, CORNERS + 30
    if count == 2:
        squared, used, one, two = on_edge(a, b, work)
        return squared, used, one, two, 0.0, 0.0
    if count == 3:
        squared, used, one, two, three = on_face(a, b, c, work)
        return squared, used, one, two, three, 0.0
    ax, ay, az = work[a] - work[d], work[a + 1] - work[d + 1], work[a + 2] - work[d + 2]
    bx, by, bz = work[b] - work[d], work[b + 1] - work[d + 1], work[b + 2] - work[d + 2]
    cx, cy, cz = work[c] - work[d], work[c + 1] - work[d + 1], work[c + 2] - work[d + 2]
    size = triple(ax, ay, az, bx, by, bz, cx, cy, cz)
    ux, uy, uz = work[b] - work[c], work[b + 1] - work[c + 1], work[b + 2] - work[c + 2]
    vx, vy, vz = work[a] - work[b], work[a + 1] - work[b + 1], work[a + 2] - work[b + 2]
    side = triple(work[a], work[a + 1], work[a + 2], ux, uy, uz, vx, vy, vz)
    if size * side > 0.0 or size == 0.0:
        return -1.0, 0, 0.0, 0.0, 0.0, 0.0
    least, used, first, second, third, fourth = -1.0, 0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        j = (i + 1) % 3
        one, two = CORNERS + 3 + 9 * i, CORNERS + 3 + 9 * j
        ux, uy, uz = work[one] - work[d], work[one + 1] - work[d + 1], work[one + 2] - work[d + 2]
        vx, vy, vz = work[two] - work[d], work[two + 1] - work[d + 1], work[two + 2] - work[d + 2]
        if size * triple(work[d], work[d + 1], work[d + 2], ux, uy, uz, vx, vy, vz) <= 0.0:
            continue
        squared, part, p, q, r = on_face(one, two, d, work)
        if least < 0.0 or squared < least:
            least = squared
            used = ((part & 1) << i) | (((part >> 1) & 1) << j) | ((part >> 2) << 3)
            first = p if i == 0 else (q if j == 0 else 0.0)
            second = p if i == 1 else (q if j == 1 else 0.0)
            third = p if i == 2 else (q if j == 2 else 0.0)
            fourth = r
    if least < 0.0:
        least, used = 0.0, 15
        first = at_corners(c, b, d, work) / size
        second = at_corners(a, c, d, work) / size
        third = at_corners(b, a, d, work) / size
        fourth = 1.0 - (first + second + third)
    return least, used, first, second, third, fourth


def on_edge(a, b, work):  # pragma: no cover
    """Return what `nearest` does, of two places."""
    along = length = at_a = at_b = at = 0.0
    for k in range(3):
        edge = work[b + k] - work[a + k]
        along, length = along - work[a + k] * edge, length + edge * edge
        at_a, at_b = at_a + work[a + k] ** 2, at_b + work[b + k] ** 2
    if length <= 0.0:
        return -1.0, 0, 0.0, 0.0
    share = along / length
    if share >= 1.0:
        return at_b, 2, 0.0, 1.0
    if share <= 0.0:
        return at_a, 1, 1.0, 0.0
    for k in range(3):
        at += (work[a + k] + share * (work[b + k] - work[a + k])) ** 2
    return at, 3, 1.0 - share, share


def on_face(a, b, c, work):  # pragma: no cover
    """Return what `nearest` does, of three places."""
    ux, uy, uz = work[a] - work[b], work[a + 1] - work[b + 1], work[a + 2] - work[b + 2]
    vx, vy, vz = work[b] - work[c], work[b + 1] - work[c + 1], work[b + 2] - work[c + 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area = nx * nx + ny * ny + nz * nz
    if area <= 0.0:
        return -1.0, 0, 0.0, 0.0, 0.0
    least, used, first, second, third = -1.0, 0, 0.0, 0.0, 0.0
    for i in range(3):
        j = (i + 1) % 3
        one, two = a if i == 0 else (b if i == 1 else c), a if j == 0 else (b if j == 1 else c)
        ex, ey, ez = work[one] - work[two], work[one + 1] - work[two + 1], work[one + 2] - work[two + 2]
        if triple(work[one], work[one + 1], work[one + 2], ex, ey, ez, nx, ny, nz) <= 0.0:
            continue
        squared, part, p, q = on_edge(one, two, work)
        if least < 0.0 or squared < least:
            least, used = squared, ((part & 1) << i) | ((part >> 1) << j)
            first = p if i == 0 else (q if j == 0 else 0.0)
            second = p if i == 1 else (q if j == 1 else 0.0)
            third = p if i == 2 else (q if j == 2 else 0.0)
    if least < 0.0:
        scale = (work[a] * nx + work[a + 1] * ny + work[a + 2] * nz) / area
        px, py, pz = scale * nx, scale * ny, scale * nz
        length = np.sqrt(area)
        first = crossed(vx, vy, vz, work[b] - px, work[b + 1] - py, work[b + 2] - pz) / length
        second = (
            crossed(
                work[c] - work[a], work[c + 1] - work[a + 1], work[c + 2] - work[a + 2],
                work[c] - px, work[c + 1] - py, work[c + 2] - pz,
            )
            / length
        )  # fmt: skip
        least, used, third = px * px + py * py + pz * pz, 7, 1.0 - (first + second)
    return least, used, first, second, third


def enclose_edge(shapes, hulls, radii, work):  # pragma: no cover
    """Add two corners to two; return whether the four have a volume."""
    a, b = CORNERS + 3, CORNERS + 12
    x, y, z = work[b] - work[a], work[b + 1] - work[a + 1], work[b + 2] - work[a + 2]
    for side in range(6):
        sign = 1.0 if side % 2 == 0 else -1.0
        ux, uy, uz = 0.0, z, -y
        if side // 2 == 1:
            ux, uy, uz = -z, 0.0, x
        elif side // 2 == 2:
            ux, uy, uz = y, -x, 0.0
        if ux * ux + uy * uy + uz * uz > 0.0:
            write_corner(shapes, hulls, radii, CORNERS + 18, sign * ux, sign * uy, sign * uz, work)
            if enclose_face(shapes, hulls, radii, work):
                return True
    return False


def enclose_face(shapes, hulls, radii, work):  # pragma: no cover
    """Add a corner to three; return whether the four have a volume."""
    a, b, c = CORNERS + 3, CORNERS + 12, CORNERS + 21
    ux, uy, uz = work[b] - work[a], work[b + 1] - work[a + 1], work[b + 2] - work[a + 2]
    vx, vy, vz = work[c] - work[a], work[c + 1] - work[a + 1], work[c + 2] - work[a + 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    if nx * nx + ny * ny + nz * nz > 0.0:
        for side in range(2):
            sign = 1.0 if side == 0 else -1.0
            write_corner(shapes, hulls, radii, CORNERS + 27, sign * nx, sign * ny, sign * nz, work)
            if volume(work) != 0.0:
                return True
    return False


def volume(work):  # pragma: no cover
    """Return six times the volume of the simplex, above 0 where its corners are in Bullet's order."""
    a, b, c, d = CORNERS + 3, CORNERS + 12, CORNERS + 21, CORNERS + 30
    return triple(
        work[a] - work[d], work[a + 1] - work[d + 1], work[a + 2] - work[d + 2],
        work[b] - work[d], work[b + 1] - work[d + 1], work[b + 2] - work[d + 2],
        work[c] - work[d], work[c + 1] - work[d + 1], work[c + 2] - work[d + 2],
    )  # fmt: skip


def at_corners(a, b, c, work):  # pragma: no cover
    """Return the triple product of three places."""
    return triple(
        work[a],
        work[a + 1],
        work[a + 2],
        work[b],
        work[b + 1],
        work[b + 2],
        work[c],
        work[c + 1],
        work[c + 2],
    )


def triple(ax, ay, az, bx, by, bz, cx, cy, cz):  # pragma: no cover
    """Return the product of a vector with the cross product of two others."""
    return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)


def crossed(ax, ay, az, bx, by, bz):  # pragma: no cover
    """Return the length of the cross product of two vectors."""
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return np.sqrt(x * x + y * y + z * z)
