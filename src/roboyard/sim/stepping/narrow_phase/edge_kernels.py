"""Compiled loops that move contacts to where an impulse engine finds them: shapes with round edges."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.sim.stepping.face_corners import in_world
from roboyard.sim.stepping.impulses.slide_directions import comes_second
from roboyard.sim.stepping.narrow_phase.closest_points import (
    FAR,
    FIRST,
    FLAT,
    FOUND,
    SECOND,
    closest_of_segments,
    closest_points,
    farthest,
)  # fmt: skip
from roboyard.sim.stepping.narrow_phase.polytope import deepest_in_turn
from roboyard.sim.stepping.step_row_kernels import CONTACTS

PLANE, FIELD, SPHERE, CAPSULE, CYLINDER, BOX, MESH = 0, 1, 2, 3, 5, 6, 7
"""MuJoCo's types of these geoms."""
AWAY = 1.0
"""Distance (m) of contacts that do not count."""
UNMOVED = 1e-14
"""Square of the shift (m) below which rows are not made again."""
ALONG = 0.99
"""Cosine of the angle between a contact's normal and a face's that is the contact's."""
WIDE = 0.5
"""Half size (m) of a face from which on the search ends within 1e-8 m of it; before, it may end early."""
LEVEL = 1e-12
"""Distance (m) up to which corners are as deep as each other."""
UNTURNED = 1e-16
"""Square of the turn (rad) below which they are not."""


@compiled(
    CONTACTS,
    "i8 i4[::1] i4[::1] f8[:,:] f8[:,:] f8[:,:,::1] f8[::1] f8[:,::1] i4[:,::1] u1[::1] i4[::1] f8[::1] i8"
    " f8[::1] -> i8",
)
def place_contacts(  # pragma: no cover
    contacts, contact_count, geom_type, geom_body, xpos, xmat, boxes, rounding, hulls, spans, compound, ages,
    margins, keeps, work,
):  # fmt: skip
    """Move contacts to where the shapes are closest whose edges are round; return 1 if any moved.

    An impulse engine's shapes are cores with a ball at each point. Where the cores of a pair are apart, its
    contact is where these are closest, and there is one. Otherwise the contact of the sharp shapes is moved
    as far as their edges are round. Two boxes, and what meets a plane or a height field, stay.

    boxes: (ngeom, 4, 3) middles of the shapes and their half axes in the frames of the bodies (m). rounding:
    (ngeom,) radii of the balls (m), 0 for other shapes. hulls, spans: as of `closest_points`. compound,
    ages: as of `comes_second`. margins: (ngeom,) widths (m) by which surfaces
    lie outside the shapes. keeps: 1 where pairs keep their points, and one is found in a step. work:
    array to work in.
    """
    position, frame, dist = contacts.position, contacts.frame, contacts.dist
    moved = 0
    i = 0
    while i < contact_count:
        a, b = contacts.geom[i, 0], contacts.geom[i, 1]
        first = i
        while i < contact_count and contacts.geom[i, 0] == a and contacts.geom[i, 1] == b:
            i += 1
        if a < 0 or b < 0 or (geom_type[a] == BOX and geom_type[b] == BOX):
            continue
        if geom_type[a] <= FIELD or geom_type[b] <= FIELD:
            if geom_type[a] == PLANE and geom_type[b] == MESH:
                for k in range(first, i):
                    place_corner(position, frame, dist, k, hulls, spans, b, geom_body[b], xpos, xmat)
                if keeps == 1 and spans[b, 1] > 0:
                    write_core(geom_type, geom_body, xpos, xmat, boxes, rounding, b, work, FIRST)
                    put_lowest_first(position, frame, dist, first, i, hulls, spans, b, work)
            elif geom_type[a] == PLANE and has_core(geom_type, rounding, spans, b):
                if keeps == 0 or geom_type[b] == BOX:  # whose corners are sharp there
                    continue
                write_core(geom_type, geom_body, xpos, xmat, boxes, rounding, b, work, FIRST)
                if place_lowest(position, frame, dist, first, geom_type[b], hulls, spans, b, work):
                    moved = 1
                for k in range(first + 1, i):
                    dist[k] = AWAY
            continue
        if keeps == 1 or i == first + 1:
            one, two = a, b
            if comes_second(geom_type, compound, ages, a, b):
                one, two = b, a
            apart, is_known = -1.0, False
            if has_core(geom_type, rounding, spans, a) and has_core(geom_type, rounding, spans, b):
                write_core(geom_type, geom_body, xpos, xmat, boxes, rounding, one, work, FIRST)
                write_core(geom_type, geom_body, xpos, xmat, boxes, rounding, two, work, SECOND)
                if max(geom_type[a], geom_type[b]) > CAPSULE:
                    apart, is_known = find_points(
                        frame, first, geom_type, hulls, spans, margins, one, two, work
                    )  # fmt: skip
                elif max(geom_type[a], geom_type[b]) == CAPSULE:
                    apart = closest_of_segments(work)
                    is_known = apart > 0.0
            if is_known:
                if write_contact(position, frame, dist, first, 1.0 if one == b else -1.0, apart, work):
                    moved = 1
                for k in range(first + 1, i):
                    dist[k] = AWAY
                continue
        for k in range(first, i):
            if round_edge(contacts, k, geom_type, geom_body, xpos, xmat, boxes, rounding):
                moved = 1
    return moved


