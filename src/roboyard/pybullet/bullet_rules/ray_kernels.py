"""Compiled loop over the hits of many rays."""

from __future__ import annotations

import math

from roboyard.native import compiled


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
