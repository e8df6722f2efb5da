"""Points of shapes on the triangles of height fields and meshes, found as an impulse engine does.

Bullet adds the closest points of each triangle near a shape to those that the pair keeps. Triangles have two
sides and no thickness.
"""

from __future__ import annotations

import numpy as np

from roboyard.native import record
from roboyard.sim.stepping.face_corners import in_world
from roboyard.sim.stepping.narrow_phase.closest_points import (
    AROUND,
    BOX,
    CAPSULE,
    CYLINDER,
    FIRST,
    FLAT,
    FOUND,
    MESH,
    SECOND,
    SPHERE,
    TRIANGLE,
    closest_points,
)  # fmt: skip
from roboyard.sim.stepping.narrow_phase.deepest_points import WORK as SEARCHED
from roboyard.sim.stepping.narrow_phase.deepest_points import deepest_points
from roboyard.sim.stepping.narrow_phase.fields import Fields

FIELD = 1
"""MuJoCo's type of height fields."""
ENDLESS = 1e8
"""Half size (m) from which on a box is that of a shape of which nothing is known."""
TINY = 2.220446049250313e-16
BOUNDS, AXES, POINT, CURSOR = SEARCHED, SEARCHED + 6, SEARCHED + 18, SEARCHED + 34
"""Places in the work array: of the shape's box in the frame of the field; of the middle and half axes of the
box around it; of a new point, as `keep_points` writes it; of the search of `field_triangles`."""
WORK = CURSOR + 8
"""Length of the work array."""


FIELDS = record(
    Fields,
    "f8[:,::1] f8[:,::1] i4[::1] f8[:,::1] i4[::1] i4[::1] i4[::1] f4[::1]"
    " i4[::1] i4[:,::1] f8[:,::1] i4[::1] f8[:,::1] f8[::1]",
)


def is_searched(fields, geom_type, boxes, spans, a, b):  # pragma: no cover
    """Return whether geom a is a height field, and the form of geom b is known."""
    if geom_type[a] != FIELD or boxes.shape[0] == 0 or fields.heights.shape[0] == 0:
        return False
    kind = geom_type[b]
    if kind == MESH:
        return spans[b, 1] > 0
    if kind != SPHERE and kind != CAPSULE and kind != CYLINDER and kind != BOX:
        return False
    return abs(boxes[b, 1, 0]) + abs(boxes[b, 1, 1]) + abs(boxes[b, 1, 2]) < ENDLESS


def write_bounds(fields, field, geom_type, body, xpos, xmat, boxes, shape, work):  # pragma: no cover
    """Write a shape's box in the world at AXES, and the one along the field's axes at BOUNDS."""
    for axis in range(4):
        x, y, z = in_world(boxes, shape, axis, xmat, body)
        work[AXES + 3 * axis], work[AXES + 3 * axis + 1], work[AXES + 3 * axis + 2] = x, y, z
    for k in range(3):
        work[AXES + k] += xpos[body, k]
    radius = 0.0
    for k in range(3):
        radius += work[AXES + 3 + k] ** 2
    radius = np.sqrt(radius)
    for d in range(3):
        middle = half = 0.0
        for k in range(3):
            middle += fields.turns[field, 3 * k + d] * (work[AXES + k] - fields.places[field, k])
        for axis in range(1, 4):
            along = 0.0
            for k in range(3):
                along += fields.turns[field, 3 * k + d] * work[AXES + 3 * axis + k]
            half += abs(along)
        if geom_type[shape] == SPHERE:
            half = radius
        work[BOUNDS + d], work[BOUNDS + 3 + d] = middle - half, middle + half


