"""Compiled loops over rays: the first shapes that they enter, and where they start."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from roboyard.native import Bundle, compiled, record
from roboyard.pybullet.bullet_rules.hull_margins import MARGIN
from roboyard.sim.mujoco_library import mujoco_library
from roboyard.sim.queries.shape_rays import RAY_SHAPES, distance_on_ray, is_hidden

SPHERE, CAPSULE, CYLINDER, BOX = 2, 3, 5, 6
"""MuJoCo's kinds of shapes that have a core."""
SLIGHT = 1e-12
"""Slope of a ray in a side of a box, and its distance from the side (m per m of 1 m and half the box)."""
SMALLEST = 1e-9
"""Distance from a shape's core that has no direction (m)."""


@compiled("f8[:,:] f8[:,:] i4[:] i4[:] f8[:,:] f8[:] f8[:] f8[:,:] f8[:,:] i4[:] f8[:,:] -> i8")
def start_within(
    starts, ways, geoms, kinds, sizes, radii, margins, places, turns, found, normals
):  # pragma: no cover
    """Find the rays that start in a shape's margin and head inwards; return how many.

    Bullet's margin reaches from the core of a shape, the middle of a sphere, the axis of a capsule or a
    slightly smaller box or cylinder, to 1 mm outside. Beside edges of boxes and cylinders there is none.

    starts, ways: (k, 3) (m). geoms: rows of the shapes; the last one is found. kinds: (ngeom,) of MuJoCo.
    sizes: (ngeom, 3) (m). radii: (ngeom,) of bounding spheres (m). margins: (ngeom,) by which Bullet's shape
    is larger (m). places, turns: (ngeom, 3) and (ngeom, 9). found: (k,) the shape, or -1. normals: (k, 3)
    filled in, outwards.
    """
    count = 0
    for i in range(len(starts)):
        found[i], normals[i, 0], normals[i, 1], normals[i, 2] = _around(
            *(geoms, kinds, sizes, radii, margins, places, turns),
            *(starts[i, 0], starts[i, 1], starts[i, 2], ways[i, 0], ways[i, 1], ways[i, 2]),
        )
        if found[i] >= 0:
            count += 1
    return count


class Cores(NamedTuple):
    """The shapes in whose margins rays may start, and all margins."""

    rows: Any
    """(k,) MuJoCo's geoms."""
    margins: Any
    """(ngeom,) by which Bullet's shapes are larger than MuJoCo's (m)."""


_RESUME = 1e-5
"""Fraction of a ray beyond a surface that it leaves where the search for the next one starts."""
_MOST_SURFACES = 10000
"""Surfaces that a ray may leave."""
SLACK = 1e-9
"""Share by which bounding spheres are taken larger, and length (m)."""
_VECTOR = 24
"""Bytes of three numbers."""


class Room(NamedTuple):
    """Memory for rays."""

    starts: Any
    """(n, 3) (m)."""
    ends: Any
    """(n, 3) (m)."""
    geoms: Any
    """(n,) MuJoCo's geom of each hit, -1 without one."""
    hits: Any
    """(n, 7) fraction, point (m) and normal of each hit."""
    near: Any
    """(5, k) centres of bounding spheres (m), their radii (m), and squares of radii with margins (m²).

    Radii are a little larger; those of unbounded shapes are infinite, and their squares are -1.
    """
    marks: Any
    """(k,) whether a ray may meet a shape."""
    work: Any
    """(WORK,)."""


_ROOM = record(Room, "f8[:,::1] f8[:,::1] i8[::1] f8[:,::1] f8[:,::1] u1[::1] f8[::1]")
FIRST = Bundle((RAY_SHAPES, record(Cores, "i4[::1] f8[::1]"), _ROOM))


