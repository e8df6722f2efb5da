"""Light of the pixels of a run, part of a row, in loops over arrays of single precision."""

from __future__ import annotations

import numpy as np

from roboyard.rendering.kernels.indices import I
from roboyard.rendering.kernels.shadow import sunlight
from roboyard.rendering.kernels.vectors import at_pixel, dot, row_of

F = np.float32
ZERO, HALF, ONE, THREE = F(0.0), F(0.5), F(1.0), F(3.0)
FULL, PER_BYTE, TINY = F(255.0), F(1.0 / 255.0), F(1e-30)
BYTE, OPAQUE = np.int32(255), np.int32(-(1 << 24))

RUN = 256
"""Most pixels shaded at a time: their arrays stay in the processor's first cache."""
COUNT = 18
WORK = COUNT * RUN
DEPTH, PX, PY, PZ, NX, NY, NZ, RED, GREEN, BLUE, ALPHA, SHINE, U, V, Q, FACING, SUN, FADE = (
    I(RUN * k) for k in range(COUNT)
)
"""Places of the arrays of a run in one array of single precision, so that loops over them run on vectors of
pixels: depth, point, normal, colour, highlight, place in the shadow map and nearness to the sun, cosine to
the sun, share of the sun, and fading."""


def lay_points(work, nearness, row, first, end, view):
    """Write depth, and place from the eye of pixel (0, 0), of the points that a run of pixels shows."""
    o, d = view.origins, view.directions
    y = row + 0.5
    # at the middle of the run's first pixel, and the change per pixel
    x = first + 0.5
    ox, oy, oz = F(o[1, 0] * x + o[2, 0] * y), F(o[1, 1] * x + o[2, 1] * y), F(o[1, 2] * x + o[2, 2] * y)
    ux, uy, uz = F(o[1, 0]), F(o[1, 1]), F(o[1, 2])
    dx, dy, dz = at_pixel(d, x, y)
    dx, dy, dz = F(dx), F(dy), F(dz)
    vx, vy, vz = F(d[1, 0]), F(d[1, 1]), F(d[1, 2])
    p = row * view.width + first
    if view.perspective:
        for k in range(I(end - first)):
            work[DEPTH + k] = ONE / nearness[I(p) + k]
    else:
        for k in range(I(end - first)):
            work[DEPTH + k] = -nearness[I(p) + k]
    for k in range(I(end - first)):
        t, depth = F(np.int32(k)), work[DEPTH + k]
        work[PX + k] = (ox + ux * t) + depth * (dx + vx * t)
        work[PY + k] = (oy + uy * t) + depth * (dy + vy * t)
        work[PZ + k] = (oz + uz * t) + depth * (dz + vz * t)


def lay_light(work, row, first, end, view, sun):
    """Make normals unit vectors; write the cosine to the sun, its share and the place in the shadow map."""
    light, m = sun.light, sun.matrix
    sx, sy, sz = F(light[0]), F(light[1]), F(light[2])
    for k in range(I(end - first)):
        nx, ny, nz = work[NX + k], work[NY + k], work[NZ + k]
        scale = ONE / np.sqrt(nx * nx + ny * ny + nz * nz + TINY)
        facing = max(scale * (nx * sx + ny * sy + nz * sz), ZERO)
        work[NX + k], work[NY + k], work[NZ + k] = nx * scale, ny * scale, nz * scale
        work[FACING + k] = facing
        work[SUN + k] = ONE if facing > ZERO else ZERO
    if sun.size > 0:
        x, y = first + 0.5, row + 0.5
        o, d = at_pixel(view.origins, x, y), at_pixel(view.directions, x, y)
        right, ahead = row_of(view.origins, 1), row_of(view.directions, 1)
        count = end - first
        add_place(work, U, count, row_of(m, 0), m[0, 3] - 0.5, o, right, d, ahead)
        add_place(work, V, count, row_of(m, 1), m[1, 3] - 0.5, o, right, d, ahead)
        add_place(work, Q, count, (-m[2, 0], -m[2, 1], -m[2, 2]), -m[2, 3], o, right, d, ahead)


