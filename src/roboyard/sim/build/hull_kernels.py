"""The convex hull of points with integer coordinates, by division and merging.

The hulls of both halves of the sorted points are joined by a band of new edges, and what the band covers is
removed. All decisions are exact. Which edge a point has first, and thereby the order in which its neighbours
are found, depends on every merge: the steps are those of Bullet's btConvexHullComputer, whose hulls have
their corners in that order.

Points are numbered in the order of their y, x and z coordinates. An edge is two directed ones, k and k ^ 1,
of which each is a row of what follows it and comes before it around its start (clockwise, seen from outside),
its end and the merge that made it.

Source:
    F. Preparata, S. Hong, Convex hulls of finite sets of points in two and three dimensions (1977); the order
    of steps is that of Bullet, btConvexHullComputer.cpp.
"""

from __future__ import annotations

from roboyard.native import compiled

NEXT, PREV, END, AGE = 0, 1, 2, 3
"""Columns of an edge."""
MIN_X, MAX_X, MIN_Y, MAX_Y = 0, 1, 2, 3
"""Columns of the extreme points of an outline: least and largest x, then y; least and largest y, then x."""
VOLUME = 0
"""Place in the work array."""
CORNER, BACK, FIRST, HEAD, TAIL, BEST, COT = 0, 1, 2, 3, 4, 5, 6
"""Columns of a band's side: where it is, the edge back from there, the first edge of the side, the first and
the last new edge at the place, the edge that it turns to next, and the cotangent of the angle: a fraction
whose second part is not negative."""
SIDE = 8
"""Number of these columns in the work array."""
AT = 2 * SIDE
"""Place in the work array of where the band came from."""
NORMAL, OUT, OVER = AT + 3, AT + 6, AT + 9
"""Places of directions where faces are in one plane: its normal, outwards, and from side to side."""
WORK = AT + 12
"""Length of the work array."""
STACK = 100
"""Rows to work in: more than parts of a hull wait at a time, thrice the bits of a number of points."""
FULL = -1
"""Answer where there were more edges than room."""


@compiled("i8[:,::1] i4[::1] i4[:,::1] i4[:,::1] i4[::1] i8[:,::1] i8[:,::1] i8[::1] i4[::1] i4[:,::1] -> i8")
def find_hull(points, given, edges, outline, firsts, tasks, parts, work, order, faces):  # pragma: no cover
    """Find the hull of points, with its corners in the order in which they are reached from the first one.

    points: (n, 3) distinct ones in order. given: (k,) point of each that was given, in order. edges: (m, 4),
    of which those of the hull are left. outline: (n, 2) next and previous point around a hull, seen along z.
    firsts: (n,) first edge of each point. tasks: (STACK, 3), parts: (STACK, 4) and work: (WORK,) to work in.
    order: (n,) the corners. faces: (2 n, 3) places of their corners in that order, outward.

    Returns:
        The number of corners; `FULL` where there were more edges than room. Beyond the last face is a -1, and
        six times the volume at VOLUME in the work array.
    """
    for k in range(edges.shape[0]):
        edges[k, NEXT], edges[k, END] = k + 2, -1
    free, age, waiting, made = 0, 0, 1, 0
    tasks[0, 0], tasks[0, 1], tasks[0, 2] = 0, given.shape[0], 0
    while waiting > 0:
        waiting -= 1
        start, end = tasks[waiting, 0], tasks[waiting, 1]
        if tasks[waiting, 2] == 1:
            made -= 1
            if parts[made, MIN_X] >= 0:
                age += 1
                free = merge(points, edges, outline, firsts, parts, made - 1, free, age, work)
        elif end - start < 3:
            free = start_hull(points, given, start, end, edges, outline, firsts, parts, made, free)
            made += 1
        else:
            middle = start + (end - start) // 2
            after = middle
            while after < end and given[after] == given[middle - 1]:
                after += 1
            tasks[waiting, 2] = 1
            tasks[waiting + 1, 0], tasks[waiting + 1, 1], tasks[waiting + 1, 2] = after, end, 0
            tasks[waiting + 2, 0], tasks[waiting + 2, 1], tasks[waiting + 2, 2] = start, middle, 0
            waiting += 3
        if free < 0:
            return FULL
    count = follow_edges(edges, firsts, parts[0, MIN_X], outline, order)
    work[VOLUME] = write_faces(points, edges, firsts, outline, order, count, faces)
    return count


