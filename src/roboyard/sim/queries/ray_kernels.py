"""Compiled loops over many rays: what is done before MuJoCo casts them, and after."""

from __future__ import annotations

import math

import numpy as np

from roboyard.native import compiled


@compiled("f8[:,:] f8[:,:] f8[:,::1] f8[:,::1] f8[::1] -> i8")
def point_rays(starts, ends, ways, directions, lengths):  # pragma: no cover
    """Fill in vectors, unit vectors and lengths of rays; return the first that is not finite, else -1.

    MuJoCo ends the process for directions without a length: such rays get +x. starts, ends: (k, 3), or (1, 3)
    for all rays (m).
    """
    wrong = -1
    for i in range(len(lengths)):
        start, end = min(i, len(starts) - 1), min(i, len(ends) - 1)
        largest = 0.0
        for k in range(3):
            way = ends[end, k] - starts[start, k]
            if not np.isfinite(way) and wrong < 0:
                wrong = i
            ways[i, k] = way
            largest = max(largest, abs(way))
        if largest == 0.0:
            directions[i, 0], directions[i, 1], directions[i, 2] = 1.0, 0.0, 0.0
            lengths[i] = 0.0
            continue
        x, y, z = ways[i, 0] / largest, ways[i, 1] / largest, ways[i, 2] / largest
        norm = math.sqrt(x * x + y * y + z * z)
        directions[i, 0], directions[i, 1], directions[i, 2] = x / norm, y / norm, z / norm
        lengths[i] = norm * largest
    return wrong


@compiled("f8[::1] f8[::1] i4[:,:] i4[::1] f8[:,::1] i4[:,::1] f8[::1]")
def keep_hits(distances, lengths, geom_owners, geoms, normals, owners, fraction):  # pragma: no cover
    """Fill in owners and fractions of hits within the rays' lengths, and clear what is none."""
    for i in range(len(lengths)):
        geom = geoms[i]
        if geom >= 0 and 0.0 <= distances[i] <= lengths[i] and lengths[i] > 0.0:
            owners[i, 0], owners[i, 1] = geom_owners[geom, 0], geom_owners[geom, 1]
            fraction[i] = distances[i] / lengths[i]
        else:
            geoms[i], owners[i, 0], owners[i, 1], fraction[i] = -1, -1, -1, 1.0
            normals[i, 0], normals[i, 1], normals[i, 2] = 0.0, 0.0, 0.0
