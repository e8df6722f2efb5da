"""Compiled loops over rays: the first hit of one, where many start, and the hits of many."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from roboyard.native import Bundle, compiled, record
from roboyard.pybullet.bullet_rules.hull_margins import MARGIN
from roboyard.sim.mujoco_library import mujoco_library
from roboyard.sim.queries.shape_rays import RAY_SHAPES, first_on_ray

SPHERE, CAPSULE, CYLINDER, BOX = 2, 3, 5, 6
"""MuJoCo's kinds of shapes that have a core."""
SMALLEST = 1e-9
"""Distance from a shape's core that has no direction (m)."""


@compiled("f8[:,:] f8[:,:] f8[:,:] i4[:] i4[:,:] f8[:] f8 f8[:] f8[:,:] -> i8")
def enter_shapes(
    starts, ends, normals, geoms, owners, margins, most, fractions, positions
):  # pragma: no cover
    """Move hits to Bullet's shapes, which are larger by a margin; return how many rays leave a shape.

    Those start in the shape; their `geoms` become -2. margins: (ngeom,) m. most: largest shift of a hit, in
    margins. owners: their links are counted from -1 afterwards. fractions: changed. positions: filled in (m),
    zeros for a miss.
    """
    leaving = 0
    for i in range(len(fractions)):
        geom = geoms[i]
        if owners[i, 0] < 0:
            positions[i, 0], positions[i, 1], positions[i, 2] = 0.0, 0.0, 0.0
            continue
        owners[i, 1] -= 1
        x, y, z = ends[i, 0] - starts[i, 0], ends[i, 1] - starts[i, 1], ends[i, 2] - starts[i, 2]
        slope = normals[i, 0] * x + normals[i, 1] * y + normals[i, 2] * z
        if slope > 0.0:
            geoms[i] = -2
            leaving += 1
        if geom >= 0 and margins[geom] > 0.0:
            steepest = max(abs(slope), math.sqrt(x * x + y * y + z * z) / most)
            if steepest > 0.0:
                fractions[i] = max(fractions[i] - margins[geom] / steepest, 0.0)
        positions[i, 0] = starts[i, 0] + fractions[i] * x
        positions[i, 1] = starts[i, 1] + fractions[i] * y
        positions[i, 2] = starts[i, 2] + fractions[i] * z
    return leaving


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


FIRST = Bundle((RAY_SHAPES, record(Cores, "i4[::1] f8[::1]")))
LEAVES = -2
"""Returned for a ray that leaves the first shape that it meets."""


@compiled(FIRST, "f8 f8 f8 f8 f8 f8 f8 f8 f8[::1] f8[::1] -> i8", library=mujoco_library)
def enter_first(shapes, cores, x, y, z, u, v, w, length, most, work, out):  # pragma: no cover
    """Return the first of Bullet's shapes that a ray enters (MuJoCo's geom), -1 without one, or LEAVES.

    x, y, z: start (m). u, v, w: from there to the end (m). length: of that (m). most: largest shift of a hit,
    in margins. work: (WORK,). out: (7,) fraction, point (m) and normal are filled in.
    """
    geom, i, j, k = _around(
        *(cores.rows, shapes.geom_type, shapes.geom_size, shapes.geom_rbound, cores.margins),
        *(shapes.geom_xpos, shapes.geom_xmat, x, y, z, u, v, w),
    )
    fraction = 0.0
    if geom < 0:
        work[0], work[1], work[2] = x, y, z
        work[3], work[4], work[5] = u / length, v / length, w / length
        geom = first_on_ray(shapes, work, work.ctypes.data, length)
        fraction, i, j, k = work[12] / length, work[9], work[10], work[11]
        slope = u * i + v * j + w * k
        if geom < 0 or fraction > 1.0:
            return -1
        if slope > 0.0:
            return LEAVES
        margin = cores.margins[geom]
        if margin > 0.0:
            steepest = max(-slope, math.sqrt(u * u + v * v + w * w) / most)
            fraction = max(fraction - margin / steepest, 0.0)
    out[0] = fraction
    out[1], out[2], out[3] = x + fraction * u, y + fraction * v, z + fraction * w
    out[4], out[5], out[6] = i, j, k
    return geom


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
