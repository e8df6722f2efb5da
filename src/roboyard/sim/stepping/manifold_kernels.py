"""Compiled loops over the contact points that pairs of convex shapes keep from step to step."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.sim.stepping.broad_phase.link_boxes import half_size, turned
from roboyard.sim.stepping.face_corners import ORDER, order_corners
from roboyard.sim.stepping.impulses.slide_directions import comes_second
from roboyard.sim.stepping.narrow_phase.closest_points import FIRST, SECOND
from roboyard.sim.stepping.narrow_phase.edge_kernels import write_core
from roboyard.sim.stepping.narrow_phase.field_kernels import (
    FIELDS,
    POINT,
    is_beyond,
    is_searched,
    on_triangle,
    radius_around,
    write_point,
)
from roboyard.sim.stepping.narrow_phase.field_triangles import PLACE, begin, next_triangle
from roboyard.sim.stepping.step_row_kernels import CONTACTS

PLANE, FIELD, SPHERE, BOX = 0, 1, 2, 6
"""MuJoCo's types of these geoms."""
TOUCHING = 1e-14
"""Gap (m) up to which boxes that are turned to each other touch; see `are_apart_boxes`."""
MOST = 4
"""Most points of a pair."""
AWAY = 1.0
"""Distance (m) of contacts that do not count."""
ALMOST = 1.0 - 1e-9
"""Share of its bound at which friction counts as at it."""
UNMOVED = 1e-14
"""Square of the shift (m) below which a contact stays."""
APART = 1e-12
"""Depth (m) up to which two spheres are apart, as those that a file lets touch are but for rounding."""
LEVEL = 1e-13
"""Slope up to which points of a body are as deep as each other."""
HELD_FAST, TAKEN, TAKEN_AND_HELD = 1.0, 2.0, 3.0
"""Marks of a point that did not slide in the step before, of one that a contact of this step has, of both."""