def follow_edges(edges, firsts, corner, seen, order):  # pragma: no cover
    """Write the points that edges lead to in the order in which they are reached; return their number.

    seen: (n, 2), of which the first column becomes the place of each corner in that order.
    """
    for k in range(seen.shape[0]):
        seen[k, 0] = -1
    order[0], seen[corner, 0] = corner, 0
    count, at = 1, 0
    while at < count:
        first = edge = firsts[order[at]]
        while edge >= 0:
            end = edges[edge, END]
            if seen[end, 0] < 0:
                order[count], seen[end, 0] = end, count
                count += 1
            edge = edges[edge, NEXT]
            if edge == first:
                break
        at += 1
    return count


def write_faces(points, edges, firsts, places, order, count, faces):  # pragma: no cover
    """Write the triangles of all faces, with the places of their corners; return six times the volume.

    places: (n, 2) place of each corner, and room for the corners of a face. Edges are marked with -1.
    """
    written, volume = 0, 0
    for k in range(count):
        first = edge = firsts[order[k]]
        while edge >= 0:
            corners = 0
            while edges[edge, AGE] >= 0:
                edges[edge, AGE] = -1
                places[corners, 1] = places[edges[edge, END], 0]
                corners += 1
                edge = edges[edge ^ 1, PREV]
            before = written
            written = write_triangles(places, corners, written, faces)
            for n in range(before, written):
                volume += determinant(points, order, faces, n)
            edge = edges[edge, NEXT]
            if edge == first:
                break
    faces[written, 0] = -1
    return volume


def write_triangles(places, corners, written, faces):  # pragma: no cover
    """Write the triangles of a face; return how many there are then.

    There is one in the middle, so that a ray along the axis of a prism of many sides meets no edge.
    """
    if corners < 3:
        return written
    second, third = corners // 3, 2 * corners // 3
    faces[written, 0], faces[written, 1] = places[0, 1], places[second, 1]
    faces[written, 2] = places[third, 1]
    written += 1
    for one in range(corners):
        root = third if one >= third else (second if one >= second else 0)
        if one != root:
            faces[written, 0], faces[written, 1] = places[root, 1], places[one, 1]
            faces[written, 2] = places[(one + 1) % corners, 1]
            written += 1
    return written


def determinant(points, order, faces, face):  # pragma: no cover
    """Return six times the volume of a face with the first corner."""
    ux, uy, uz = difference(points, order[0], order[faces[face, 0]])
    vx, vy, vz = difference(points, order[0], order[faces[face, 1]])
    wx, wy, wz = difference(points, order[0], order[faces[face, 2]])
    nx, ny, nz = cross(vx, vy, vz, wx, wy, wz)
    return ux * nx + uy * ny + uz * nz


def start_hull(points, given, start, end, edges, outline, firsts, parts, part, free):  # pragma: no cover
    """Make the hull of at most two points; return the next free edge, -1 where there is none."""
    if end == start:
        parts[part, MIN_X] = parts[part, MAX_X] = parts[part, MIN_Y] = parts[part, MAX_Y] = -1
        return free
    one, two = given[start], given[end - 1]
    lowest, highest, left, right = one, two, one, two
    firsts[one] = -1
    if one != two:
        edge, free = add_edge(edges, one, two, 0, free)
        if edge < 0:
            return -1
        join(edges, edge, edge, NEXT)
        join(edges, edge + 1, edge + 1, NEXT)
        firsts[one], firsts[two] = edge, edge + 1
        if points[one, 0] == points[two, 0] and points[one, 1] == points[two, 1]:
            two = highest = right = one  # of points above each other the outline has the lower
        elif points[one, 0] > points[two, 0]:
            left, right = two, one
    outline[one, NEXT] = outline[one, PREV] = two
    outline[two, NEXT] = outline[two, PREV] = one
    parts[part, MIN_X], parts[part, MAX_X] = left, right
    parts[part, MIN_Y], parts[part, MAX_Y] = lowest, highest
    return free


