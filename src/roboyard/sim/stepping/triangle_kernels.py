"""Compiled loops of triangle windows: triangles that are near, and prisms."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled

FACING = 0.7
"""Cosine between a contact's normal and its triangle's from which the contact is on the face."""


@compiled(
    "i8[:] i4[:] i4[:] f8[:,:] f8[:,:] f8[:,:] f8[:] f8[:] f8 "
    "f8[:,:] f8[:,:] i4[:] f8[:,:,:] i8[:] i8 i4[:] i8[:] f8[:,:] -> f8"
)
def near_triangles(  # pragma: no cover
    movers,
    contype,
    conaffinity,
    aabb,
    xpos,
    xmat,
    place,
    turn,
    reach,
    lower,
    upper,
    first,
    corners,
    seen,
    mark,
    found,
    stack,
    m,
):
    """Write the triangles within the boxes of some geoms to `found`; return their number.

    movers: (k,) geoms; those without collisions are skipped. aabb: (ngeom, 6) centre and half size of each
    geom's box. place, turn: (3,), (9,) pose of the window's link. reach: enlargement of the boxes (m).
    lower, upper, first, corners: those of a TriangleTree. seen: (t,) int64 marks of earlier calls, all below
    `mark`. found: (t,) int32. stack: (128,) int64 and m: (3, 3) to work in.
    """
    leaves = first.shape[0] - 1
    count = 0
    for g in movers:
        if contype[g] == 0 and conaffinity[g] == 0:
            continue
        r = xmat[g]
        dx = xpos[g, 0] + r[0] * aabb[g, 0] + r[1] * aabb[g, 1] + r[2] * aabb[g, 2] - place[0]
        dy = xpos[g, 1] + r[3] * aabb[g, 0] + r[4] * aabb[g, 1] + r[5] * aabb[g, 2] - place[1]
        dz = xpos[g, 2] + r[6] * aabb[g, 0] + r[7] * aabb[g, 1] + r[8] * aabb[g, 2] - place[2]
        cx = turn[0] * dx + turn[3] * dy + turn[6] * dz
        cy = turn[1] * dx + turn[4] * dy + turn[7] * dz
        cz = turn[2] * dx + turn[5] * dy + turn[8] * dz
        for i in range(3):
            for j in range(3):
                m[i, j] = turn[i] * r[j] + turn[3 + i] * r[3 + j] + turn[6 + i] * r[6 + j]
        sx, sy, sz = aabb[g, 3] + reach, aabb[g, 4] + reach, aabb[g, 5] + reach
        hx = abs(m[0, 0]) * sx + abs(m[0, 1]) * sy + abs(m[0, 2]) * sz
        hy = abs(m[1, 0]) * sx + abs(m[1, 1]) * sy + abs(m[1, 2]) * sz
        hz = abs(m[2, 0]) * sx + abs(m[2, 1]) * sy + abs(m[2, 2]) * sz
        size = 1
        stack[0] = 0
        while size:
            size -= 1
            node = stack[size]
            if (
                lower[node, 0] > cx + hx or upper[node, 0] < cx - hx
                or lower[node, 1] > cy + hy or upper[node, 1] < cy - hy
                or lower[node, 2] > cz + hz or upper[node, 2] < cz - hz
            ):  # fmt: skip
                continue
            if node < leaves - 1:
                stack[size], stack[size + 1] = 2 * node + 1, 2 * node + 2
                size += 2
                continue
            for t in range(first[node - leaves + 1], first[node - leaves + 2]):
                if seen[t] != mark and _overlaps(corners[t], m, cx, cy, cz, sx, sy, sz):
                    seen[t] = mark
                    found[count] = t
                    count += 1
    return count


def _overlaps(corners, m, cx, cy, cz, sx, sy, sz):  # pragma: no cover
    """Whether a triangle's box along the axes of a turned box (columns of m) overlaps it."""
    for axis in range(3):
        low, high = np.inf, -np.inf
        for k in range(3):
            x, y, z = corners[k, 0] - cx, corners[k, 1] - cy, corners[k, 2] - cz
            v = m[0, axis] * x + m[1, axis] * y + m[2, axis] * z
            low, high = min(low, v), max(high, v)
        half = sx if axis == 0 else sy if axis == 1 else sz
        if low > half or high < -half:
            return False
    return True


@compiled("i4[:] i8 i4[:] i4[:] i8[:] i8 i4[:] -> f8")
def assign_slots(found, count, slot_of, triangle_of, kept, mark, changed):  # pragma: no cover
    """Give the first `count` found triangles a slot each; return the number of slots that changed.

    slot_of: (t,) slot of each triangle, -1 for none. triangle_of: (s,) triangle of each slot. kept: (s,)
    int64 marks, below `mark` or equal for slots in use. changed: (s,) receives the changed slots. Slots of
    triangles that are not near keep them until needed.
    """
    slots = triangle_of.shape[0]
    for i in range(min(count, slots)):
        if slot_of[found[i]] >= 0:
            kept[slot_of[found[i]]] = mark
    number, free = 0, 0
    for i in range(min(count, slots)):
        t = found[i]
        if slot_of[t] >= 0:
            continue
        while free < slots and kept[free] == mark:
            free += 1
        if free == slots:
            break
        if triangle_of[free] >= 0:
            slot_of[triangle_of[free]] = -1
        slot_of[t], triangle_of[free], kept[free] = free, t, mark
        changed[number] = free
        number += 1
    return number