@compiled(
    CONTACTS,
    "i8 u1[:,::1] i4[::1] i4[::1] f8[:,:] f8[:,:] f8[::1] f8[::1] u1[::1] f8 i8 i8[::1] i4[::1]",
    "f8[:,:,::1] i8[::1] i4[::1] f8[:,:,::1] f8[::1] i4[::1] f8[:,::1] i4[::1] i8[::1] f8[:,:,::1] u1[::1]"
    " i4[::1] f8[::1] f8[:,::1] i4[:,::1]",
    FIELDS,
    " -> i8",
)
def keep_points(  # pragma: no cover
    contacts, contact_count, kept_kinds, geom_type, geom_body, xpos, xmat, margins, reaches, anchors, seen,
    before, keys, counts, points, new_keys, new_counts, new_points, fresh, source, extra, slots, ends,
    boxes, compound, ages, rounding, hulls, spans, fields,
):  # fmt: skip
    """Add this step's contacts to the points of their pairs; return the number of points besides them.

    A pair, whose contacts come one after another, keeps up to four points. A contact replaces the point
    within the pair's reach of it on the body that Bullet lists first, or is added; points end where the
    surfaces have parted, or slid along each other, by more than the reach. Where a surface has anchors, a
    point that did not slide in the step before is not replaced: the contact is moved to it.

    contacts: MuJoCo's, of which the first contact_count are this step's. kept_kinds: (8, 8) 1 for the pairs
    of geom types that keep points. xpos: (nbody, 3), xmat: (nbody, 9). margins, reaches: (ngeom,) as of
    `hard_contacts`. anchors: (ngeom,) 1 for surfaces with anchors. seen: gap (m) up to which MuJoCo finds
    contacts. before: number of pairs in the step before, with keys: (n,), counts: (n,) and points:
    (n, 4, 17), the places in the frames of the two bodies, the contact frame, 1 where it did not slide, and
    the gap (m).
    new_...: those of this step, written. fresh: work array. source: (4 ncon,) contact of which each
    extra point is a copy, extra: (4 ncon, 13) its position, frame and distance, written. slots: (5 ncon,)
    place of each contact's point in the table as 4 n + m, -1 for none, written. ends: (4,), number of pairs
    and, as the last, of contacts moved, written. boxes, compound: as of `ShapeForms`. ages: (ngeom,) turns in
    which geoms were made. rounding, hulls, spans: as of `place_contacts`. fields: height fields; the points
    of shapes on them are found here, and MuJoCo's contacts are rewritten as the points that are kept.
    """
    geom, position, frame, dist = contacts.geom, contacts.position, contacts.frame, contacts.dist
    pairs = 0
    found = 0
    at = 0
    geoms = geom_type.shape[0]
    held = 0
    i = 0
    while i < contact_count:
        a, b = geom[i, 0], geom[i, 1]
        first = i
        while i < contact_count and geom[i, 0] == a and geom[i, 1] == b:
            slots[i] = -1
            i += 1
        if a < 0 or b < 0:
            continue
        is_anchored = anchors[a] == 1 or anchors[b] == 1
        on_field = geom_type[a] == FIELD or geom_type[b] == FIELD
        if kept_kinds[geom_type[a], geom_type[b]] == 0 and (on_field or not is_anchored):
            continue
        key = a * geoms + b
        one, two = geom_body[a], geom_body[b]
        is_own = is_searched(fields, geom_type, boxes, spans, a, b)
        reach = min(reaches[a], reaches[b])
        if not is_own:
            reach = min(reach, seen)
        thickness = margins[a] + margins[b]
        widths = margins[a], margins[b]
        n = 0
        for k in range(before):
            row = at + k if at + k < before else at + k - before
            if keys[row] == key:
                n = counts[row]
                for m in range(n):
                    copy_point(points, row, m, new_points, pairs, m)
                at = row + 1 if row + 1 < before else 0
                break
        if boxes.shape[0] > 0 and (compound[a] > 0 or compound[b] > 0):
            are_apart = not on_field  # whose contacts are found again
            for j in range(first, i):
                are_apart &= dist[j] == AWAY
            n = 0 if are_apart else refresh(new_points, pairs, n, xpos, xmat, one, two, widths, reach)
        are_boxes = geom_type[a] == BOX and geom_type[b] == BOX  # they begin to touch without a gap
        side_a = 3 if boxes.shape[0] > 0 and comes_second(geom_type, compound, ages, a, b) else 0
        takes_new = are_boxes or on_field  # of a step's points one may replace another
        if is_own:
            n = find_on_field(
                fields, geom_type, geom_body, xpos, xmat, boxes, rounding, hulls, spans, a, b, widths, reach,
                side_a, is_anchored, new_points, pairs, n, fresh,
            )  # fmt: skip
        only = -1  # of the points on a plane, Bullet finds the deepest in each step
        if geom_type[a] == PLANE or geom_type[b] == PLANE:
            only = first  # where `place_contacts` puts the first corner of a hull
            if boxes.shape[0] == 0 or spans[a, 1] + spans[b, 1] == 0:
                only = deepest(contacts, first, i, geom_type, geom_body, xpos, xmat)
        in_turn = are_boxes and boxes.shape[0] > 0 and i - first > 1
        listed = i - first
        if in_turn:
            first_box, second_box = (b, a) if side_a == 3 else (a, b)
            listed = order_corners(
                contacts, first, i, first_box, second_box, boxes, geom_body, xpos, xmat, thickness, fresh
            )
            if listed < i - first:
                leave_listed(dist, first, i, listed, fresh)
        for m in range(first, first if is_own else first + listed):
            j = first + int(fresh[ORDER + m - first]) if in_turn else m
            if dist[j] - thickness > reach:
                if on_field:
                    dist[j] = AWAY
                continue
            for k in range(3):
                fresh[k] = fresh[3 + k] = 0.0
                for d in range(3):  # on the surfaces, which lie outside MuJoCo's
                    inner, outer = margins[a] - 0.5 * dist[j], margins[b] - 0.5 * dist[j]
                    x = position[j, d] + inner * frame[j, d] - xpos[one, d]
                    fresh[k] += xmat[one, 3 * d + k] * x
                    x = position[j, d] - outer * frame[j, d] - xpos[two, d]
                    fresh[3 + k] += xmat[two, 3 * d + k] * x
            for k in range(9):
                fresh[6 + k] = frame[j, k]
            place = place_of(new_points, pairs, n, fresh, reach, side_a, takes_new)
            mark = TAKEN
            is_gap = are_boxes and are_apart_boxes(dist[j] - thickness, xmat, one, two)
            if place < 0 and (0 <= only != j or is_gap):
                dist[j] = AWAY
                continue
            if place < 0:
                if n < MOST:
                    place = n
                    n += 1
                else:
                    place = least_useful(new_points, pairs, fresh, dist[j], side_a, takes_new)
                    if place < 0:
                        continue
            elif 0 <= only != j:
                gap, slid = located(new_points, pairs, place, xpos, xmat, one, two, widths)[:2]
                if gap - thickness > reach or slid > reach * reach:
                    dist[j] = AWAY
                    continue
                side, body = (3, two) if geom_type[a] == PLANE else (0, one)
                away = 0.0
                for d in range(3):  # the point of the body, across half the gap
                    half = 0.5 * gap - widths[0] if side == 0 else widths[1] - 0.5 * gap
                    x = xpos[body, d] + half * frame[j, d]
                    for k in range(3):
                        x += xmat[body, 3 * d + k] * new_points[pairs, place, side + k]
                    away += (position[j, d] - x) ** 2
                    fresh[d] = x
                if away > UNMOVED:
                    for d in range(3):
                        position[j, d] = fresh[d]
                    dist[j] = gap
                    held += 1
                for k in range(15):
                    fresh[k] = new_points[pairs, place, k]
            elif is_gap:  # only refreshed where they overlap
                gap, slid, x, y, z = located(new_points, pairs, place, xpos, xmat, one, two, widths)
                if new_points[pairs, place, 15] >= TAKEN or gap - thickness > reach or slid > reach * reach:
                    dist[j] = AWAY
                    continue
                if (position[j, 0] - x) ** 2 + (position[j, 1] - y) ** 2 + (
                    position[j, 2] - z
                ) ** 2 > UNMOVED:
                    position[j, 0], position[j, 1], position[j, 2] = x, y, z
                    for k in range(9):
                        frame[j, k] = new_points[pairs, place, 6 + k]
                    dist[j] = gap
                    held += 1
                for k in range(15):
                    fresh[k] = new_points[pairs, place, k]
            elif is_anchored and is_held(new_points, pairs, place):
                gap, slid, x, y, z = located(new_points, pairs, place, xpos, xmat, one, two, widths)
                if gap - thickness <= reach and slid <= reach * reach:
                    for k in range(3):
                        fresh[k], fresh[3 + k] = new_points[pairs, place, k], new_points[pairs, place, 3 + k]
                    for k in range(9):
                        fresh[6 + k] = frame[j, k] = new_points[pairs, place, 6 + k]
                    position[j, 0], position[j, 1], position[j, 2] = x, y, z
                    dist[j] = gap
                    held += 1
                    mark = TAKEN_AND_HELD
            if takes_new:
                leave(dist, slots, first, i, place)
            for k in range(15):
                new_points[pairs, place, k] = fresh[k]
            new_points[pairs, place, 15], new_points[pairs, place, 16] = mark, dist[j]
            slots[j] = place
        for m in range(n - 1, -1, -1):
            if new_points[pairs, m, 15] >= TAKEN:
                continue
            gap, slid = located(new_points, pairs, m, xpos, xmat, one, two, widths)[:2]
            new_points[pairs, m, 16] = gap
            if gap - thickness > reach or slid > reach * reach:
                n -= 1
                copy_point(new_points, pairs, n, new_points, pairs, m)
                for j in range(first, i):
                    if slots[j] == n:
                        slots[j] = m
        shown = 0
        for m in range(n):
            is_new = new_points[pairs, m, 15] >= TAKEN
            new_points[pairs, m, 15] = 0.0
            if is_new and not is_own:
                continue
            gap, slid, x, y, z = located(new_points, pairs, m, xpos, xmat, one, two, widths)
            if is_own and first + shown < i:
                j = first + shown
                shown += 1
                held += 1
                position[j, 0], position[j, 1], position[j, 2], dist[j] = x, y, z, gap
                for k in range(9):
                    frame[j, k] = new_points[pairs, m, 6 + k]
                contacts.exclude[j], slots[j] = 0, m
                continue
            source[found] = first
            extra[found, 0], extra[found, 1], extra[found, 2] = x, y, z
            for k in range(9):
                extra[found, 3 + k] = new_points[pairs, m, 6 + k]
            extra[found, 12] = gap
            slots[contact_count + found] = MOST * pairs + m
            found += 1
        for j in range(first + shown, i if is_own else first):
            held += 1 if contacts.exclude[j] == 0 else 0
            dist[j], contacts.exclude[j], contacts.address[j] = AWAY, 1, -1
        for j in range(first, i):
            if slots[j] >= 0:
                slots[j] += MOST * pairs
        if n > 0:
            new_keys[pairs] = key
            new_counts[pairs] = n
            pairs += 1
    ends[0], ends[3] = pairs, held
    return found


