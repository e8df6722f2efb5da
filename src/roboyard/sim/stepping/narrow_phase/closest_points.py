"""The closest points of two convex shapes, found in the way in which an impulse engine finds them.

A shape is a core with a ball at each of its points: the segment of a capsule, a box less its margin. Bullet
searches the cores (Gilbert, Johnson and Keerthi's search, with the tests of Ericson's "Real-Time Collision
Detection", 5.1) and adds the balls then. Where an edge is near, the normal leans; where two corners are as
near as each other, the steps of the search decide between them. It ends within 1e-12 of a distance's square.
"""

from __future__ import annotations

import numpy as np

SPHERE, CAPSULE, CYLINDER, BOX, MESH = 2, 3, 5, 6, 7
"""MuJoCo's types of these geoms."""
TRIANGLE = 20
"""Type of a triangle, which is no geom of its own."""
CORE = 16
"""Numbers of a core: its place (3), axes (9, by columns), half sizes (3) and the radius of the balls. A
triangle has its corners in the world instead of axes."""
FIRST, SECOND, FOUND, SIMPLEX, SHARES, PART = 0, CORE, 2 * CORE, 2 * CORE + 16, 2 * CORE + 64, 2 * CORE + 72
"""Places in the work array: of both cores; of the points found on these and the way from the second to the
first; of the four corners of the simplex, each a difference and the two points, and one for the next; of the
shares of the corners and of those of a face."""
WORK = PART + 8
"""Length of the work array."""
CLOSE = 1e-12
"""Share of the square of a distance that a corner must be nearer to go on."""
SAME = 1e-12
"""Square of the distance (m²) of corners of a simplex that are the same."""
FLAT = 1e-8
"""Volume (six-fold, m³) of a simplex that counts as flat."""
AROUND = -2.0
"""Answer where the cores overlap and the simplex is around 0."""
FAR = 1e6
"""Distance (m) that is larger than all others."""
BEYOND = 1e9
"""Answer where the cores are known to be farther apart than is asked for."""
TINY = 2.220446049250313e-16
MOST_ROUNDS = 1000


def closest_points(type_a, type_b, hulls, spans, a, b, flat, most, work):  # pragma: no cover
    """Find the points of two cores that are closest to each other; return their distance (m).

    hulls: (n, 3) corners of all hulls in the frames of their bodies (m). spans: (ngeom, 2) first one and
    number of each geom's. a, b: geoms. flat: see `FLAT`. most: distance (m) beyond which the search ends.
    work: (WORK,) with both cores; the points on the first and on the second core (m), and the way from that
    to this one, are written at FOUND.

    Returns:
        `AROUND` where the cores overlap, -1 where nothing can be said, `BEYOND` where the search ended.
    """
    count = 0
    squared = 1e300
    vx, vy, vz = 0.0, 1.0, 0.0
    last_x = last_y = last_z = 1e300
    found = False
    rounds = 0
    while rounds < MOST_ROUNDS:
        rounds += 1
        px, py, pz = farthest(type_a, hulls, spans[a, 0], spans[a, 1], work, FIRST, -vx, -vy, -vz)
        qx, qy, qz = farthest(type_b, hulls, spans[b, 0], spans[b, 1], work, SECOND, vx, vy, vz)
        wx, wy, wz = px - qx, py - qy, pz - qz
        delta = vx * wx + vy * wy + vz * wz
        if count > 0 and delta > 0.0 and delta * delta > squared * most * most:
            return BEYOND
        is_known = wx == last_x and wy == last_y and wz == last_z
        for n in range(count):
            at = SIMPLEX + 9 * n
            far = (work[at] - wx) ** 2 + (work[at + 1] - wy) ** 2 + (work[at + 2] - wz) ** 2
            is_known |= far <= SAME
        if is_known or squared - delta <= squared * CLOSE:
            found = True
            break
        last_x, last_y, last_z = wx, wy, wz
        at = SIMPLEX + 9 * count
        work[at], work[at + 1], work[at + 2] = wx, wy, wz
        work[at + 3], work[at + 4], work[at + 5] = px, py, pz
        work[at + 6], work[at + 7], work[at + 8] = qx, qy, qz
        count += 1
        left = nearest_of_simplex(count, flat, work)
        if left < 0:  # flat
            found = True
            break
        if left == 4:
            return AROUND
        count = left
        ux, uy, uz = work[FOUND + 6], work[FOUND + 7], work[FOUND + 8]
        before, squared = squared, ux * ux + uy * uy + uz * uz
        if squared < CLOSE:
            vx, vy, vz = ux, uy, uz
            found = True
            break
        if before - squared <= TINY * before:
            found = True
            break
        vx, vy, vz = ux, uy, uz
    length = np.sqrt(vx * vx + vy * vy + vz * vz)
    if not found or length <= 1e-12 or count == 0:
        return -1.0
    px, py, pz = farthest(type_a, hulls, spans[a, 0], spans[a, 1], work, FIRST, -vx, -vy, -vz)
    qx, qy, qz = farthest(type_b, hulls, spans[b, 0], spans[b, 1], work, SECOND, vx, vy, vz)
    if vx * (px - qx) + vy * (py - qy) + vz * (pz - qz) <= 0.0:
        return -1.0  # not shown to be apart
    work[FOUND + 6], work[FOUND + 7], work[FOUND + 8] = vx, vy, vz
    return length