@compiled(FIRST, "i8 f8 -> i8", library=mujoco_library)
def enter_first(shapes, cores, room, count, most):  # pragma: no cover
    """Find the first of Bullet's shapes that each of `count` rays enters; return how many do.

    A ray passes surfaces that it leaves. One without a length, or that is not finite, enters nothing.
    most: largest shift of a hit, in margins.
    """
    starts, ends, work, entered = room.starts, room.ends, room.work, 0
    _gather(shapes, room.near)
    for n in range(count):
        x, y, z = starts[n, 0], starts[n, 1], starts[n, 2]
        u, v, w = ends[n, 0] - x, ends[n, 1] - y, ends[n, 2] - z
        length = math.sqrt(u * u + v * v + w * w)
        room.geoms[n] = -1
        if length == 0.0 or not math.isfinite(length + x + y + z):
            continue
        if _mark(room.near, room.marks, x, y, z, u / length, v / length, w / length, length):
            geom, i, j, k = _around(
                *(cores.rows, shapes.geom_type, shapes.geom_size, shapes.geom_rbound, cores.margins),
                *(shapes.geom_xpos, shapes.geom_xmat, x, y, z, u, v, w),
            )
            if geom >= 0:
                room.geoms[n], entered = geom, entered + 1
                _write_hit(room.hits, n, 0.0, x, y, z, u, v, w, i, j, k)
                continue
        work[3], work[4], work[5] = u / length, v / length, w / length
        first = math.inf
        for row in range(len(room.marks)):
            if room.marks[row] == 0 or not _is_ahead(room.near, row, work, x, y, z, first * length, length):
                continue
            geom, behind = shapes.rows[row], 0.0
            if is_hidden(shapes, geom):
                continue
            inwards = inwards_of_side(shapes, geom, work, x, y, z)
            if inwards[3] < 0.0:
                continue
            a, b, c = x + inwards[0], y + inwards[1], z + inwards[2]
            fraction, slope = math.inf, 0.0
            for _ in range(_MOST_SURFACES):
                fraction = _next_surface(shapes, geom, work, a, b, c, u, v, w, behind, length)
                slope = u * work[6] + v * work[7] + w * work[8]
                if fraction > 1.0 or slope <= 0.0:
                    break
                behind = fraction + _RESUME
            if fraction > 1.0:
                continue
            margin = cores.margins[geom]
            if margin > 0.0:
                fraction = max(fraction - margin / max(-slope, length / most), 0.0)
            if fraction < first or (fraction == first and geom < room.geoms[n]):
                first, room.geoms[n] = fraction, geom
                _write_hit(room.hits, n, fraction, x, y, z, u, v, w, work[6], work[7], work[8])
        entered += room.geoms[n] >= 0
    return entered


@compiled(FIRST, "i8 f8 i8 i8[::1] f8[:,::1] -> i8", library=mujoco_library)
def enter_numbered(shapes, cores, room, count, most, wanted, ranks, listed):  # pragma: no cover
    """Find one of all surfaces through which each of `count` rays enters Bullet's shapes, in their order.

    Returns -1 where there is no room for so many hits, else how many rays have one; see `enter_first`.

    wanted: number of the hit from 0. ranks: (ngeom,) order of shapes; the nearest hit of a shape comes first.
    listed: (n, 6) room for the hits of one ray: rank, shape, fraction and normal.
    """
    starts, ends, work, entered = room.starts, room.ends, room.work, 0
    _gather(shapes, room.near)
    for n in range(count):
        x, y, z = starts[n, 0], starts[n, 1], starts[n, 2]
        u, v, w = ends[n, 0] - x, ends[n, 1] - y, ends[n, 2] - z
        length = math.sqrt(u * u + v * v + w * w)
        room.geoms[n] = -1
        if length == 0.0 or not math.isfinite(length + x + y + z):
            continue
        hits, around = 0, -1
        if _mark(room.near, room.marks, x, y, z, u / length, v / length, w / length, length):
            around, i, j, k = _around(
                *(cores.rows, shapes.geom_type, shapes.geom_size, shapes.geom_rbound, cores.margins),
                *(shapes.geom_xpos, shapes.geom_xmat, x, y, z, u, v, w),
            )
            if around >= 0:
                hits = _insert(listed, hits, ranks[around], around, 0.0, i, j, k)
        work[3], work[4], work[5] = u / length, v / length, w / length
        for row in range(len(room.marks)):
            geom, behind = shapes.rows[row], 0.0
            if room.marks[row] == 0 or is_hidden(shapes, geom):
                continue
            inwards, is_core = inwards_of_side(shapes, geom, work, x, y, z), geom == around
            if inwards[3] < 0.0:
                continue
            a, b, c = x + inwards[0], y + inwards[1], z + inwards[2]
            for _ in range(_MOST_SURFACES):
                fraction = _next_surface(shapes, geom, work, a, b, c, u, v, w, behind, length)
                if fraction > 1.0:
                    break
                slope, behind = u * work[6] + v * work[7] + w * work[8], fraction + _RESUME
                if slope <= 0.0 and not is_core:
                    margin = cores.margins[geom]
                    if margin > 0.0:
                        fraction = max(fraction - margin / max(-slope, length / most), 0.0)
                    if hits == len(listed):
                        return -1
                    hits = _insert(listed, hits, ranks[geom], geom, fraction, work[6], work[7], work[8])
                is_core = False
        if wanted < hits:
            one = listed[wanted]
            room.geoms[n], entered = int(one[1]), entered + 1
            _write_hit(room.hits, n, one[2], x, y, z, u, v, w, one[3], one[4], one[5])
    return entered