def find_on_field(
    fields, geom_type, geom_body, xpos, xmat, boxes, rounding, hulls, spans, field, shape, widths, reach,
    side, is_anchored, points, pair, n, work,
):  # fmt: skip
    """Add the points of a shape with the triangles of a height field or a mesh to those that a pair keeps.

    widths: by which their surfaces lie outside MuJoCo's (m). side: as of `place_of`.
    work: array to work in. The other arguments are those of `keep_points`.

    Returns:
        The number of points.
    """
    kind, one, two = geom_type[shape], geom_body[field], geom_body[shape]
    margin = begin(fields, field, geom_type, two, xpos, xmat, boxes, shape, 0.0, work)
    if work[PLACE] < 0.0:
        return n
    if kind == SPHERE:
        margin = 0.0
    write_core(geom_type, geom_body, xpos, xmat, boxes, rounding, shape, work, FIRST)
    work[SECOND + 15] = margin
    thickness, round_off = widths[0] + widths[1], work[FIRST + 15] + margin
    far = reach + thickness + round_off
    radius, around = radius_around(kind, shape, hulls, spans, work), reach + thickness + margin
    fresh = work[POINT:]
    while next_triangle(fields, field, work):
        if is_beyond(work, radius, around):
            continue
        apart, is_known = on_triangle(kind, shape, field, hulls, spans, far, work)
        gap = apart - round_off
        if not is_known or gap - thickness > reach:
            continue
        write_point(xpos, xmat, one, two, widths, work)
        n = add_point(points, pair, n, fresh, gap, reach, side, is_anchored)
    return n