def closest_of_segments(work):  # pragma: no cover
    """Find the closest points of the segments in two capsules, or of a segment and a ball's centre.

    Source:
        C. Ericson, Real-Time Collision Detection, 5.1.9, from the middles of the segments as in Bullet: where
        they are parallel, from the middle of the first.

    Returns:
        The distance (m), 0 where they cross; the points and the way between them are written at FOUND.
    """
    one, two = work[FIRST + 14], work[SECOND + 14]
    across = from_one = from_two = 0.0
    for k in range(3):
        u, v = work[FIRST + 5 + 3 * k], work[SECOND + 5 + 3 * k]
        away = work[SECOND + k] - work[FIRST + k]
        across, from_one, from_two = across + u * v, from_one + u * away, from_two + v * away
    first, lean = 0.0, 1.0 - across * across
    if lean != 0.0:
        first = min(max((from_one - from_two * across) / lean, -one), one)
    second = first * across - from_two
    if abs(second) > two:
        second = -two if second < 0.0 else two
        first = min(max(second * across + from_one, -one), one)
    squared = 0.0
    for k in range(3):
        p = work[FIRST + k] + first * work[FIRST + 5 + 3 * k]
        q = work[SECOND + k] + second * work[SECOND + 5 + 3 * k]
        work[FOUND + k], work[FOUND + 3 + k], work[FOUND + 6 + k] = p, q, p - q
        squared += (p - q) ** 2
    return np.sqrt(squared)


def farthest(kind, hulls, first, number, work, core, x, y, z):  # pragma: no cover
    """Return the point of a core that is farthest along a direction, both in the world."""
    if kind == TRIANGLE:
        place, most = core + 3, -1e300
        for k in range(core + 3, core + 12, 3):
            along = x * work[k] + y * work[k + 1] + z * work[k + 2]
            if along > most:
                place, most = k, along
        return work[place], work[place + 1], work[place + 2]
    dx = work[core + 3] * x + work[core + 6] * y + work[core + 9] * z
    dy = work[core + 4] * x + work[core + 7] * y + work[core + 10] * z
    dz = work[core + 5] * x + work[core + 8] * y + work[core + 11] * z
    px, py, pz = farthest_in_core(kind, hulls, first, number, work, core, dx, dy, dz)
    return (
        work[core + 3] * px + work[core + 4] * py + work[core + 5] * pz + work[core],
        work[core + 6] * px + work[core + 7] * py + work[core + 8] * pz + work[core + 1],
        work[core + 9] * px + work[core + 10] * py + work[core + 11] * pz + work[core + 2],
    )


def farthest_in_core(kind, hulls, first, number, work, core, dx, dy, dz):  # pragma: no cover
    """Do what `farthest` does in the frame of a core, which is no triangle."""
    hx, hy, hz = work[core + 12], work[core + 13], work[core + 14]
    if kind == MESH:
        best, most = first, -1e300
        for k in range(first, first + number):
            along = dx * hulls[k, 0] + dy * hulls[k, 1] + dz * hulls[k, 2]
            if along > most:
                best, most = k, along
        return hulls[best, 0], hulls[best, 1], hulls[best, 2]
    if kind == BOX:
        return hx if dx >= 0.0 else -hx, hy if dy >= 0.0 else -hy, hz if dz >= 0.0 else -hz
    if kind == CYLINDER:
        across = np.sqrt(dx * dx + dy * dy)
        px, py = hx, 0.0
        if across != 0.0:
            px, py = dx * (hx / across), dy * (hx / across)
        return px, py, -hz if dz < 0.0 else hz
    if kind == CAPSULE:
        return 0.0, 0.0, hz if dz * hz >= -dz * hz else -hz
    return 0.0, 0.0, 0.0


