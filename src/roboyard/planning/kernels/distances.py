"""Signed distances from points to obstacles, with the direction that leads away from them."""

from __future__ import annotations

import math

from roboyard.planning.kernels.arrays import CAPSULE, CYLINDER, HALF_SPACE


def box_squares(boxes, x, y, z, out):
    """out (b,): squared distance from a point to each box, 0 inside."""
    for b in range(boxes.shape[1]):
        dx, dy, dz = x - boxes[0, b], y - boxes[1, b], z - boxes[2, b]
        u = abs(boxes[3, b] * dx + boxes[6, b] * dy + boxes[9, b] * dz) - boxes[12, b]
        v = abs(boxes[4, b] * dx + boxes[7, b] * dy + boxes[10, b] * dz) - boxes[13, b]
        w = abs(boxes[5, b] * dx + boxes[8, b] * dy + boxes[11, b] * dz) - boxes[14, b]
        u, v, w = max(u, 0.0), max(v, 0.0), max(w, 0.0)
        out[b] = u * u + v * v + w * w


def box_distance(boxes, b, x, y, z):
    """Signed distance from a point to box b, and the unit direction away from it."""
    dx, dy, dz = x - boxes[0, b], y - boxes[1, b], z - boxes[2, b]
    lx = boxes[3, b] * dx + boxes[6, b] * dy + boxes[9, b] * dz
    ly = boxes[4, b] * dx + boxes[7, b] * dy + boxes[10, b] * dz
    lz = boxes[5, b] * dx + boxes[8, b] * dy + boxes[11, b] * dz
    u, v, w = abs(lx) - boxes[12, b], abs(ly) - boxes[13, b], abs(lz) - boxes[14, b]
    if u > 0.0 or v > 0.0 or w > 0.0:
        gx, gy, gz = max(u, 0.0), max(v, 0.0), max(w, 0.0)
        distance = math.sqrt(gx * gx + gy * gy + gz * gz)
        gx, gy, gz = gx / distance, gy / distance, gz / distance
    else:
        distance = max(u, v, w)
        gx, gy, gz = 0.0, 0.0, 0.0
        if distance == u:
            gx = 1.0
        elif distance == v:
            gy = 1.0
        else:
            gz = 1.0
    gx, gy, gz = math.copysign(gx, lx), math.copysign(gy, ly), math.copysign(gz, lz)
    return (
        distance,
        boxes[3, b] * gx + boxes[4, b] * gy + boxes[5, b] * gz,
        boxes[6, b] * gx + boxes[7, b] * gy + boxes[8, b] * gz,
        boxes[9, b] * gx + boxes[10, b] * gy + boxes[11, b] * gz,
    )


def capsule_distance(radius, half, x, y, z):
    """Signed distance and direction from a capsule along z; half 0 is a sphere."""
    z = z - min(max(z, -half), half)
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-12:
        return -radius, 1.0, 0.0, 0.0
    return length - radius, x / length, y / length, z / length


def cylinder_distance(radius, half, x, y, z):
    """Signed distance and direction from a cylinder along z with flat ends."""
    flat = math.sqrt(x * x + y * y)
    cx, cy = (x / flat, y / flat) if flat > 1e-12 else (1.0, 0.0)
    side = math.copysign(1.0, z)
    u, w = flat - radius, abs(z) - half
    if u > 0.0 and w > 0.0:
        length = math.sqrt(u * u + w * w)
        return length, cx * u / length, cy * u / length, side * w / length
    if u > w:
        return u, cx, cy, 0.0
    return w, 0.0, 0.0, side


def field_distance(values, first, nx, ny, nz, x, y, z):
    """Trilinear value of a grid of distances at a point in cells, its gradient, and how far outside it is.

    Value i is that of the point i + 0.5. Outside the grid the distance to the grid is added.
    """
    qx, qy, qz = x - 0.5, y - 0.5, z - 0.5
    cx = min(max(qx, 0.0), nx - 1.000001)
    cy = min(max(qy, 0.0), ny - 1.000001)
    cz = min(max(qz, 0.0), nz - 1.000001)
    i, j, k = int(cx), int(cy), int(cz)
    fx, fy, fz = cx - i, cy - j, cz - k
    a = first + (i * ny + j) * nz + k
    b = a + ny * nz
    p00 = values[a] + fz * (values[a + 1] - values[a])
    p01 = values[a + nz] + fz * (values[a + nz + 1] - values[a + nz])
    p10 = values[b] + fz * (values[b + 1] - values[b])
    p11 = values[b + nz] + fz * (values[b + nz + 1] - values[b + nz])
    p0, p1 = p00 + fy * (p01 - p00), p10 + fy * (p11 - p10)
    gx = p1 - p0
    gy = (p01 - p00) + fx * ((p11 - p10) - (p01 - p00))
    low = (values[a + 1] - values[a]) * (1 - fy) + (values[a + nz + 1] - values[a + nz]) * fy
    high = (values[b + 1] - values[b]) * (1 - fy) + (values[b + nz + 1] - values[b + nz]) * fy
    gz = low + fx * (high - low)
    ox, oy, oz = qx - cx, qy - cy, qz - cz
    out = math.sqrt(ox * ox + oy * oy + oz * oz)
    if out > 1e-5:
        gx, gy, gz = ox, oy, oz
    length = math.sqrt(gx * gx + gy * gy + gz * gz)
    if length < 1e-12:
        return p0 + fx * (p1 - p0), 0.0, 0.0, 1.0, out
    return p0 + fx * (p1 - p0), gx / length, gy / length, gz / length, out


def obstacle_distance(world, o, x, y, z):
    """Signed distance from a point to obstacle o (not a box), and the unit direction away from it."""
    frame = world.frame[o]
    dx, dy, dz = x - frame[0], y - frame[1], z - frame[2]
    lx = frame[3] * dx + frame[6] * dy + frame[9] * dz
    ly = frame[4] * dx + frame[7] * dy + frame[10] * dz
    lz = frame[5] * dx + frame[8] * dy + frame[11] * dz
    size, kind = world.size[o], world.kind[o]
    if kind == CAPSULE:
        d, gx, gy, gz = capsule_distance(size[0], size[1], lx, ly, lz)
    elif kind == CYLINDER:
        d, gx, gy, gz = cylinder_distance(size[0], size[1], lx, ly, lz)
    elif kind == HALF_SPACE:
        d, gx, gy, gz = lz, 0.0, 0.0, 1.0
    else:
        cell, grid = size[3], world.grid[o]
        d, gx, gy, gz, out = field_distance(
            world.values,
            grid[0],
            grid[1],
            grid[2],
            grid[3],
            (lx - size[0]) / cell,
            (ly - size[1]) / cell,
            (lz - size[2]) / cell,
        )
        if out > 1e-5:  # the grid is convex and holds the surface: its corner angle there is at least 90°
            d = math.sqrt(max(d, 0.0) ** 2 + (out * cell) ** 2)
    return (
        d,
        frame[3] * gx + frame[4] * gy + frame[5] * gz,
        frame[6] * gx + frame[7] * gy + frame[8] * gz,
        frame[9] * gx + frame[10] * gy + frame[11] * gz,
    )