def add_point(points, pair, n, fresh, gap, reach, side, is_anchored):
    """Add a new point to the n of a pair, or let it take the place of one; return how many there are.

    Points that friction holds stay where a surface has anchors.
    """
    place = place_of(points, pair, n, fresh, reach, side, True)
    if place >= 0 and is_anchored and is_held(points, pair, place):
        points[pair, place, 15] = TAKEN_AND_HELD
        return n
    if place < 0:
        if n < MOST:
            place = n
            n += 1
        else:
            place = least_useful(points, pair, fresh, gap, side, True)
            if place < 0:
                return n
    for k in range(15):
        points[pair, place, k] = fresh[k]
    points[pair, place, 15], points[pair, place, 16] = TAKEN, gap
    return n


def note_slips(contacts, contact_count, slots, force, points):
    """Note for each point kept whether friction held it in this step. points: (n, 4, 17) of this step.

    Bullet cuts friction at its bound by an angle's sine and cosine and holds the points whose friction is not
    above the bound then. Rounding decides: of points that slide, it holds three of four.
    """
    for i in range(contact_count):
        row = contacts.address[i]
        if slots[i] < 0 or contacts.dim[i] < 3:
            continue
        if row < 0:  # across a gap
            points[slots[i] // MOST, slots[i] % MOST, 15] = 1.0
            continue
        bound = contacts.friction[i, 0] * force[row]
        x, y = force[row + 1], force[row + 2]
        slides = x * x + y * y > ALMOST * ALMOST * bound * bound
        if slides and bound > 0.0:
            angle = np.arctan2(x, y)
            x, y = bound * np.sin(angle), bound * np.cos(angle)
            slides = x * x + y * y > bound * bound
        points[slots[i] // MOST, slots[i] % MOST, 15] = 0.0 if slides else 1.0


def pull_to_anchors(contacts, contact_count, slots, points, anchors, geom_body, xpos, xmat, pull, base):
    """Write the sliding velocities for which contacts ask: 0, or a pull back of what has slid at an anchor.

    pull: share of the slide in a step over the time step. base: (nefc,) or more, rows of friction written.
    """
    for i in range(contact_count):
        row, a, b = contacts.address[i], contacts.geom[i, 0], contacts.geom[i, 1]
        if row < 0 or a < 0 or b < 0:
            continue
        for k in range(1, contacts.dim[i]):
            base[row + k] = 0.0
        if slots[i] < 0 or contacts.dim[i] < 3 or (anchors[a] == 0 and anchors[b] == 0):
            continue
        pair, m, one, two = slots[i] // MOST, slots[i] % MOST, geom_body[a], geom_body[b]
        for d in range(3):
            slid = xpos[two, d] - xpos[one, d]
            for k in range(3):
                slid += xmat[two, 3 * d + k] * points[pair, m, 3 + k]
                slid -= xmat[one, 3 * d + k] * points[pair, m, k]
            base[row + 1] -= pull * slid * contacts.frame[i, 3 + d]
            base[row + 2] -= pull * slid * contacts.frame[i, 6 + d]


@compiled(CONTACTS, "i8 i4[::1] i4[::1] f8[:,:] f8[:,:] f8[::1] f8[:,:,::1] u1[::1] i8")
def drop_gaps(  # pragma: no cover
    contacts, contact_count, geom_type, geom_body, xpos, xmat, margins, parts, compound, boxes_keep
):
    """Move contacts away across whose gaps an impulse engine does not look.

    It finds no points of two boxes or two spheres apart from each other, which spheres are that touch, nor
    those of a compound's part whose box, parallel to the world's axes, is apart from the other shape's.

    margins: (ngeom,) as of `hard_contacts`. parts: (ngeom, 5, 3) boxes in the frames of the bodies, as of
    `place_box` (m). compound: (ngeom,) above 0 for parts of compounds. boxes_keep: 1 where `keep_points`
    follows, which does the same for two boxes but for points that they have kept.
    """
    for i in range(contact_count):
        a, b = contacts.geom[i, 0], contacts.geom[i, 1]
        if a < 0 or b < 0:
            continue
        gap = contacts.dist[i] - margins[a] - margins[b]
        if gap <= (-APART if geom_type[a] == SPHERE and geom_type[b] == SPHERE else 0.0):
            continue
        if geom_type[a] == geom_type[b] and (
            geom_type[a] == SPHERE or (geom_type[a] == BOX and boxes_keep == 0)
        ):
            contacts.dist[i] = AWAY
        elif compound[a] > 0 or compound[b] > 0:
            one, two = geom_body[a], geom_body[b]
            for d in range(3):
                apart = xpos[one, d] + turned(xmat, one, d, parts, a, 0)
                apart -= xpos[two, d] + turned(xmat, two, d, parts, b, 0)
                if abs(apart) > half_size(xmat, one, d, parts, a) + half_size(xmat, two, d, parts, b):
                    contacts.dist[i] = AWAY


def are_apart_boxes(gap, xmat, one, two):
    """Return whether two boxes of these bodies do not touch across a gap (m).

    Bullet adds up the sizes of one box along the axes of the other, in magnitude, so that what is left of a
    turn about their common normal by rounding makes boxes overlap that touch exactly.
    """
    if gap > TOUCHING:
        return True
    if gap <= 0.0:
        return False
    for i in range(3):
        for j in range(3):
            along = 0.0
            for k in range(3):
                along += xmat[one, 3 * k + i] * xmat[two, 3 * k + j]
            if i != j and along != 0.0:
                return False
    return True


def leave_listed(dist, first, end, listed, work):
    """Move the contacts first ... end away that are not among the first of the order."""
    for j in range(first, end):
        left = False
        for k in range(listed):
            left |= work[ORDER + k] == j - first
        if not left:
            dist[j] = AWAY


def deepest(contacts, first, end, geom_type, geom_body, xpos, xmat):
    """Return the deepest of a plane's contacts, of several the farthest along the body's axes."""
    best, least = first, 1e9
    for j in range(first, end):
        side = 1 if geom_type[contacts.geom[j, 0]] == PLANE else 0
        body = geom_body[contacts.geom[j, side]]
        depth = contacts.dist[j]
        for axis in range(3):
            for k in range(3):
                apart = contacts.position[j, k] - xpos[body, k]
                depth -= LEVEL / (1 + axis) * xmat[body, 3 * k + axis] * apart
        if depth < least:
            best, least = j, depth
    return best


def refresh(points, pair, n, xpos, xmat, one, two, widths, reach):
    """Note the gaps that points have now, and remove those that end; return how many are left.

    Bullet does so before it adds those of a step where a shape is a compound, afterwards for all.
    """
    for m in range(n - 1, -1, -1):
        gap, slid = located(points, pair, m, xpos, xmat, one, two, widths)[:2]
        points[pair, m, 16] = gap
        if gap - widths[0] - widths[1] > reach or slid > reach * reach:
            n -= 1
            copy_point(points, pair, n, points, pair, m)
    return n


def copy_point(points, pair, m, others, other_pair, other_m):
    """Write a point over another."""
    for k in range(17):
        others[other_pair, other_m, k] = points[pair, m, k]


def is_held(points, pair, m):
    """Return whether a point did not slide in the step before, as far as it is still of that step."""
    return points[pair, m, 15] == HELD_FAST or points[pair, m, 15] == TAKEN_AND_HELD


def leave(dist, slots, first, end, place):
    """Move the contact first ... end away, if any, whose point another of this step takes."""
    for j in range(first, end):
        if slots[j] == place:
            slots[j] = -1
            dist[j] = AWAY


def place_of(points, pair, n, fresh, reach, side, takes_new):
    """Return the point (of n) nearest to a new one on a body, within reach; else -1.

    side: 0 for the first body, 3 for the second. takes_new: whether points of this step may be taken, too.
    """
    best = -1
    least = reach * reach
    for m in range(n):
        if points[pair, m, 15] >= TAKEN and not takes_new:
            continue
        far = 0.0
        for k in range(side, side + 3):
            far += (points[pair, m, k] - fresh[k]) ** 2
        if far < least:
            least = far
            best = m
    return best


def least_useful(points, pair, fresh, dist, side, takes_new):
    """Return the point of four that a new one replaces: not the deepest, so that the rest spans most area.

    -1: all but the deepest are taken. side, takes_new: as of `place_of`.
    """
    deepest = -1
    depth = dist
    for m in range(MOST):
        if points[pair, m, 16] < depth:  # of points of earlier steps the gap that they had then, as in Bullet
            depth = points[pair, m, 16]
            deepest = m
    best = -1
    largest = -1.0
    for m in range(MOST):
        if m == deepest or (points[pair, m, 15] >= TAKEN and not takes_new):
            continue
        first = 1 if m == 0 else 0
        last = 2 if m == 3 else 3
        second = 1 if m > 1 else 2
        x1 = fresh[side] - points[pair, first, side]
        y1 = fresh[side + 1] - points[pair, first, side + 1]
        z1 = fresh[side + 2] - points[pair, first, side + 2]
        x2 = points[pair, last, side] - points[pair, second, side]
        y2 = points[pair, last, side + 1] - points[pair, second, side + 1]
        z2 = points[pair, last, side + 2] - points[pair, second, side + 2]
        area = (y1 * z2 - z1 * y2) ** 2 + (z1 * x2 - x1 * z2) ** 2 + (x1 * y2 - y1 * x2) ** 2
        if area > largest:
            largest = area
            best = m
    return best


def located(points, pair, m, xpos, xmat, one, two, widths):
    """Return a kept point's gap (m), the square of how far it slid (m²), and its middle in the world (m).

    Gap and middle are those of MuJoCo's shapes, outside of which the surfaces lie by the widths (m).
    """
    px, py, pz = points[pair, m, 0], points[pair, m, 1], points[pair, m, 2]
    qx, qy, qz = points[pair, m, 3], points[pair, m, 4], points[pair, m, 5]
    nx, ny, nz = points[pair, m, 6], points[pair, m, 7], points[pair, m, 8]
    ax = xpos[one, 0] + xmat[one, 0] * px + xmat[one, 1] * py + xmat[one, 2] * pz
    ay = xpos[one, 1] + xmat[one, 3] * px + xmat[one, 4] * py + xmat[one, 5] * pz
    az = xpos[one, 2] + xmat[one, 6] * px + xmat[one, 7] * py + xmat[one, 8] * pz
    bx = xpos[two, 0] + xmat[two, 0] * qx + xmat[two, 1] * qy + xmat[two, 2] * qz
    by = xpos[two, 1] + xmat[two, 3] * qx + xmat[two, 4] * qy + xmat[two, 5] * qz
    bz = xpos[two, 2] + xmat[two, 6] * qx + xmat[two, 7] * qy + xmat[two, 8] * qz
    gap = (bx - ax) * nx + (by - ay) * ny + (bz - az) * nz
    sx, sy, sz = bx - ax - gap * nx, by - ay - gap * ny, bz - az - gap * nz
    slid = sx * sx + sy * sy + sz * sz
    shift = 0.5 * (widths[1] - widths[0])
    x, y, z = 0.5 * (ax + bx) + shift * nx, 0.5 * (ay + by) + shift * ny, 0.5 * (az + bz) + shift * nz
    return gap + widths[0] + widths[1], slid, x, y, z


@compiled(CONTACTS, "i8 i8 f8[:,::1]")
def write_points(contacts, contact_count, count, extra):  # pragma: no cover
    """Write kept points over the last `count` contacts, which are copies of others."""
    position, frame, dist = contacts.position, contacts.frame, contacts.dist
    first = contact_count - count
    for n in range(count):
        for k in range(3):
            position[first + n, k] = extra[n, k]
        for k in range(9):
            frame[first + n, k] = extra[n, 3 + k]
        dist[first + n] = extra[n, 12]


@compiled("i4[::1] i8 i8 i8 i4[::1]")
def copy_contacts(words, size, contact_count, count, source):  # pragma: no cover
    """Write copies of contacts over the last `count` ones.

    words: MuJoCo's block in words of four bytes. size: words of a contact. source: contact of which each one
    is a copy.
    """
    for n in range(count):
        to, place = (contact_count - count + n) * size, source[n] * size
        for k in range(size):
            words[to + k] = words[place + k]
