"""How deep two convex shapes are in each other: the shortest way out, by an expanding polytope.

Source:
    G. van den Bergen, Collision Detection in Interactive 3D Environments, 4.3.8: the face of the shapes'
    difference that is nearest to 0 is moved out to the difference's own surface until it is on it.
"""

from __future__ import annotations

import numpy as np

from roboyard.sim.stepping.narrow_phase.closest_points import (
    FIRST,
    FOUND,
    PART,
    SECOND,
    SIMPLEX,
    TRIANGLE,
    farthest,
    nearest_on_face,
)
from roboyard.sim.stepping.narrow_phase.closest_points import WORK as SEARCHED

MOST_CORNERS, MOST_FACES = 96, 400
"""Of the polytope; a search that needs more of them, as of round shapes, ends. For a triangle it takes the
nearest face so far then."""
CORNERS, FACES = SEARCHED, SEARCHED + 9 * MOST_CORNERS
"""Places in the work array: of corners, each a difference and the two points; of faces, each three corners,
the normal, the distance from 0 and 1, or 0 for one that is gone."""
EDGES = FACES + 8 * MOST_FACES
MOST_EDGES = 128
WORK = EDGES + 2 * MOST_EDGES
"""Length of the work array."""
ON_SURFACE = 1e-11
"""Distance (m) from the surface at which a face is on it."""
FLAT = 1e-30
"""Square of the double area (m²) of a face that has no normal."""


def deepest_points(type_a, type_b, hulls, spans, a, b, work):  # pragma: no cover
    """Find the shortest way by which two overlapping cores come apart; return minus its length (m).

    The arguments are those of `closest_points`, which has left a simplex around 0 in the work array. Written
    there are the points of both cores at the ends of the way, and its direction, from the second to the first
    core once they are apart.

    Returns:
        1 where the way was not found.
    """
    for k in range(36):
        work[CORNERS + k] = work[SIMPLEX + k]
    corners, faces = 4, 0
    for k in range(4):
        i, j, m = (k + 1) % 4, (k + 2) % 4, (k + 3) % 4
        x = CORNERS + 9 * i
        nx, ny, nz = normal_of(work, i, j, m)
        inward = nx * (work[CORNERS + 9 * k] - work[x]) + ny * (work[CORNERS + 9 * k + 1] - work[x + 1])
        inward += nz * (work[CORNERS + 9 * k + 2] - work[x + 2])
        if inward > 0.0:
            i, j = j, i
        faces = add_face(work, faces, i, j, m)
        if faces < 0:
            return 1.0
    best = nearest_face(work, faces)
    while best >= 0 and corners < MOST_CORNERS:
        at = FACES + 8 * best
        nx, ny, nz = work[at + 3], work[at + 4], work[at + 5]
        px, py, pz = farthest(type_a, hulls, spans[a, 0], spans[a, 1], work, FIRST, nx, ny, nz)
        qx, qy, qz = farthest(type_b, hulls, spans[b, 0], spans[b, 1], work, SECOND, -nx, -ny, -nz)
        wx, wy, wz = px - qx, py - qy, pz - qz
        if nx * wx + ny * wy + nz * wz - work[at + 6] < ON_SURFACE:
            break
        x = CORNERS + 9 * corners
        work[x], work[x + 1], work[x + 2] = wx, wy, wz
        work[x + 3], work[x + 4], work[x + 5] = px, py, pz
        work[x + 6], work[x + 7], work[x + 8] = qx, qy, qz
        after = move_out(work, faces, corners)
        if after < 0:
            if type_b != TRIANGLE:
                return 1.0
            work[at + 7] = 1.0
            break
        faces = after
        corners += 1
        best = nearest_face(work, faces)
    if best < 0 or (corners == MOST_CORNERS and type_b != TRIANGLE):
        return 1.0
    return write_way(work, faces, best)


def nearest_face(work, faces):  # pragma: no cover
    """Return the face of the polytope that is nearest to 0; -1 where there is none."""
    best = -1
    for f in range(faces):
        at = FACES + 8 * f
        if work[at + 7] > 0.0 and (best < 0 or work[at + 6] < work[FACES + 8 * best + 6]):
            best = f
    return best