def find_points(frame, i, geom_type, hulls, spans, margins, one, two, work):
    """Find the points at which two cores are closest, or deepest in each other; i is their contact.

    Returns:
        The distance (m), negative where they overlap, and whether it is known; the points are at FOUND.
    """
    kind, other = geom_type[one], geom_type[two]
    if kind == BOX and other == MESH:
        apart, is_known = corner_in_face(frame, i, other, hulls, spans, two, FIRST, SECOND, WIDE, work)
        if is_known:
            return apart, True
    elif kind == MESH and other == BOX:
        apart, is_known = corner_in_face(frame, i, kind, hulls, spans, one, SECOND, FIRST, WIDE, work)
        if is_known:
            return apart, True
    elif (kind == BOX and other == SPHERE) or (kind == SPHERE and other == BOX):
        return ball_and_box(FIRST if kind == BOX else SECOND, work), True
    apart = closest_points(kind, other, hulls, spans, one, two, FLAT, FAR, work)
    if apart > 0.0:
        return apart, True
    is_known = False
    if kind == BOX:
        apart, is_known = corner_in_face(frame, i, other, hulls, spans, two, FIRST, SECOND, 0.0, work)
    elif other == BOX:
        apart, is_known = corner_in_face(frame, i, kind, hulls, spans, one, SECOND, FIRST, 0.0, work)
    if is_known:
        return apart, True
    shapes = (
        int(kind),
        int(other),
        int(spans[one, 0]),
        int(spans[one, 1]),
        int(spans[two, 0]),
        int(spans[two, 1]),
    )
    is_known, apart = deepest_in_turn(
        shapes, hulls, (ball_radius(margins, one, FIRST, work), ball_radius(margins, two, SECOND, work)), work
    )
    return apart, is_known


def ball_radius(margins, geom, core, work):
    """Return the radius of the balls at the points of a core, which is a hull's margin."""
    return work[core + 15] + max(margins[geom], 0.0)


def ball_and_box(box, work):
    """Find the point of a box's core that is closest to a ball's centre; return its distance (m).

    Where the centre is inside, the point is on the nearest face and the distance is negative.
    """
    ball = SECOND if box == FIRST else FIRST
    own, other, sign = (0, 3, 1.0) if box == FIRST else (3, 0, -1.0)
    x, y, z = work[ball] - work[box], work[ball + 1] - work[box + 1], work[ball + 2] - work[box + 2]
    for k in range(3):
        work[FOUND + own + k], work[FOUND + other + k] = work[box + k], work[ball + k]
    axis, side, least = 0, 1.0, 1e300
    for k in range(3):
        u, v, w = work[box + 3 + k], work[box + 6 + k], work[box + 9 + k]
        along, half = u * x + v * y + w * z, work[box + 12 + k]
        if half - abs(along) < least:
            axis, side, least = k, -1.0 if along < 0.0 else 1.0, half - abs(along)
        along = min(max(along, -half), half)
        work[FOUND + own] += along * u
        work[FOUND + own + 1] += along * v
        work[FOUND + own + 2] += along * w
    if least >= 0.0:
        for k in range(3):
            n = side * work[box + 3 + 3 * k + axis]
            work[FOUND + own + k] = work[ball + k] + least * n
            work[FOUND + 6 + k] = -sign * n
        return -least
    squared = 0.0
    for k in range(3):
        way = work[FOUND + own + k] - work[FOUND + other + k]
        work[FOUND + 6 + k] = sign * way
        squared += way * way
    return np.sqrt(squared)