@compiled(
    "i4[:] i4[:] i4[:] f8 f8[:,:,:] f8[:,:] f8[:,:] f8[:,:] f8[:] i4[:] f4[:,:] "
    "i4[:] i4[:] i4[:] i4[:] i4[:] f8[:,:] i4[:]"
)
def write_prisms(  # pragma: no cover
    changed, triangle_of, geoms, half, corners, normals, geom_pos, aabb, radius, vert_start, vert,
    poly_start, poly_number, poly_vert_start, poly_vert_number, poly_vert, poly_normal, dataid
):  # fmt: skip
    """Move slots to their triangles: prisms of two triangles at the distance `half` from it.

    geoms: (s,) MuJoCo geom of each slot, with the axes of the link. The others are arrays of an MjModel.
    """
    for slot in changed:
        t, g = triangle_of[slot], geoms[slot]
        mesh = dataid[g]
        start = vert_start[mesh]
        for i in range(3):
            centre = (corners[t, 0, i] + corners[t, 1, i] + corners[t, 2, i]) / 3.0
            geom_pos[g, i] = centre
            low, high = np.inf, -np.inf
            for k in range(3):
                at = corners[t, k, i] - centre
                above, below = at + half * normals[t, i], at - half * normals[t, i]
                vert[start + k, i], vert[start + 3 + k, i] = above, below
                low, high = min(low, above, below), max(high, above, below)
            aabb[g, i], aabb[g, 3 + i] = 0.5 * (low + high), 0.5 * (high - low)
        largest = 0.0
        for k in range(6):
            x, y, z = vert[start + k, 0], vert[start + k, 1], vert[start + k, 2]
            largest = max(largest, x * x + y * y + z * z)
        radius[g] = np.sqrt(largest)
        for face in range(poly_start[mesh], poly_start[mesh] + poly_number[mesh]):
            p = poly_vert_start[face]
            a, b, c = (
                vert[start + poly_vert[p]],
                vert[start + poly_vert[p + 1]],
                vert[start + poly_vert[p + 2]],
            )
            nx = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
            ny = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
            nz = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            length = np.sqrt(nx * nx + ny * ny + nz * nz)
            if nx * a[0] + ny * a[1] + nz * a[2] < 0.0:
                length = -length
            if length != 0.0:
                poly_normal[face, 0] = nx / length
                poly_normal[face, 1] = ny / length
                poly_normal[face, 2] = nz / length


@compiled("i8 i8 i4[:,:] i4[:] f8[:,:] f8[:,:] f8 f8[:,:] f8[:,:]")
def refit_boxes(start, number, child, geom, geom_pos, aabb, margin, least, box):  # pragma: no cover
    """Update the boxes of a body's tree of geoms, whose children come after their parents.

    The body's inertial frame is its own frame, and its slots have its axes; other geoms keep their boxes.
    geom: (n,) geom of each node, -1 for inner nodes and geoms that keep their boxes (which are leaves).
    margin: enlargement of the boxes of slots (m). least: (2, 3) lower and upper corner that the body's box
    encloses in any case (m).
    """
    for node in range(start + number - 1, start - 1, -1):
        one, two = child[node, 0], child[node, 1]
        g = geom[node - start]
        if g >= 0:
            for i in range(3):
                box[node, i] = geom_pos[g, i] + aabb[g, i]
                box[node, 3 + i] = aabb[g, 3 + i] + margin
        elif one >= 0 or two >= 0:
            first = start + one if one >= 0 else start + two
            second = start + two if two >= 0 else first
            for i in range(3):
                low = min(box[first, i] - box[first, 3 + i], box[second, i] - box[second, 3 + i])
                high = max(box[first, i] + box[first, 3 + i], box[second, i] + box[second, 3 + i])
                box[node, i], box[node, 3 + i] = 0.5 * (low + high), 0.5 * (high - low)
    for i in range(3 if number > 0 else 0):
        low = min(box[start, i] - box[start, 3 + i], least[0, i])
        high = max(box[start, i] + box[start, 3 + i], least[1, i])
        box[start, i], box[start, 3 + i] = 0.5 * (low + high), 0.5 * (high - low)


@compiled("i4[:] i4[:] f8[:,:] f8[:,:,:] u1[:,:] f8[:] f8[:] i4[:,:] f8[:,:] f8[:]")
def correct_contacts(  # pragma: no cover
    slot_of, triangle_of, normals, sides, smooth, turn, inset, geom, frame, dist
):
    """Remove contacts with seams of a smooth surface, and measure from the triangles instead of the prisms.

    slot_of: (ngeom,) slot of this window, -1 for other geoms. A contact whose normal is in the plane of its
    triangle is with the side of a prism; where the surface continues there, its distance becomes 1 m.
    inset: (ngeom,) distance (m) by which a geom enters a prism before it touches Bullet's surface.
    """
    for i in range(geom.shape[0]):
        a, b = geom[i, 0], geom[i, 1]
        if a < 0 or b < 0:
            continue
        sign = 1.0
        g, other = a, b
        if slot_of[a] < 0:
            if slot_of[b] < 0:
                continue
            g, other, sign = b, a, -1.0
        t = triangle_of[slot_of[g]]
        x, y, z = sign * frame[i, 0], sign * frame[i, 1], sign * frame[i, 2]
        lx = turn[0] * x + turn[3] * y + turn[6] * z
        ly = turn[1] * x + turn[4] * y + turn[7] * z
        lz = turn[2] * x + turn[5] * y + turn[8] * z
        if abs(lx * normals[t, 0] + ly * normals[t, 1] + lz * normals[t, 2]) < FACING:
            best, edge = -np.inf, 0
            for k in range(3):
                along = lx * sides[t, k, 0] + ly * sides[t, k, 1] + lz * sides[t, k, 2]
                if along > best:
                    best, edge = along, k
            if smooth[t, edge]:
                dist[i] = 1.0
                continue
        dist[i] += inset[other]