def _insert(listed, count, rank, geom, fraction, i, j, k):  # pragma: no cover
    """Insert a hit in the order of ranks and fractions after equal ones; return how many there are."""
    at = count
    while at > 0 and (
        listed[at - 1, 0] > rank or (listed[at - 1, 0] == rank and listed[at - 1, 2] > fraction)
    ):
        for column in range(6):
            listed[at, column] = listed[at - 1, column]
        at -= 1
    listed[at, 0], listed[at, 1], listed[at, 2] = rank, geom, fraction
    listed[at, 3], listed[at, 4], listed[at, 5] = i, j, k
    return count + 1


def _write_hit(hits, n, fraction, x, y, z, u, v, w, i, j, k):  # pragma: no cover
    """Write fraction, point and normal of a hit to a row."""
    hits[n, 0] = fraction
    hits[n, 1], hits[n, 2], hits[n, 3] = x + fraction * u, y + fraction * v, z + fraction * w
    hits[n, 4], hits[n, 5], hits[n, 6] = i, j, k


def _gather(shapes, near):  # pragma: no cover
    """Write where the centres of bounding spheres are now."""
    rows, places = shapes.rows, shapes.geom_xpos
    for row in range(len(rows)):
        geom = rows[row]
        near[0, row], near[1, row], near[2, row] = places[geom, 0], places[geom, 1], places[geom, 2]


def _mark(near, marks, x, y, z, u, v, w, length):  # pragma: no cover
    """Mark the shapes whose bounding spheres a ray meets; return how many its start is close to.

    x, y, z: start (m). u, v, w: unit vector.
    """
    close = 0
    for row in range(len(marks)):
        a, b, c, reach = near[0, row] - x, near[1, row] - y, near[2, row] - z, near[3, row]
        apart, along = a * a + b * b + c * c, a * u + b * v + c * w
        is_met = apart - along * along <= reach * reach + SLACK * SLACK * apart
        marks[row] = is_met & (along >= -reach) & (along - reach <= length)
        close += apart <= near[4, row]
    return close


def _is_ahead(near, row, work, x, y, z, nearest, length):  # pragma: no cover
    """Return whether a shape may be met before `nearest` and the ray's end (m); see `_mark`."""
    a, b, c = near[0, row] - x, near[1, row] - y, near[2, row] - z
    return a * work[3] + b * work[4] + c * work[5] - near[3, row] <= min(nearest, length)


def _next_surface(shapes, geom, work, x, y, z, u, v, w, behind, length):  # pragma: no cover
    """Return the fraction of a ray at the next surface of a shape, infinite without one.

    The outward normal is written to `work[6:9]`. behind: fraction of the ray that is skipped.
    """
    if behind >= 1.0:
        return math.inf
    work[0], work[1], work[2] = x + behind * u, y + behind * v, z + behind * w
    place = work.ctypes.data
    distance = distance_on_ray(shapes, geom, place, place + _VECTOR, place + 2 * _VECTOR, work)
    return behind + distance / length if distance >= 0.0 else math.inf