def add_edge(edges, start, end, age, free):  # pragma: no cover
    """Take a free edge; return it and the next free one, -1 for the first where there is none."""
    if free >= edges.shape[0]:
        return -1, -1
    after = edges[free, NEXT]
    edges[free, END], edges[free + 1, END] = end, start
    edges[free, AGE] = edges[free + 1, AGE] = age
    return free, after


def join(edges, one, two, way):  # pragma: no cover
    """Let an edge follow another one in a direction around their start."""
    edges[one, way] = two
    edges[two, 1 - way] = one


def remove_edge(edges, firsts, edge, free):  # pragma: no cover
    """Remove an edge in both directions; return the next free edge."""
    for k in range(2):
        one = edge ^ k
        after, start = edges[one, NEXT], edges[one ^ 1, END]
        firsts[start] = -1
        if after != one:
            join(edges, edges[one, PREV], after, NEXT)
            firsts[start] = after
    edge &= -2
    edges[edge, NEXT], edges[edge, END] = free, -1
    return edge


def merge(points, edges, outline, firsts, parts, part, free, age, work):  # pragma: no cover
    """Join two hulls, of which one is below the other in y; return the next free edge, -1 for no room."""
    start_band(points, edges, outline, firsts, parts, part, age, work)
    begun_0, begun_1 = work[CORNER], work[SIDE + CORNER]
    is_first = True
    while True:
        corner_0, corner_1 = work[CORNER], work[SIDE + CORNER]
        for side in range(2):
            turn(points, edges, firsts, side, age, work)
        best_0, best_1 = work[BEST], work[SIDE + BEST]
        if best_0 < 0 and best_1 < 0:
            edge, free = add_edge(edges, corner_0, corner_1, age, free)
            if edge >= 0:
                join(edges, edge, edge, NEXT)
                join(edges, edge + 1, edge + 1, NEXT)
                firsts[corner_0], firsts[corner_1] = edge, edge + 1
            return free
        nearer = 1 if best_0 < 0 else -1
        if best_0 >= 0 and best_1 >= 0:
            nearer = compare(work[COT], work[COT + 1], work[SIDE + COT], work[SIDE + COT + 1])
        cot = SIDE + COT if nearer >= 0 else COT
        if is_first or work[cot] >= 0 or work[cot + 1] != 0:
            edge, free = add_edge(edges, corner_0, corner_1, age, free)
            if edge < 0:
                return -1
            for side in range(2):
                hold(edges, side, edge + side, work)
        to_0, to_1 = best_0, best_1
        if nearer == 0:
            to_0, to_1 = pass_flat(points, edges, corner_0, corner_1, to_0, to_1, age, work)
        for side in (1, 0):
            to = to_1 if side == 1 else to_0
            if to >= 0 and (nearer >= 0 if side == 1 else nearer <= 0):
                free = advance(points, edges, firsts, side, to, free, work)
        if work[CORNER] == begun_0 and work[SIDE + CORNER] == begun_1:
            for side in range(2):
                free = close(edges, firsts, side, free, work)
            return free
        is_first = False