def add_place(work, into, count, axis, offset, origin, right, direction, ahead):
    """Add the place of each pixel's point along an axis to the array `into`.

    Args:
        work: arrays of a run of pixels.
        into: U, V or Q.
        count: pixels.
        axis: the axis, in the world frame.
        offset: place of the world's origin along it.
        origin: origin of the first pixel's ray.
        right: its change from one pixel to the next.
        direction: direction of the first pixel's ray.
        ahead: its change from one pixel to the next.
    """
    start, rise = F(dot(axis, origin) + offset), F(dot(axis, right))
    slope, bend = F(dot(axis, direction)), F(dot(axis, ahead))
    for k in range(I(count)):
        t = F(np.int32(k))
        work[into + k] += (start + rise * t) + work[DEPTH + k] * (slope + bend * t)


def cast_shadows(work, start, end, sun):
    """Write the share of the sun that reaches each point; those that face away from it have none."""
    leak = sun.light[10]
    for k in range(I(start), I(max(end, start))):
        if work[FACING + k] > ZERO:
            share = sunlight(sun.nearness, sun.tiles, sun.size, work[U + k], work[V + k], work[Q + k])
            work[SUN + k] = share + leak * (1.0 - share)


def light_up(work, row, first, end, view, sun):
    """Light colours: ambient, sun, sky, gloss and Blinn's highlight with exponent 32."""
    light = sun.light
    d = at_pixel(view.directions, first + 0.5, row + 0.5)
    dx, dy, dz = F(d[0]), F(d[1]), F(d[2])
    vx, vy, vz = F(view.directions[1, 0]), F(view.directions[1, 1]), F(view.directions[1, 2])
    sx, sy, sz = F(light[0]), F(light[1]), F(light[2])
    red, green, blue, ambient = F(light[3]), F(light[4]), F(light[5]), F(light[6])
    direct, sky = F(light[7] * (1.0 - light[9])), F(light[7] * light[9] * 0.5)
    if light[11] > 0.0:
        gloss, beyond = F(light[11]), F(light[10]) if sun.size > 0 else ONE
        for k in range(I(end - first)):
            nx, ny, nz, facing = work[NX + k], work[NY + k], work[NZ + k], work[FACING + k]
            up = max((nx * sx + ny * sy + nz * sz) * (nz + nz) - sz, ZERO)
            share = work[SUN + k] if facing > ZERO else beyond
            work[FACING + k] = share * (direct * facing + gloss * up * up) + sky * (ONE + nz)
    else:
        for k in range(I(end - first)):
            work[FACING + k] = direct * work[SUN + k] * work[FACING + k] + sky * (ONE + work[NZ + k])
    if light[8] > 0.0:
        for k in range(I(end - first)):
            t = F(np.int32(k))
            x, y, z = dx + vx * t, dy + vy * t, dz + vz * t
            scale = ONE / np.sqrt(x * x + y * y + z * z + TINY)
            x, y, z = sx - x * scale, sy - y * scale, sz - z * scale
            half = max(work[NX + k] * x + work[NY + k] * y + work[NZ + k] * z, ZERO)
            half = half * half / (x * x + y * y + z * z + TINY)
            half *= half
            half *= half
            half *= half
            work[SHINE + k] *= half * half * work[SUN + k]
    for k in range(I(end - first)):
        amount, shine = work[FACING + k], work[SHINE + k]
        work[RED + k] = work[RED + k] * (ambient + amount * red) + shine * red
        work[GREEN + k] = work[GREEN + k] * (ambient + amount * green) + shine * green
        work[BLUE + k] = work[BLUE + k] * (ambient + amount * blue) + shine * blue


def light_evenly(work, count, ambient):
    """Light the colours of a run by ambient light alone."""
    share = F(ambient)
    for k in range(I(count)):
        work[RED + k] *= share
        work[GREEN + k] *= share
        work[BLUE + k] *= share


def fade_out(work, count, behind):
    """Mix the colours of infinite planes with the background."""
    red, green, blue = F(behind[0]), F(behind[1]), F(behind[2])
    for k in range(I(count)):
        share = work[FADE + k]
        work[RED + k] += share * (red - work[RED + k])
        work[GREEN + k] += share * (green - work[GREEN + k])
        work[BLUE + k] += share * (blue - work[BLUE + k])


def write_run(work, count, more, out, p):
    """Write the opaque colours of a run as packed bytes to `out`, from pixel p; `more` is added to levels."""
    more = F(more)
    for k in range(I(count)):
        red = np.int32(min(work[RED + k], ONE) * FULL + more)
        green = np.int32(min(work[GREEN + k], ONE) * FULL + more)
        blue = np.int32(min(work[BLUE + k], ONE) * FULL + more)
        out[I(p) + k] = np.uint32(red | (green << np.int32(8)) | (blue << np.int32(16)) | OPAQUE)
