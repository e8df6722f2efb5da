"""Loops that change what is kept of pairs of shapes between steps.

Those are the boxes in which new links were made, and the turns of links, for the order of the pairs that they
meet first, the gaps that MuJoCo looks across, and the points of shapes whose filters changed.
"""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled

PLANE, BOX = 0, 6
"""MuJoCo's types of planes and boxes."""
FIELD = 1
"""MuJoCo's type of height fields, and of concave meshes."""
FIELD_MARGIN = 0.006
"""Margin (m) of these, each prism of which has contacts of its own."""
ENDLESS = 1e6
"""Gap (m) from which on a shape is not known."""
UNKNOWN = 1e8
"""Half size (m) from which on a box is not known."""


@compiled("i4[::1] f8[:,:,::1] f8[:,::1] i4[::1] f8[:,::1]")
def write_first_boxes(links, boxes, poses, leaves, bounds):  # pragma: no cover
    """Write boxes parallel to the world's axes around the new links of bodies where these were made.

    links: (n,) of the bodies, as MuJoCo's bodies. boxes: (n, 5, 3) as of `ShapeForms.covers`, but in the
    bases' frames (m). poses: (n, 7) place (m) and quaternion (x, y, z, w), of any length, of the base of
    each. leaves: (nbody,) below 0 for new links. bounds: (nbody, 6) least and largest coordinates (m),
    written where they are known.
    """
    for k in range(links.shape[0]):
        link = links[k]
        if leaves[link] >= 0:
            continue
        box, pose, known = boxes[k], poses[k], True
        x, y, z, w = pose[3], pose[4], pose[5], pose[6]
        size = np.sqrt(x * x + y * y + z * z + w * w)
        x, y, z, w = x / size, y / size, z / size, w / size
        for axis in range(3):
            if axis == 0:
                a, b, c = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
            elif axis == 1:
                a, b, c = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
            else:
                a, b, c = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
            middle, half = pose[axis] + a * box[0, 0] + b * box[0, 1] + c * box[0, 2], box[4, axis]
            for edge in range(1, 4):
                half += abs(a * box[edge, 0] + b * box[edge, 1] + c * box[edge, 2])
            bounds[link, axis], bounds[link, 3 + axis] = middle - half, middle + half
            known &= half < UNKNOWN
        if not known:
            bounds[link, 0], bounds[link, 3] = 1.0, 0.0


@compiled("i4[::1] i8 i4[::1] i8 i4[::1] i4[:,::1] i8 i8 i4[::1] i4[::1] i4[::1] i4[::1]")
def write_turns(  # pragma: no cover
    links, count, refreshed, again, leaves, ties, entry, first, shapes, geom_body, of_links, of_geoms
):
    """Write the turns in which links enter the broad phase, also those that do so in the next step.

    links: in order, `count` of them. refreshed: those that leave it and enter it again, `again` of them.
    leaves: (nbody,) of links, below 0 for new ones. ties: of the leaves, with their turns in column `entry`.
    first: turn of the next link that enters. shapes: (k,) geoms that are written. geom_body: (ngeom,) link of
    each. of_links: (nbody,) and of_geoms: (ngeom,) turns, written.
    """
    for k in range(count):
        link = links[k]
        if leaves[link] >= 0:
            of_links[link] = ties[leaves[link], entry]
        else:
            of_links[link] = first
            first += 1
    for k in range(again):
        of_links[refreshed[k]] = first + k
    for k in range(shapes.shape[0]):
        of_geoms[shapes[k]] = of_links[geom_body[shapes[k]]]


@compiled("i4[::1] i4[::1] f8[::1] f8[::1] f8 f8 f8[::1] f8[::1] f8[::1]")
def write_seen_gaps(  # pragma: no cover
    geom_type, geom_body, margins, reaches, box_margin, most, geom_margin, geom_gap, body_margin
):
    """Let MuJoCo find contacts across all gaps at which they push.

    It looks as far as the sum of both shapes' margins. margins: (ngeom,) widths by which surfaces lie outside
    MuJoCo's shapes. reaches: (ngeom,) largest gaps (m). box_margin: the margin (m) of boxes, which do not
    push each other across gaps, and of unknown shapes. most: margin of planes, and largest of others (m).
    geom_margin, body_margin: MuJoCo's, written. geom_gap: MuJoCo's.
    """
    for body in range(body_margin.shape[0]):
        body_margin[body] = 0.0
    for geom in range(geom_type.shape[0]):
        if geom_type[geom] == PLANE:
            geom_margin[geom] = most
        elif geom_type[geom] == BOX or reaches[geom] > ENDLESS:
            geom_margin[geom] = box_margin
        elif geom_type[geom] == FIELD:
            geom_margin[geom] = FIELD_MARGIN
        else:
            geom_margin[geom] = min(reaches[geom] + margins[geom] + box_margin, most)
        body = geom_body[geom]
        body_margin[body] = max(body_margin[body], geom_margin[geom] + geom_gap[geom])


@compiled("i8[:,::1] i4[:,::1] f8[:,:,:,::1] i4[::1] i8 i8 i8 i8 -> i8")
def end_points(keys, counts, points, ages, table, count, first, stop):  # pragma: no cover
    """Remove the points of pairs one of whose geoms is in a range of the order of creation.

    keys, counts, points, ages: as of `Points`, of which `count` pairs in this table have points. Returns how
    many pairs are left; they stay in order.
    """
    geoms, left = ages.shape[0], 0
    for k in range(count):
        a, b = ages[keys[table, k] // geoms], ages[keys[table, k] % geoms]
        if first <= a < stop or first <= b < stop:
            continue
        if left < k:
            keys[table, left], counts[table, left] = keys[table, k], counts[table, k]
            for m in range(points.shape[2]):
                for j in range(points.shape[3]):
                    points[table, left, m, j] = points[table, k, m, j]
        left += 1
    return left