def start_band(points, edges, outline, firsts, parts, part, age, work):  # pragma: no cover
    """Write where the band between two hulls begins, and join their outlines."""
    for side in range(2):
        for k in range(SIDE):
            work[SIDE * side + k] = -1
    is_beside, one, two = join_outlines(points, edges, outline, firsts, parts, part)
    if is_beside:
        edge_0 = edge_1 = -1
        for side in range(2):
            edge_0, edge_1 = edge_1, upright_edge(points, edges, firsts, one, two, side)
        if edge_0 >= 0 or edge_1 >= 0:
            edge_0, edge_1 = pass_flat(points, edges, one, two, edge_0, edge_1, age, work)
            one = edges[edge_0, END] if edge_0 >= 0 else one
            two = edges[edge_1, END] if edge_1 >= 0 else two
    work[CORNER], work[SIDE + CORNER] = one, two
    for k in range(3):
        work[AT + k] = points[two, k]
    work[AT + (2 if is_beside else 0)] += 1


def join_outlines(points, edges, outline, firsts, parts, part):  # pragma: no cover
    """Join the outlines of two hulls, seen along z.

    Returns:
        Whether there is a line that touches both beside each other, and the points that it touches; else the
        upper of the first and of the second hull, which is a line along z above the other's.
    """
    lower, upper = part, part + 1
    one, two = parts[lower, MAX_Y], parts[upper, MIN_Y]
    if points[one, 0] == points[two, 0] and points[one, 1] == points[two, 1]:
        if outline[two, PREV] == two:
            if firsts[two] >= 0:
                two = edges[firsts[two], END]
            return False, one, two
        leave_out(points, outline, parts, upper, two)
    first_0 = first_1 = -1
    for side in (MAX_X, MIN_X):
        first_0, first_1 = one, two  # of the side before
        right = 1 if side == MAX_X else -1
        one, two = touching(points, outline, parts[lower, side], parts[upper, side], right)
    outline[one, PREV], outline[two, NEXT] = two, one
    outline[first_0, NEXT], outline[first_1, PREV] = first_1, first_0
    if points[parts[upper, MIN_X], 0] < points[parts[lower, MIN_X], 0]:
        parts[lower, MIN_X] = parts[upper, MIN_X]
    if points[parts[upper, MAX_X], 0] >= points[parts[lower, MAX_X], 0]:
        parts[lower, MAX_X] = parts[upper, MAX_X]
    parts[lower, MAX_Y] = parts[upper, MAX_Y]
    return True, first_0, first_1


def leave_out(points, outline, parts, part, point):  # pragma: no cover
    """Take a point out of the outline of a hull, which has others."""
    after, before = outline[point, NEXT], outline[point, PREV]
    join(outline, before, after, NEXT)
    apart = points[after, 0] - points[before, 0]
    if apart == 0:
        apart = points[after, 1] - points[before, 1]
    if parts[part, MIN_X] == point:
        parts[part, MIN_X] = after if apart < 0 else before
    if parts[part, MAX_X] == point:
        parts[part, MAX_X] = after if apart > 0 else before


def touching(points, outline, one, two, right):  # pragma: no cover
    """Return the points of two outlines, one below the other, that a line beside both touches.

    one, two: where to begin, the outermost points. right: 1 for the line at large x, -1 for that at small x.
    """
    apart = (points[two, 0] - points[one, 0]) * right
    down, up = (PREV, NEXT) if right > 0 else (NEXT, PREV)
    if apart == 0:
        return slide(points, outline, one, two, down, up)
    near, far, way, above = (one, two, down, 1) if apart > 0 else (two, one, up, -1)
    near, far = lean(points, outline, near, far, way, right, above)
    return (near, far) if apart > 0 else (far, near)


def slide(points, outline, one, two, down, up):  # pragma: no cover
    """Return the last points of two outlines that are reached straight down, and straight up."""
    last, other = one, two
    after = outline[last, down]
    while after != one and points[after, 0] == points[one, 0] and points[after, 1] <= points[last, 1]:
        last, after = after, outline[after, down]
    after = outline[other, up]
    while after != two and points[after, 0] == points[two, 0] and points[after, 1] >= points[other, 1]:
        other, after = after, outline[after, up]
    return last, other