def nearest_of_simplex(count, flat, work):  # pragma: no cover
    """Find the point of a simplex of differences that is nearest to 0, and leave the corners that it needs.

    Returns:
        The number of corners left; 4 where 0 is inside, -1 where the simplex is flat.
    """
    a, b, c, d = SIMPLEX, SIMPLEX + 9, SIMPLEX + 18, SIMPLEX + 27
    for k in range(4):
        work[SHARES + k] = 0.0
    used = 1
    if count == 1:
        work[SHARES] = 1.0
    elif count == 2:
        used = nearest_on_edge(a, b, work)
    elif count == 3:
        used = nearest_on_face(a, b, c, work)
        for k in range(3):
            work[SHARES + k] = work[PART + k]
    else:
        outside_d, outside_b = beyond(a, b, c, d, flat, work), beyond(a, c, d, b, flat, work)
        outside_c, outside_a = beyond(a, d, b, c, flat, work), beyond(b, d, c, a, flat, work)
        if outside_a < 0 or outside_b < 0 or outside_c < 0 or outside_d < 0:
            return -1
        if outside_a + outside_b + outside_c + outside_d == 0:
            return 4
        least = 1e300
        if outside_d == 1:
            least, used = take_face(0, 1, 2, least, used, work)
        if outside_b == 1:
            least, used = take_face(0, 2, 3, least, used, work)
        if outside_c == 1:
            least, used = take_face(0, 3, 1, least, used, work)
        if outside_a == 1:
            least, used = take_face(1, 3, 2, least, used, work)
    for k in range(3):
        p = q = 0.0
        for n in range(count):
            p += work[SHARES + n] * work[SIMPLEX + 9 * n + 3 + k]
            q += work[SHARES + n] * work[SIMPLEX + 9 * n + 6 + k]
        if count == 2:
            p = work[a + 3 + k] + work[SHARES + 1] * (work[b + 3 + k] - work[a + 3 + k])
            q = work[a + 6 + k] + work[SHARES + 1] * (work[b + 6 + k] - work[a + 6 + k])
        work[FOUND + k], work[FOUND + 3 + k], work[FOUND + 6 + k] = p, q, p - q
    for n in range(count - 1, -1, -1):
        if used & (1 << n) == 0:  # the last corner takes the place of one that is not needed
            count -= 1
            if n != count:
                for k in range(9):
                    work[SIMPLEX + 9 * n + k] = work[SIMPLEX + 9 * count + k]
    return count


def nearest_on_edge(a, b, work):  # pragma: no cover
    """Write the shares of an edge's corners in its point nearest to 0; return the corners used, as bits."""
    along = length = 0.0
    for k in range(3):
        edge = work[b + k] - work[a + k]
        along -= edge * work[a + k]
        length += edge * edge
    share, used = 0.0, 1
    if along > 0.0:
        share, used = (along / length, 3) if along < length else (1.0, 2)
    work[SHARES], work[SHARES + 1] = 1.0 - share, share
    return used


def take_face(i, j, k, least, used, work):  # pragma: no cover
    """Write the shares of corners of a face in its point nearest to 0, if that is nearer than `least`.

    Returns:
        The square of the least distance and the corners used, as bits.
    """
    a, b, c = SIMPLEX + 9 * i, SIMPLEX + 9 * j, SIMPLEX + 9 * k
    part = nearest_on_face(a, b, c, work)
    squared = 0.0
    for n in range(3):
        x = work[a + n] * work[PART] + work[b + n] * work[PART + 1] + work[c + n] * work[PART + 2]
        squared += x * x
    if squared >= least:
        return least, used
    for n in range(4):
        work[SHARES + n] = 0.0
    work[SHARES + i], work[SHARES + j], work[SHARES + k] = work[PART], work[PART + 1], work[PART + 2]
    return squared, ((part & 1) << i) | (((part >> 1) & 1) << j) | ((part >> 2) << k)


def nearest_on_face(a, b, c, work):  # pragma: no cover
    """Write the shares of a triangle's corners in its point nearest to 0; return those used, as bits."""
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for k in range(3):
        u, v = work[b + k] - work[a + k], work[c + k] - work[a + k]
        d1, d2 = d1 - u * work[a + k], d2 - v * work[a + k]
        d3, d4 = d3 - u * work[b + k], d4 - v * work[b + k]
        d5, d6 = d5 - u * work[c + k], d6 - v * work[c + k]
    work[PART] = work[PART + 1] = work[PART + 2] = 0.0
    area_c, area_b, area_a = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
    if d1 <= 0.0 and d2 <= 0.0:
        work[PART] = 1.0
        return 1
    if d3 >= 0.0 and d4 <= d3:
        work[PART + 1] = 1.0
        return 2
    if area_c <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        share = d1 / (d1 - d3)
        work[PART], work[PART + 1] = 1.0 - share, share
        return 3
    if d6 >= 0.0 and d5 <= d6:
        work[PART + 2] = 1.0
        return 4
    if area_b <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        share = d2 / (d2 - d6)
        work[PART], work[PART + 2] = 1.0 - share, share
        return 5
    if area_a <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        share = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        work[PART + 1], work[PART + 2] = 1.0 - share, share
        return 6
    scale = 1.0 / (area_a + area_b + area_c)
    work[PART + 1], work[PART + 2] = area_b * scale, area_c * scale
    work[PART] = 1.0 - work[PART + 1] - work[PART + 2]
    return 7


def beyond(a, b, c, d, flat, work):  # pragma: no cover
    """Return 1 where 0 is on the other side of the face a, b, c than d, else 0; -1 where all is flat."""
    ux, uy, uz = work[b] - work[a], work[b + 1] - work[a + 1], work[b + 2] - work[a + 2]
    vx, vy, vz = work[c] - work[a], work[c + 1] - work[a + 1], work[c + 2] - work[a + 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    here = -(work[a] * nx + work[a + 1] * ny + work[a + 2] * nz)
    there = (work[d] - work[a]) * nx + (work[d + 1] - work[a + 1]) * ny + (work[d + 2] - work[a + 2]) * nz
    if there * there < flat * flat:
        return -1
    return 1 if here * there < 0.0 else 0
