"""Compiled closest points of the shapes of two bodies, placed as they are now where nothing else has."""

from __future__ import annotations

from typing import Any

from roboyard._records import NamedTuple
from roboyard.native import Bundle, c_function, compiled, record
from roboyard.pybullet.bullet_rules.chain_kernels import CHAIN, follow_chain, times, turned
from roboyard.pybullet.bullet_rules.shape_bounds import MARGIN
from roboyard.sim.mujoco_library import mujoco_library

PLANE, CYLINDER, BOX = 0, 5, 6
"""MuJoCo's kinds of infinite planes, cylinders and boxes."""
LEAST_REACH = 1e-6
"""Distance (m) up to which points are looked for at least."""
NUMBERS = 10
"""Numbers of a pair: points on A and on B (m), normal on B towards A, distance (m)."""
_SLACK = 1e-9
"""Share by which bounding spheres are taken larger, and length (m)."""

mj_geomDistance = c_function("mj_geomDistance", "i8 i8 i4 i4 f8 i8 -> f8", library=mujoco_library)


class Shapes(NamedTuple):
    """MuJoCo's arrays of shapes, and room for two points."""

    kinds: Any
    bodies: Any
    positions: Any
    turns: Any
    xpos: Any
    xmat: Any
    radii: Any
    """(ngeom,) radii of bounding spheres; 0 for planes (m)."""
    sizes: Any
    """(ngeom, 3) half sizes, or radius and half length (m)."""
    ends: Any
    """(12,) both points, and sizes while they are less."""
    model: int
    """Address of MuJoCo's model."""
    data: int
    """Address of MuJoCo's data."""


CLOSEST = Bundle(
    (
        record(
            Shapes, "i4[::1] i4[::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[::1] f8[:,::1] f8[::1] i8 i8"
        ),
        *CHAIN.records,
    )
)


def _place(shapes, chain, geoms):  # pragma: no cover
    """Write poses of shapes at the present positions, those of one body after another."""
    last = -1
    for n in range(len(geoms)):
        geom = geoms[n]
        body = shapes.bodies[geom]
        if body != last:
            follow_chain(chain, body, False)
            last = body
        at = chain.at[0, 0], chain.at[0, 1], chain.at[0, 2]
        q = chain.turned[0, 0], chain.turned[0, 1], chain.turned[0, 2], chain.turned[0, 3]
        _write_pose(shapes, geom, at, q)


def _write_pose(shapes, geom, at, q):  # pragma: no cover
    """Write the pose of a shape whose body is at a position (m), turned by a quaternion w, x, y, z."""
    away = turned(q, (shapes.positions[geom, 0], shapes.positions[geom, 1], shapes.positions[geom, 2]))
    own = shapes.turns[geom, 0], shapes.turns[geom, 1], shapes.turns[geom, 2], shapes.turns[geom, 3]
    w, x, y, z = times(q, own)
    for k in range(3):
        shapes.xpos[geom, k] = at[k] + away[k]
    matrix = shapes.xmat
    matrix[geom, 0] = w * w + x * x - y * y - z * z
    matrix[geom, 1], matrix[geom, 2] = 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    matrix[geom, 4] = w * w - x * x + y * y - z * z
    matrix[geom, 3], matrix[geom, 5] = 2.0 * (x * y + w * z), 2.0 * (y * z - w * x)
    matrix[geom, 8] = w * w - x * x - y * y + z * z
    matrix[geom, 6], matrix[geom, 7] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x)


def _is_far(shapes, a, b, reach):  # pragma: no cover
    """Return whether bounding spheres show that two shapes are farther apart."""
    if shapes.kinds[a] == PLANE:
        a, b = b, a
    x = shapes.xpos[a, 0] - shapes.xpos[b, 0]
    y = shapes.xpos[a, 1] - shapes.xpos[b, 1]
    z = shapes.xpos[a, 2] - shapes.xpos[b, 2]
    wide = (reach + shapes.radii[a] + shapes.radii[b]) * (1.0 + _SLACK) + _SLACK
    if shapes.radii[a] <= 0.0:
        return False
    if shapes.kinds[b] == PLANE:
        return x * shapes.xmat[b, 2] + y * shapes.xmat[b, 5] + z * shapes.xmat[b, 8] > wide
    return shapes.radii[b] > 0.0 and x * x + y * y + z * z > wide * wide


@compiled(CLOSEST, "f8[::1] i8[::1] i8[::1] f8 i8 f8[:,::1] i8[:,::1] -> i8", library=mujoco_library)
def closest_points(shapes, chain, margins, first, second, limit, is_moved, out, pairs):  # pragma: no cover
    """Write the closest points of all pairs of shapes within a distance (m); return how many there are.

    margins: (ngeom,) by which Bullet's shapes are larger (m). first, second: MuJoCo's geoms of both sides.
    is_moved: 1 where their poses have to be computed. out: (n, NUMBERS), and pairs: (n, 2) places in first
    and second, written.
    """
    if is_moved == 1:
        _place(shapes, chain, first)
        _place(shapes, chain, second)
    return _search(shapes, margins, first, second, limit, out, pairs)