def lean(points, outline, near, far, way, right, up):  # pragma: no cover
    """Return the points that a line beside two outlines touches: of the one farther inside, and of the other.

    way: in which both are followed. right, up: 1 or -1, for lines on that side, and outlines in that order.
    """
    while True:
        dx, dy = (points[far, 0] - points[near, 0]) * right, (points[far, 1] - points[near, 1]) * up
        after = outline[near, way]
        if after != near:
            x, y = (points[after, 0] - points[near, 0]) * right, (points[after, 1] - points[near, 1]) * up
            if y <= 0 and (x == 0 or (x < 0 and y * dx <= dy * x)):
                near = after
                continue
        after = outline[far, way]
        if after != far:
            x, y = (points[after, 0] - points[far, 0]) * right, (points[after, 1] - points[far, 1]) * up
            if dx + x > 0 and y < 0 and (x == 0 or (x < 0 and y * dx < dy * x)):
                far = after
                continue
        return near, far


def upright_edge(points, edges, firsts, one, two, side):  # pragma: no cover
    """Return the edge of a hull from where the band begins that goes up in the plane of the line between."""
    corner = two if side == 1 else one
    sx, sy, sz = difference(points, one, two)
    best = -1
    first = edge = firsts[corner]
    while edge >= 0:
        x, y, z = difference(points, corner, edges[edge, END])
        if x * sy == y * sx and z * (sx * sx + sy * sy) < sz * (sx * x + sy * y):
            turned = 0 if best < 0 else orientation(points, edges, best, edge, sy, -sx, 0)
            if best < 0 or turned == (1 if side == 1 else -1):
                best = edge
        edge = edges[edge, NEXT]
        if edge == first:
            break
    return best


def orientation(points, edges, one, two, nx, ny, nz):  # pragma: no cover
    """Return 1 where the edge two follows one directly around their start, -1 where it precedes, else 0.

    Where both are so, it is 1 where they turn left around the direction (nx, ny, nz).
    """
    follows, precedes = edges[one, NEXT] == two, edges[one, PREV] == two
    if follows and precedes:
        start = edges[two ^ 1, END]
        ux, uy, uz = difference(points, start, edges[one, END])
        vx, vy, vz = difference(points, start, edges[two, END])
        x, y, z = cross(ux, uy, uz, vx, vy, vz)
        return 1 if x * nx + y * ny + z * nz > 0 else -1
    return 1 if follows else (-1 if precedes else 0)


def turn(points, edges, firsts, side, age, work):  # pragma: no cover
    """Find the edge of a side to which the last plane of the band turns first; write it and the cotangent."""
    one, two = work[CORNER], work[SIDE + CORNER]
    corner = two if side == 1 else one
    sx, sy, sz = difference(points, one, two)
    nx, ny, nz = cross(
        work[AT] - points[one, 0], work[AT + 1] - points[one, 1], work[AT + 2] - points[one, 2], sx, sy, sz
    )
    mx, my, mz = cross(sx, sy, sz, nx, ny, nz)
    best, least_p, least_q = -1, 0, 0
    first = edge = firsts[corner]
    while edge >= 0:
        if edges[edge, AGE] < age:
            x, y, z = difference(points, corner, edges[edge, END])
            p, q = x * mx + y * my + z * mz, x * nx + y * ny + z * nz
            if q < 0:
                p, q = -p, -q
            if p != 0 or q != 0:
                less = -1 if best < 0 else compare(p, q, least_p, least_q)
                if less == 0:
                    ux, uy, uz = cross(x, y, z, sx, sy, sz)
                    is_left = orientation(points, edges, best, edge, ux, uy, uz) == 1
                    less = -1 if is_left == (side == 1) else 0
                if less < 0:
                    best, least_p, least_q = edge, p, q
        edge = edges[edge, NEXT]
        if edge == first:
            break
    at = SIDE * side
    work[at + BEST], work[at + COT], work[at + COT + 1] = best, least_p, least_q


