"""Boxes in which shapes were made, for the order of the pairs that they meet first."""

from __future__ import annotations

from roboyard.native import compiled

UNKNOWN = 1e8
"""Half size (m) from which on a box is not known."""


@compiled("i4[::1] f8[:,:,::1] f8[::1] f8[:,::1] f8[:,::1]")
def write_first_boxes(geoms, boxes, pose, wide, tight):  # pragma: no cover
    """Write boxes parallel to the world's axes around the new shapes of a body where it was made.

    geoms: (n,) of the body. boxes: (n, 4, 3) middle and three half axes of the box around each in the base's
    frame (m). pose: (7,) place (m) and quaternion (x, y, z, w) of the base. wide: (ngeom, 6) the wrong way
    round for new geoms. tight: (ngeom, 6) least and largest coordinates (m), written where they are known.
    """
    x, y, z, w = pose[3], pose[4], pose[5], pose[6]
    for k in range(geoms.shape[0]):
        geom = geoms[k]
        if wide[geom, 0] <= wide[geom, 3]:
            continue
        box, known = boxes[k], True
        for axis in range(3):
            if axis == 0:
                a, b, c = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
            elif axis == 1:
                a, b, c = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
            else:
                a, b, c = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
            middle, half = pose[axis] + a * box[0, 0] + b * box[0, 1] + c * box[0, 2], 0.0
            for edge in range(1, 4):
                half += abs(a * box[edge, 0] + b * box[edge, 1] + c * box[edge, 2])
            tight[geom, axis], tight[geom, 3 + axis] = middle - half, middle + half
            known &= half < UNKNOWN
        if not known:
            for axis in range(6):
                tight[geom, axis] = 0.0