def has_core(geom_type, rounding, spans, geom):
    """Return whether the core of a shape is known."""
    kind = geom_type[geom]
    if kind == MESH:
        return spans[geom, 1] > 0
    if kind in (BOX, CYLINDER):
        return rounding[geom] > 0.0
    return kind in (SPHERE, CAPSULE)


def write_core(geom_type, geom_body, xpos, xmat, boxes, rounding, geom, work, core):
    """Write place, axes and half sizes of a shape's core, and the radius of its balls."""
    body = geom_body[geom]
    if geom_type[geom] == MESH:  # its corners are known in the frame of the body
        for k in range(3):
            work[core + k] = xpos[body, k]
        for k in range(9):
            work[core + 3 + k] = xmat[body, k]
        work[core + 15] = 0.0
        return
    x, y, z = in_world(boxes, geom, 0, xmat, body)
    work[core], work[core + 1], work[core + 2] = x + xpos[body, 0], y + xpos[body, 1], z + xpos[body, 2]
    for k in range(3):
        x, y, z = in_world(boxes, geom, 1 + k, xmat, body)
        half = np.sqrt(x * x + y * y + z * z)
        work[core + 3 + k], work[core + 6 + k], work[core + 9 + k] = x / half, y / half, z / half
        work[core + 12 + k] = half
    radius = rounding[geom]
    if geom_type[geom] <= CAPSULE:
        radius = work[core + 12]
    work[core + 15] = radius
    for k in range(3):
        work[core + 12 + k] -= radius


def place_corner(position, frame, dist, i, hulls, spans, geom, body, xpos, xmat):
    """Move a contact of a plane with a hull to the hull's corner itself, which MuJoCo rounds."""
    if spans[geom, 1] == 0:
        return
    half = 0.5 * dist[i]
    nearest, least = 0, 1e300
    for k in range(spans[geom, 0], spans[geom, 0] + spans[geom, 1]):
        apart = 0.0
        for d in range(3):
            x = xpos[body, d] - position[i, d] - half * frame[i, d]
            for j in range(3):
                x += xmat[body, 3 * d + j] * hulls[k, j]
            apart += x * x
        if apart < least:
            nearest, least = k, apart
    along = 0.0
    for d in range(3):
        x = xpos[body, d] - position[i, d] - half * frame[i, d]
        for j in range(3):
            x += xmat[body, 3 * d + j] * hulls[nearest, j]
        along += x * frame[i, d]
        position[i, d] += x
    dist[i] += along
    for d in range(3):
        position[i, d] -= 0.5 * along * frame[i, d]


def put_lowest_first(position, frame, dist, first, end, hulls, spans, geom, work):
    """Let the first contact of a plane with a hull at FIRST be at the hull's lowest corner.

    Of corners that are as low, it is the first. Where it has no contact yet, it takes the last one's place.
    """
    nx, ny, nz = frame[first, 0], frame[first, 1], frame[first, 2]
    x, y, z = farthest(MESH, hulls, spans[geom, 0], spans[geom, 1], work, FIRST, -nx, -ny, -nz)
    half = 0.5 * dist[first]
    apart = (
        nx * (x - position[first, 0]) + ny * (y - position[first, 1]) + nz * (z - position[first, 2]) + half
    )
    x, y, z = x - 0.5 * apart * nx, y - 0.5 * apart * ny, z - 0.5 * apart * nz
    place = end - 1
    for k in range(first, end):
        if (position[k, 0] - x) ** 2 + (position[k, 1] - y) ** 2 + (position[k, 2] - z) ** 2 < UNMOVED:
            place = k
            break
    for d in range(3):
        position[place, d] = position[first, d]
    dist[place] = dist[first]
    position[first, 0], position[first, 1], position[first, 2], dist[first] = x, y, z, apart