def move_out(work, faces, corner):  # pragma: no cover
    """Put a corner in place of the faces that it is beyond; return the number of faces, -1 for no room."""
    x, edges = CORNERS + 9 * corner, 0
    for f in range(faces):
        at = FACES + 8 * f
        over = work[at + 3] * work[x] + work[at + 4] * work[x + 1] + work[at + 5] * work[x + 2] - work[at + 6]
        if work[at + 7] > 0.0 and over > 0.0:
            work[at + 7] = 0.0
            for k in range(3):
                edges = add_edge(work, edges, work[at + k], work[at + (k + 1) % 3])
                if edges < 0:
                    return -1
    for e in range(edges):
        faces = add_face(work, faces, int(work[EDGES + 2 * e]), int(work[EDGES + 2 * e + 1]), corner)
        if faces < 0:
            return -1
    return faces


def write_way(work, faces, best):  # pragma: no cover
    """Write the way through the nearest face of the polytope at FOUND; return minus its length (m).

    Of the triangles in the plane of that face, the one that has the foot of 0 on it gives the points.
    """
    depth = work[FACES + 8 * best + 6]
    nx, ny, nz = work[FACES + 8 * best + 3], work[FACES + 8 * best + 4], work[FACES + 8 * best + 5]
    work[FOUND + 6], work[FOUND + 7], work[FOUND + 8] = -nx, -ny, -nz
    least = 1e300
    for f in range(faces):
        face = FACES + 8 * f
        if work[face + 7] == 0.0 or work[face + 6] > depth + ON_SURFACE:
            continue
        for n in range(3):
            corner = CORNERS + 9 * int(work[face + n])
            work[SIMPLEX + 9 * n] = work[corner] - depth * nx
            work[SIMPLEX + 9 * n + 1] = work[corner + 1] - depth * ny
            work[SIMPLEX + 9 * n + 2] = work[corner + 2] - depth * nz
        nearest_on_face(SIMPLEX, SIMPLEX + 9, SIMPLEX + 18, work)
        away = 0.0
        for k in range(3):
            x = 0.0
            for n in range(3):
                x += work[PART + n] * work[SIMPLEX + 9 * n + k]
            away += x * x
        if away >= least:
            continue
        least = away
        for k in range(3):
            p = q = 0.0
            for n in range(3):
                corner = CORNERS + 9 * int(work[face + n])
                p += work[PART + n] * work[corner + 3 + k]
                q += work[PART + n] * work[corner + 6 + k]
            work[FOUND + k], work[FOUND + 3 + k] = p, q
    return -depth


def normal_of(work, i, j, m):  # pragma: no cover
    """Return the normal of three corners, as long as twice their area."""
    a, b, c = CORNERS + 9 * i, CORNERS + 9 * j, CORNERS + 9 * m
    ux, uy, uz = work[b] - work[a], work[b + 1] - work[a + 1], work[b + 2] - work[a + 2]
    vx, vy, vz = work[c] - work[a], work[c + 1] - work[a + 1], work[c + 2] - work[a + 2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


def add_face(work, faces, i, j, m):  # pragma: no cover
    """Add a face with corners in this order, seen from outside; return their number, -1 where it is none."""
    if faces >= MOST_FACES:
        return -1
    nx, ny, nz = normal_of(work, i, j, m)
    squared = nx * nx + ny * ny + nz * nz
    if squared < FLAT:
        return -1
    length = np.sqrt(squared)
    at, a = FACES + 8 * faces, CORNERS + 9 * i
    work[at], work[at + 1], work[at + 2] = i, j, m
    work[at + 3], work[at + 4], work[at + 5] = nx / length, ny / length, nz / length
    work[at + 6] = (nx * work[a] + ny * work[a + 1] + nz * work[a + 2]) / length
    work[at + 7] = 1.0
    return faces + 1


def add_edge(work, edges, one, two):  # pragma: no cover
    """List an edge, or remove it where the other face at it has gone, too; return how many there are."""
    for e in range(edges):
        if work[EDGES + 2 * e] == two and work[EDGES + 2 * e + 1] == one:
            work[EDGES + 2 * e], work[EDGES + 2 * e + 1] = (
                work[EDGES + 2 * edges - 2],
                work[EDGES + 2 * edges - 1],
            )
            return edges - 1
    if edges >= MOST_EDGES:
        return -1
    work[EDGES + 2 * edges], work[EDGES + 2 * edges + 1] = one, two
    return edges + 1
