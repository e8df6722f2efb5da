"""The closest points of a shape and all triangles of a height field or a mesh that are near it."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.sim.stepping.narrow_phase.closest_points import FIRST, FOUND, SECOND, SPHERE
from roboyard.sim.stepping.narrow_phase.edge_kernels import write_core
from roboyard.sim.stepping.narrow_phase.field_kernels import FIELDS, is_beyond, on_triangle, radius_around
from roboyard.sim.stepping.narrow_phase.field_triangles import begin, next_triangle


@compiled(
    FIELDS,
    "i4[::1] i4[::1] f8[:,:] f8[:,:] f8[:,:,::1] f8[::1] f8[:,::1] i4[:,::1]",
    "i8 i8 f8 f8[::1] f8[:,::1] -> i8",
)
def closest_on_field(  # pragma: no cover
    fields, geom_type, geom_body, xpos, xmat, boxes, rounding, hulls, spans, field, shape, limit, work, out
):
    """Write the closest points of a shape and each triangle within a distance; return how many there are.

    The first arguments are those of `keep_points`. field, shape: geoms, of which the shape is known. limit:
    distance (m). out: (n, 10) distance, point on the shape, point on the triangle (m) and the direction from
    this to that; only the first n are written.
    """
    kind, body = geom_type[shape], geom_body[shape]
    margin = begin(fields, field, geom_type, body, xpos, xmat, boxes, shape, limit, work)
    if kind == SPHERE:
        margin = 0.0
    write_core(geom_type, geom_body, xpos, xmat, boxes, rounding, shape, work, FIRST)
    work[SECOND + 15] = margin
    round_off = work[FIRST + 15] + margin
    radius = radius_around(kind, shape, hulls, spans, work)
    count = 0
    while next_triangle(fields, field, work):
        if is_beyond(work, radius, limit + margin):
            continue
        apart, is_known = on_triangle(kind, shape, field, hulls, spans, limit + round_off, work)
        if not is_known or apart - round_off > limit:
            continue
        if count < out.shape[0]:
            nx, ny, nz = work[FOUND + 6], work[FOUND + 7], work[FOUND + 8]
            scale = 1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
            out[count, 0] = apart - round_off
            for k in range(3):
                along = scale * work[FOUND + 6 + k]
                out[count, 1 + k] = work[FOUND + k] - work[FIRST + 15] * along
                out[count, 4 + k] = work[FOUND + 3 + k] + margin * along
                out[count, 7 + k] = along
        count += 1
    return count