def place_lowest(position, frame, dist, i, kind, hulls, spans, geom, work):
    """Move a contact of a plane with a core at FIRST to the core's lowest point; return whether it moved."""
    nx, ny, nz = frame[i, 0], frame[i, 1], frame[i, 2]
    x, y, z = farthest(kind, hulls, spans[geom, 0], spans[geom, 1], work, FIRST, -nx, -ny, -nz)
    half = 0.5 * dist[i]
    apart = nx * (x - position[i, 0]) + ny * (y - position[i, 1]) + nz * (z - position[i, 2]) + half
    dist[i] = apart - work[FIRST + 15]
    shift = work[FIRST + 15] + 0.5 * dist[i]
    x, y, z = x - shift * nx, y - shift * ny, z - shift * nz
    moved = (x - position[i, 0]) ** 2 + (y - position[i, 1]) ** 2 + (z - position[i, 2]) ** 2 > UNMOVED
    position[i, 0], position[i, 1], position[i, 2] = x, y, z
    return moved


def corner_in_face(frame, i, kind, hulls, spans, geom, box, hull, wide, work):
    """Find the one point of a shape that is nearest to the face of a box which contact i is normal to.

    With that point at a depth under the face and as far away from the others, all other directions need a
    longer way out of the box. geom: the shape. box, hull: places of their cores in the work array. wide: half
    size (m) that the face has at least, and the point may be over it, too; 0: only under it.

    Returns:
        The distance (m), and whether there is such a point; if so the points are written at FOUND.
    """
    axis, most = 0, 0.0
    for k in range(3):
        along = 0.0
        for d in range(3):
            along += frame[i, d] * work[box + 3 + 3 * d + k]
        if abs(along) > abs(most):
            axis, most = k, along
    if abs(most) < ALONG:
        return -1.0, False
    nx, ny, nz = work[box + 3 + axis], work[box + 6 + axis], work[box + 9 + axis]
    x, y, z = work[hull] - work[box], work[hull + 1] - work[box + 1], work[hull + 2] - work[box + 2]
    if nx * x + ny * y + nz * z < 0.0:
        nx, ny, nz = -nx, -ny, -nz
    dx = nx * work[hull + 3] + ny * work[hull + 6] + nz * work[hull + 9]
    dy = nx * work[hull + 4] + ny * work[hull + 7] + nz * work[hull + 10]
    dz = nx * work[hull + 5] + ny * work[hull + 8] + nz * work[hull + 11]
    first, number = spans[geom, 0], spans[geom, 1]
    if kind == MESH:
        least = following = 1e300
        corner = first
        for k in range(first, first + number):
            height = dx * hulls[k, 0] + dy * hulls[k, 1] + dz * hulls[k, 2]
            if height < following:
                if height < least:
                    following, least, corner = least, height, k
                else:
                    following = height
        if following - least < LEVEL:
            return -1.0, False
        first, number = corner, 1
    elif (kind in (CYLINDER, CAPSULE) and abs(dz) < LEVEL) or (
        kind == CYLINDER and dx * dx + dy * dy < LEVEL * LEVEL
    ):
        return -1.0, False  # an edge or a face of it is along the face
    x, y, z = farthest(kind, hulls, first, number, work, hull, -nx, -ny, -nz)
    x, y, z = x - work[box], y - work[box + 1], z - work[box + 2]
    apart = nx * x + ny * y + nz * z - work[box + 12 + axis]
    if apart > 0.0 and wide == 0.0:
        return -1.0, False
    for k in range(3):
        along = work[box + 3 + k] * x + work[box + 6 + k] * y + work[box + 9 + k] * z
        if k != axis and (work[box + 12 + k] - abs(along) < max(-apart, 0.0) or work[box + 12 + k] < wide):
            return -1.0, False
    if -apart > work[box + 12 + axis]:
        return -1.0, False
    x, y, z = x + work[box], y + work[box + 1], z + work[box + 2]
    own, other, sign = (0, 3, 1.0) if hull == FIRST else (3, 0, -1.0)
    work[FOUND + own], work[FOUND + own + 1], work[FOUND + own + 2] = x, y, z
    work[FOUND + other], work[FOUND + other + 1] = x - apart * nx, y - apart * ny
    work[FOUND + other + 2] = z - apart * nz
    work[FOUND + 6], work[FOUND + 7], work[FOUND + 8] = sign * nx, sign * ny, sign * nz
    return apart, True