@compiled(
    CLOSEST,
    "f8[::1] f8[:,::1] f8[:,::1] f8[::1] i8[::1] i8[::1] i8[::1] i8[::1] f8[::1] f8[::1] f8 "
    "f8[:,::1] i8[:,::1] -> i8",
    library=mujoco_library,
)
def closest_copies(
    shapes, chain, margins, xpos, xmat, widths, first, second, sources, others, pose, other, limit, out, pairs
):  # pragma: no cover
    """Do what `closest_points` does with copies of shapes, which are placed as those of a world are now.

    xpos, xmat, widths: (ngeom, 3) (m), (ngeom, 9) and (ngeom,) margins (m) of that world's geoms. sources,
    others: the geom of that world for each of first and of second, -1 for a shape at a pose. pose, other:
    (7,) of these, x, y, z (m) and a unit quaternion x, y, z, w.
    """
    _bring(shapes, margins, xpos, xmat, widths, first, sources, pose)
    _bring(shapes, margins, xpos, xmat, widths, second, others, other)
    return _search(shapes, margins, first, second, limit, out, pairs)


def _bring(shapes, margins, xpos, xmat, widths, geoms, sources, pose):  # pragma: no cover
    """Place shapes as those of another world are, or at a pose."""
    q = pose[6], pose[3], pose[4], pose[5]
    for n in range(len(geoms)):
        geom, source = geoms[n], sources[n]
        if source < 0:
            _write_pose(shapes, geom, (pose[0], pose[1], pose[2]), q)
            continue
        margins[geom] = widths[source]
        for k in range(3):
            shapes.xpos[geom, k] = xpos[source, k]
        for k in range(9):
            shapes.xmat[geom, k] = xmat[source, k]


def _edge(shapes, margins, geom, other):  # pragma: no cover
    """Return the radius of a shape's edges (m), 0 where it has none, or against itself or a plane.

    `bullet_rules.round_edges` has the same rule.
    """
    kind = shapes.kinds[geom]
    if (kind != BOX and kind != CYLINDER) or geom == other or shapes.kinds[other] == PLANE:
        return 0.0
    least = min(shapes.sizes[geom, 0], shapes.sizes[geom, 1])
    if kind == BOX:
        least = min(least, shapes.sizes[geom, 2])
    return MARGIN if least > MARGIN and margins[geom] == 0.0 else 0.0  # with a margin it is a hull


def _gap(shapes, a, b, reach):  # pragma: no cover
    """Return the distance of two shapes (m), and whether it is within reach; write the points."""
    ends, total = shapes.ends, 0.0
    gap = mj_geomDistance(shapes.model, shapes.data, a, b, reach, ends.ctypes.data)
    for k in range(6):
        total += abs(ends[k])
    return gap, not (gap > reach or (gap == reach and total == 0.0))


def _gap_of_cores(shapes, a, b, edge_a, edge_b, reach):  # pragma: no cover
    """Do what `_gap` does with shapes that are smaller by the radii of their edges."""
    sizes, ends = shapes.sizes, shapes.ends
    for k in range(3):
        ends[6 + k], ends[9 + k] = sizes[a, k], sizes[b, k]
        sizes[a, k] -= edge_a
        sizes[b, k] -= edge_b
    gap, is_near = _gap(shapes, a, b, reach + edge_a + edge_b)
    for k in range(3):
        sizes[a, k], sizes[b, k] = ends[6 + k], ends[9 + k]
    return gap, is_near


def _search(shapes, margins, first, second, limit, out, pairs):  # pragma: no cover
    """Write the closest points of all pairs of placed shapes; see `closest_points`."""
    count, ends = 0, shapes.ends
    for i in range(len(first)):
        for j in range(len(second)):
            a, b = first[i], second[j]
            both = margins[a] + margins[b]
            reach = max(limit + both, LEAST_REACH)
            if a != b and _is_far(shapes, a, b, reach):
                continue
            edge_a, edge_b = _edge(shapes, margins, a, b), _edge(shapes, margins, b, a)
            if edge_a + edge_b > 0.0:
                gap, is_near = _gap_of_cores(shapes, a, b, edge_a, edge_b, reach)
            else:
                gap, is_near = _gap(shapes, a, b, reach)
            if not is_near:
                continue
            x, y, z = ends[0] - ends[3], ends[1] - ends[4], ends[2] - ends[5]
            length = (x * x + y * y + z * z) ** 0.5
            if length <= 1e-12:
                x, y, z, length = 0.0, 0.0, 1.0, 1.0
            if gap < 0.0:
                length = -length
            normal = x / length, y / length, z / length
            for k in range(3):
                out[count, k] = ends[k] - (margins[a] + edge_a) * normal[k]
                out[count, 3 + k] = ends[3 + k] + (margins[b] + edge_b) * normal[k]
                out[count, 6 + k] = normal[k]
            out[count, 9] = gap - both - (edge_a + edge_b)
            pairs[count, 0], pairs[count, 1] = i, j
            count += 1
    return count