def pass_flat(points, edges, one, two, edge_0, edge_1, age, work):  # pragma: no cover
    """Return the last edges of both sides to pass where the faces at them are in one plane.

    one, two: where the band is. edge_0, edge_1: edges from there in the plane, -1 where a side has none.

    Returns:
        Edges that end at the two points that a line touches beyond; -1 where a side stays.
    """
    start_0, start_1 = edge_0, edge_1
    end_0 = edges[edge_0, END] if edge_0 >= 0 else one
    end_1 = edges[edge_1, END] if edge_1 >= 0 else two
    sx, sy, sz = difference(points, one, two)
    x, y, z = difference(points, one, end_0 if edge_0 >= 0 else end_1)
    nx, ny, nz = cross(x, y, z, sx, sy, sz)
    work[OUT], work[OUT + 1], work[OUT + 2] = cross(sx, sy, sz, nx, ny, nz)
    work[NORMAL], work[NORMAL + 1], work[NORMAL + 2] = nx, ny, nz
    work[OVER], work[OVER + 1], work[OVER + 2] = sx, sy, sz
    for side in range(2):
        edge = outermost(
            points, edges, edge_0 if side == 0 else edge_1, NEXT if side == 1 else PREV, age, work
        )
        if side == 0 and edge >= 0:
            edge_0, end_0 = edge, edges[edge, END]
        elif edge >= 0:
            edge_1, end_1 = edge, edges[edge, END]
    apart = along(points, end_0, end_1, OUT, work)
    if apart == 0:
        return edge_0, edge_1
    near, far, start, end, far_end, way = edge_0, edge_1, start_0, end_0, end_1, NEXT
    if apart < 0:
        near, far, start, end, far_end, way = edge_1, edge_0, start_1, end_1, end_0, PREV
    near, far = lean_flat(points, edges, near, far, start, end, far_end, way, age, work)
    return (near, far) if apart > 0 else (far, near)


def along(points, one, two, axis, work):  # pragma: no cover
    """Return the product of the way from a point to another with a direction in the work array."""
    x, y, z = difference(points, one, two)
    return x * work[axis] + y * work[axis + 1] + z * work[axis + 2]


def outermost(points, edges, edge, way, age, work):  # pragma: no cover
    """Follow edges in the plane as long as they go out; return the last, -1 where there is no first one."""
    while edge >= 0:
        after = edges[edge ^ 1, way]
        end, beyond = edges[edge, END], edges[after, END]
        is_below = along(points, end, beyond, NORMAL, work) < 0
        if is_below or edges[after, AGE] == age or along(points, end, beyond, OUT, work) <= 0:
            break
        edge = after
    return edge


def lean_flat(points, edges, near, far, start, end, far_end, way, age, work):  # pragma: no cover
    """Return the edges that end where a line touches two faces in one plane, -1 where the near one is left.

    near, far: last edges of both, of which near ends farther inside. start: the first edge of near's side.
    end, far_end: where they end. way: in which edges are followed.
    """
    sign = 1 if way == NEXT else -1  # towards the far side
    while True:
        dx, dy = along(points, end, far_end, OUT, work), sign * along(points, end, far_end, OVER, work)
        if near >= 0:
            after = edges[near, way] ^ 1
            to = edges[after, END]
            x, y = along(points, end, to, OUT, work), sign * along(points, end, to, OVER, work)
            if edges[after, AGE] < age and is_lower(x, y, dx, dy, 0):
                near, end = -1 if near == start else after, to
                continue
        if far >= 0:
            after = edges[far ^ 1, way]
            to = edges[after, END]
            x, y = along(points, far_end, to, OUT, work), sign * along(points, far_end, to, OVER, work)
            is_flat = along(points, far_end, to, NORMAL, work) == 0
            if edges[after, AGE] < age and is_flat and dx + x > 0 and is_lower(x, y, dx, dy, 1):
                far, far_end = after, to
                continue
        return near, far