def inwards_of_side(shapes, geom, work, x, y, z):  # pragma: no cover
    """Return by what a ray from (x, y, z) is to be moved (m), then -1 where it passes the shape, else 0.

    A ray in a side of a box passes the upper ones along the box's axes and enters the lower ones.
    """
    if shapes.geom_type[geom] != BOX:
        return 0.0, 0.0, 0.0, 0.0
    places, turns, sizes = shapes.geom_xpos, shapes.geom_xmat, shapes.geom_size
    a, b, c = x - places[geom, 0], y - places[geom, 1], z - places[geom, 2]
    for k in range(3):
        i, j, m = turns[geom, k], turns[geom, 3 + k], turns[geom, 6 + k]
        if abs(i * work[3] + j * work[4] + m * work[5]) > SLIGHT:
            continue
        along, half = i * a + j * b + m * c, sizes[geom, k]
        if abs(abs(along) - half) <= SLIGHT * (1.0 + half):
            if along > 0.0:
                return 0.0, 0.0, 0.0, -1.0
            shift = 2.0 * SLIGHT * (1.0 + half)
            return shift * i, shift * j, shift * m, 0.0
    return 0.0, 0.0, 0.0, 0.0


def _around(geoms, kinds, sizes, radii, margins, places, turns, sx, sy, sz, wx, wy, wz):  # pragma: no cover
    """Return the shape in whose margin a ray starts, -1 for none, and its normal; see `start_within`."""
    found, normal = -1, (0.0, 0.0, 0.0)
    for j in range(len(geoms)):
        g = geoms[j]
        x, y, z = sx - places[g, 0], sy - places[g, 1], sz - places[g, 2]
        if x * x + y * y + z * z > (radii[g] + 2.0 * MARGIN) ** 2:
            continue
        lx = turns[g, 0] * x + turns[g, 3] * y + turns[g, 6] * z
        ly = turns[g, 1] * x + turns[g, 4] * y + turns[g, 7] * z
        lz = turns[g, 2] * x + turns[g, 5] * y + turns[g, 8] * z
        inner = MARGIN - margins[g]
        outer = 2.0 * MARGIN
        nx, ny, nz = 0.0, 0.0, 0.0
        if kinds[g] == SPHERE or kinds[g] == CAPSULE:
            half = sizes[g, 1] if kinds[g] == CAPSULE else 0.0
            nx, ny, nz = lx, ly, lz - min(max(lz, -half), half)
            outer = sizes[g, 0] + MARGIN
        elif kinds[g] == BOX:
            ex = abs(lx) - sizes[g, 0] + inner
            ey = abs(ly) - sizes[g, 1] + inner
            ez = abs(lz) - sizes[g, 2] + inner
            if ex > 0.0 and ey <= 0.0 and ez <= 0.0:
                nx = math.copysign(ex, lx)
            elif ey > 0.0 and ex <= 0.0 and ez <= 0.0:
                ny = math.copysign(ey, ly)
            elif ez > 0.0 and ex <= 0.0 and ey <= 0.0:
                nz = math.copysign(ez, lz)
        else:
            across = math.sqrt(lx * lx + ly * ly)
            beyond = across - sizes[g, 0] + inner
            ez = abs(lz) - sizes[g, 1] + inner
            if beyond > 0.0 and ez <= 0.0:
                nx, ny = lx * beyond / across, ly * beyond / across
            elif ez > 0.0 and beyond <= 0.0:
                nz = math.copysign(ez, lz)
        distance = math.sqrt(nx * nx + ny * ny + nz * nz)
        if distance < SMALLEST or distance > outer:
            continue
        nx, ny, nz = nx / distance, ny / distance, nz / distance
        x = turns[g, 0] * nx + turns[g, 1] * ny + turns[g, 2] * nz
        y = turns[g, 3] * nx + turns[g, 4] * ny + turns[g, 5] * nz
        z = turns[g, 6] * nx + turns[g, 7] * ny + turns[g, 8] * nz
        slope = x * wx + y * wy + z * wz
        if slope < 0.0 or (slope == 0.0 and kinds[g] == CAPSULE):
            found = g
            normal = (x, y, z)
    return found, normal[0], normal[1], normal[2]