def write_contact(position, frame, dist, i, sign, apart, work):
    """Write a contact between the closest points of two cores; return whether it differs from before.

    sign: 1 where the contact's normal points to the first core, -1 where to the second.
    """
    scale = sign / np.sqrt(work[FOUND + 6] ** 2 + work[FOUND + 7] ** 2 + work[FOUND + 8] ** 2)
    one, two = work[FIRST + 15], work[SECOND + 15]
    shift = turn = along = 0.0
    for k in range(3):
        n = scale * work[FOUND + 6 + k]
        x = 0.5 * (work[FOUND + k] + work[FOUND + 3 + k] + sign * (two - one) * n)
        shift += (position[i, k] - x) ** 2
        turn += (frame[i, k] - n) ** 2
        position[i, k], frame[i, k] = x, n
        along += n * frame[i, 3 + k]
    dist[i] = apart - one - two
    if shift < UNMOVED and turn < UNTURNED:
        return False
    length = 0.0
    for k in range(3):
        frame[i, 3 + k] -= along * frame[i, k]
        length += frame[i, 3 + k] ** 2
    if length < 0.5:  # the normal has turned towards the tangent: another tangent
        axis = 0
        for k in range(1, 3):
            if abs(frame[i, k]) < abs(frame[i, axis]):
                axis = k
        length = 0.0
        for k in range(3):
            frame[i, 3 + k] = (1.0 if k == axis else 0.0) - frame[i, axis] * frame[i, k]
            length += frame[i, 3 + k] ** 2
    length = np.sqrt(length)
    for k in range(3):
        frame[i, 3 + k] /= length
    frame[i, 6] = frame[i, 1] * frame[i, 5] - frame[i, 2] * frame[i, 4]
    frame[i, 7] = frame[i, 2] * frame[i, 3] - frame[i, 0] * frame[i, 5]
    frame[i, 8] = frame[i, 0] * frame[i, 4] - frame[i, 1] * frame[i, 3]
    return True


def round_edge(contacts, i, geom_type, geom_body, xpos, xmat, boxes, rounding):
    """Move a contact of sharp shapes as far as their edges are round; return whether it moved."""
    position, frame, dist = contacts.position, contacts.frame, contacts.dist
    moved = False
    for side in range(2):
        geom = contacts.geom[i, side]
        radius = rounding[geom]
        if radius <= 0.0:
            continue
        sign = 1.0 if side == 0 else -1.0
        nx, ny, nz = sign * frame[i, 0], sign * frame[i, 1], sign * frame[i, 2]
        body = geom_body[geom]
        px = position[i, 0] - 0.5 * dist[i] * nx
        py = position[i, 1] - 0.5 * dist[i] * ny
        pz = position[i, 2] - 0.5 * dist[i] * nz
        cx, cy, cz = in_world(boxes, geom, 0, xmat, body)
        rx, ry, rz = px - xpos[body, 0] - cx, py - xpos[body, 1] - cy, pz - xpos[body, 2] - cz
        ex = ey = ez = 0.0  # from the smaller shape to the point
        for axis in range(1, 4):
            x, y, z = in_world(boxes, geom, axis, xmat, body)
            half = np.sqrt(x * x + y * y + z * z)
            along = (rx * x + ry * y + rz * z) / half
            if geom_type[geom] == BOX or axis == 3:
                excess = along - min(max(along, radius - half), half - radius)
                ex, ey, ez = ex + excess * x / half, ey + excess * y / half, ez + excess * z / half
                if geom_type[geom] == CYLINDER:
                    x, y, z = rx - along * x / half, ry - along * y / half, rz - along * z / half
                    far = np.sqrt(x * x + y * y + z * z)
                    fx, fy, fz = in_world(boxes, geom, 1, xmat, body)
                    most = np.sqrt(fx * fx + fy * fy + fz * fz) - radius
                    if far > most:
                        share = 1.0 - most / far
                        ex, ey, ez = ex + share * x, ey + share * y, ez + share * z
        beyond = ex * nx + ey * ny + ez * nz
        if beyond < 0.5 * radius:
            continue
        dx, dy, dz = radius * nx - ex, radius * ny - ey, radius * nz - ez
        if dx * dx + dy * dy + dz * dz < UNMOVED:
            continue
        moved = True
        dist[i] += beyond - radius
        position[i, 0] = px + dx + 0.5 * dist[i] * nx
        position[i, 1] = py + dy + 0.5 * dist[i] * ny
        position[i, 2] = pz + dz + 0.5 * dist[i] * nz
    return moved