def is_lower(x, y, dx, dy, least):  # pragma: no cover
    """Return whether a step inwards (x, y) is below the line along (dx, dy), or on it where least is 0."""
    if x >= 0:
        return x == 0 and y < 0
    return compare(-y, -x, dy, dx) >= least


def hold(edges, side, edge, work):  # pragma: no cover
    """Add a new edge to those at a side's place."""
    at, way = SIDE * side, NEXT if side == 1 else PREV
    if work[at + TAIL] >= 0:
        join(edges, work[at + TAIL], edge, way)
    else:
        work[at + HEAD] = edge
    work[at + TAIL] = edge


def advance(points, edges, firsts, side, edge, free, work):  # pragma: no cover
    """Move a side of the band to the end of an edge, behind that at BEST; return the next free edge."""
    at, way = SIDE * side, NEXT if side == 1 else PREV
    back, best, head, tail = work[at + BACK], work[at + BEST], work[at + HEAD], work[at + TAIL]
    if back >= 0:
        free = remove_between(edges, firsts, back, best, way, free)
    if tail >= 0:
        if back < 0:
            work[at + FIRST] = head
            back = edges[best, 1 - way]
        join(edges, back, head, way)
        join(edges, tail, best, way)
        work[at + HEAD] = work[at + TAIL] = -1
    elif back < 0:
        work[at + FIRST] = best
    for k in range(3):
        work[AT + k] = points[work[at + CORNER], k]
    work[at + CORNER], work[at + BACK] = edges[edge, END], edge ^ 1
    return free


def close(edges, firsts, side, free, work):  # pragma: no cover
    """Join the last edges of a side with its first ones; return the next free edge."""
    at, way = SIDE * side, NEXT if side == 1 else PREV
    back, first, head, tail = work[at + BACK], work[at + FIRST], work[at + HEAD], work[at + TAIL]
    if back < 0:
        join(edges, tail, head, way)
        firsts[work[at + CORNER]] = tail
        return free
    free = remove_between(edges, firsts, back, first, way, free)
    if tail >= 0:
        join(edges, back, head, way)
        join(edges, tail, first, way)
    return free


def remove_between(edges, firsts, one, two, way, free):  # pragma: no cover
    """Remove the edges from one to another around their start; return the next free edge."""
    edge = edges[one, way]
    while edge != two:
        after = edges[edge, way]
        free = remove_edge(edges, firsts, edge, free)
        edge = after
    return free


def difference(points, one, two):  # pragma: no cover
    """Return the way from a point to another."""
    return points[two, 0] - points[one, 0], points[two, 1] - points[one, 1], points[two, 2] - points[one, 2]


def cross(ax, ay, az, bx, by, bz):  # pragma: no cover
    """Return the cross product of two vectors."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def compare(p, q, r, s):  # pragma: no cover
    """Return -1, 0 or 1 where the fraction p / q is less than, equal to or larger than r / s.

    q and s are not negative, and 0 for infinity. The parts of the fractions are compared as by Euclid's
    algorithm, since the products have more bits than a number.
    """
    sign = 1 if p > 0 else (-1 if p < 0 else 0)
    other = 1 if r > 0 else (-1 if r < 0 else 0)
    if sign != other or sign == 0:
        return 1 if sign > other else (-1 if sign < other else 0)
    p, r = abs(p), abs(r)
    while q != 0 and s != 0:
        whole, rest = p // q, r // s
        if whole != rest:
            return sign if whole > rest else -sign
        p, q, r, s = q, p - whole * q, s, r - rest * s
        sign = -sign
    if q == s:
        return 0
    return sign if q == 0 else -sign