def is_beyond(work, radius, reach):  # pragma: no cover
    """Return whether the shape in the box at AXES is known to be farther than `reach` (m) from a triangle.

    The triangle is at SECOND. Looked at are the ball around the middle of the box that the shape is in, with
    a radius (m), and the box along its axes and along the triangle's normal.
    """
    t = SECOND + 3
    ux, uy, uz = work[t + 3] - work[t], work[t + 4] - work[t + 1], work[t + 5] - work[t + 2]
    vx, vy, vz = work[t + 6] - work[t], work[t + 7] - work[t + 1], work[t + 8] - work[t + 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    x, y, z = work[AXES] - work[t], work[AXES + 1] - work[t + 1], work[AXES + 2] - work[t + 2]
    half = 0.0
    for axis in range(3, 12, 3):
        half += abs(nx * work[AXES + axis] + ny * work[AXES + axis + 1] + nz * work[AXES + axis + 2])
    squared = nx * nx + ny * ny + nz * nz
    length = np.sqrt(squared)
    over = nx * x + ny * y + nz * z
    if abs(over) > min(half, radius * length) + reach * length:
        return True
    for axis in range(3, 12, 3):
        ax, ay, az = work[AXES + axis], work[AXES + axis + 1], work[AXES + axis + 2]
        own = ax * ax + ay * ay + az * az
        first = ax * x + ay * y + az * z
        second = first - (ax * ux + ay * uy + az * uz)
        third = first - (ax * vx + ay * vy + az * vz)
        least, most = min(first, second, third), max(first, second, third)
        apart = own + reach * np.sqrt(own)
        if least > apart or most < -apart:
            return True
    if squared > 0.0:  # how far beyond each edge the middle is, in the triangle's plane
        left = (radius + reach) * (radius + reach) - over * over / squared
        for k in range(3):
            i, j = t + 3 * k, t + 3 * ((k + 1) % 3)
            ex, ey, ez = work[j] - work[i], work[j + 1] - work[i + 1], work[j + 2] - work[i + 2]
            sx, sy, sz = ey * nz - ez * ny, ez * nx - ex * nz, ex * ny - ey * nx
            x, y, z = work[AXES] - work[i], work[AXES + 1] - work[i + 1], work[AXES + 2] - work[i + 2]
            side = sx * x + sy * y + sz * z
            if side > 0.0 and side * side > left * (sx * sx + sy * sy + sz * sz):
                return True
    return False


def radius_around(kind, shape, hulls, spans, work):  # pragma: no cover
    """Return the radius (m) of a ball around the middle of the box at AXES that a shape is in.

    The core of the shape is at FIRST.
    """
    first = last = squared = 0.0
    for k in range(3):
        first += work[AXES + 3 + k] ** 2
        squared += work[AXES + 6 + k] ** 2
        last += work[AXES + 9 + k] ** 2
    if kind in (SPHERE, CAPSULE):  # the third axis is the length
        return np.sqrt(last)
    if kind == CYLINDER:
        return np.sqrt(first + last)
    squared += first + last
    if kind == BOX:
        return np.sqrt(squared)
    x, y, z = work[AXES] - work[FIRST], work[AXES + 1] - work[FIRST + 1], work[AXES + 2] - work[FIRST + 2]
    px = work[FIRST + 3] * x + work[FIRST + 6] * y + work[FIRST + 9] * z
    py = work[FIRST + 4] * x + work[FIRST + 7] * y + work[FIRST + 10] * z
    pz = work[FIRST + 5] * x + work[FIRST + 8] * y + work[FIRST + 11] * z
    most = 0.0
    for k in range(spans[shape, 0], spans[shape, 0] + spans[shape, 1]):
        x, y, z = hulls[k, 0] - px, hulls[k, 1] - py, hulls[k, 2] - pz
        most = max(most, x * x + y * y + z * z)
    return np.sqrt(min(squared, most))


def on_triangle(kind, shape, field, hulls, spans, reach, work):  # pragma: no cover
    """Find the closest points of the core at FIRST and the triangle at SECOND, within `reach` (m).

    Returns:
        The distance (m), negative where they overlap, and whether it is known; the points are at FOUND.
    """
    if kind == SPHERE:
        return ball_on_triangle(reach, work)
    apart = closest_points(kind, TRIANGLE, hulls, spans, shape, field, FLAT, reach, work)
    if apart > 0.0:
        return apart, True
    if apart != AROUND:
        apart = closest_points(kind, TRIANGLE, hulls, spans, shape, field, 0.0, reach, work)
    if apart == AROUND:
        apart = deepest_points(kind, TRIANGLE, hulls, spans, shape, field, work)
        return apart, apart <= 0.0
    return apart, apart > 0.0


def ball_on_triangle(reach, work):  # pragma: no cover
    """Do what `on_triangle` does for a ball's centre at FIRST.

    Where the centre is over the triangle, its foot there is the closest point, else the closest one of the
    edges, of which the first of several is taken.
    """
    t = SECOND + 3
    ux, uy, uz = work[t + 3] - work[t], work[t + 4] - work[t + 1], work[t + 5] - work[t + 2]
    vx, vy, vz = work[t + 6] - work[t], work[t + 7] - work[t + 1], work[t + 8] - work[t + 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if length < TINY:
        return -1.0, False
    nx, ny, nz = nx / length, ny / length, nz / length
    px, py, pz = work[FIRST], work[FIRST + 1], work[FIRST + 2]
    over = nx * (px - work[t]) + ny * (py - work[t + 1]) + nz * (pz - work[t + 2])
    if over < 0.0:
        over, nx, ny, nz = -over, -nx, -ny, -nz
    if over >= reach:
        return -1.0, False
    left = right = 0
    for k in range(3):
        i, j = t + 3 * k, t + 3 * ((k + 1) % 3)
        ex, ey, ez = work[j] - work[i], work[j + 1] - work[i + 1], work[j + 2] - work[i + 2]
        side = (ey * nz - ez * ny) * (px - work[i]) + (ez * nx - ex * nz) * (py - work[i + 1])
        side += (ex * ny - ey * nx) * (pz - work[i + 2])
        if side > 0.0:
            right += 1
        else:
            left += 1
    qx, qy, qz = px - over * nx, py - over * ny, pz - over * nz
    if left > 0 and right > 0:
        least = reach * reach
        is_near = False
        for k in range(3):
            i, j = t + 3 * k, t + 3 * ((k + 1) % 3)
            ex, ey, ez = work[j] - work[i], work[j + 1] - work[i + 1], work[j + 2] - work[i + 2]
            dx, dy, dz = px - work[i], py - work[i + 1], pz - work[i + 2]
            share = ex * dx + ey * dy + ez * dz
            squared = ex * ex + ey * ey + ez * ez
            share = 0.0 if share <= 0.0 else share / squared if share < squared else 1.0
            dx, dy, dz = dx - share * ex, dy - share * ey, dz - share * ez
            far = dx * dx + dy * dy + dz * dz
            if far < least:
                least, is_near = far, True
                qx, qy, qz = work[i] + share * ex, work[i + 1] + share * ey, work[i + 2] + share * ez
        if not is_near:
            return -1.0, False
    dx, dy, dz = px - qx, py - qy, pz - qz
    squared = dx * dx + dy * dy + dz * dz
    work[FOUND], work[FOUND + 1], work[FOUND + 2] = px, py, pz
    work[FOUND + 3], work[FOUND + 4], work[FOUND + 5] = qx, qy, qz
    if squared <= TINY:
        work[FOUND + 6], work[FOUND + 7], work[FOUND + 8] = nx, ny, nz
        return 0.0, True
    work[FOUND + 6], work[FOUND + 7], work[FOUND + 8] = dx, dy, dz
    return np.sqrt(squared), True


def write_point(xpos, xmat, one, two, widths, work):  # pragma: no cover
    """Write the points at FOUND at POINT, in the frames of the bodies of field and shape, and their frame.

    widths: by which the surfaces of field and shape lie outside MuJoCo's (m).
    """
    nx, ny, nz = work[FOUND + 6], work[FOUND + 7], work[FOUND + 8]
    scale = 1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = scale * nx, scale * ny, scale * nz
    below, above = widths[0] + work[SECOND + 15], widths[1] + work[FIRST + 15]
    x = work[FOUND + 3] + below * nx - xpos[one, 0]
    y = work[FOUND + 4] + below * ny - xpos[one, 1]
    z = work[FOUND + 5] + below * nz - xpos[one, 2]
    u = work[FOUND] - above * nx - xpos[two, 0]
    v = work[FOUND + 1] - above * ny - xpos[two, 1]
    w = work[FOUND + 2] - above * nz - xpos[two, 2]
    for k in range(3):
        work[POINT + k] = xmat[one, k] * x + xmat[one, 3 + k] * y + xmat[one, 6 + k] * z
        work[POINT + 3 + k] = xmat[two, k] * u + xmat[two, 3 + k] * v + xmat[two, 6 + k] * w
    # the tangents are those that MuJoCo gives to a normal
    tx, ty, tz = (0.0, 1.0, 0.0) if abs(ny) < 0.5 else (0.0, 0.0, 1.0)
    along = nx * tx + ny * ty + nz * tz
    tx, ty, tz = tx - along * nx, ty - along * ny, tz - along * nz
    scale = 1.0 / np.sqrt(tx * tx + ty * ty + tz * tz)
    tx, ty, tz = scale * tx, scale * ty, scale * tz
    work[POINT + 6], work[POINT + 7], work[POINT + 8] = nx, ny, nz
    work[POINT + 9], work[POINT + 10], work[POINT + 11] = tx, ty, tz
    work[POINT + 12] = ny * tz - nz * ty
    work[POINT + 13] = nz * tx - nx * tz
    work[POINT + 14] = nx * ty - ny * tx
