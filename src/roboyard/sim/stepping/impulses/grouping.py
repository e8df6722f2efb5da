"""Groups of bodies that met one another, which Bullet solves one after the other.

The rounds of a group end when its own rows have converged: a cube at rest on a table is done after a few,
with an arm beside it that needs many.
"""

from __future__ import annotations

from roboyard.sim.stepping.impulses.contact_order import root_of, sort_by_groups
from roboyard.sim.stepping.impulses.records import (
    EQUALITY,
    EQUALITY_ROWS,
    LIMIT,
    PART_END,
    PART_GROUP,
    PART_INDEX,
    PART_KIND,
    PART_RANK,
    PART_SIZE,
    PART_START,
    PART_TREE,
)  # fmt: skip

KINDS = 5
"""Kinds of rows: of joints and equalities, normals, spinning, rolling and sliding."""


def order_parts(mechanism, points, groups):  # pragma: no cover
    """Write the first row of each joint limit, motor and equality in the order of solution.

    Bullet sorts them by groups of bodies whose boxes met, with a quicksort that leaves equals in another
    order than it finds them. groups: (ntree,) of `group_pairs`.
    """
    parts, count = mechanism.parts, 0
    while parts[PART_KIND, count] >= 0:
        tree = parts[PART_TREE, count]
        parts[PART_RANK, count] = count
        parts[PART_GROUP, count] = root_of(groups, points.tree_places[tree]) if tree >= 0 else -1
        count += 1
    sort_by_groups(parts[PART_RANK], parts[PART_GROUP], parts[PART_START], parts[PART_END], count)
    place = 0
    for rank in range(count):
        part = parts[PART_RANK, rank]
        kind, index = parts[PART_KIND, part], parts[PART_INDEX, part]
        if kind == EQUALITY:
            mechanism.equality_slot[index] = place
            place += EQUALITY_ROWS
        elif kind == LIMIT:
            mechanism.limit_slot[index] = place
            place += 2
        else:
            for k in range(parts[PART_SIZE, part]):
                mechanism.slot[index + k] = place
                place += 1


def gather_groups(mechanism, points, solver, has_groups):  # pragma: no cover
    """Sort the rows of joints and equalities by groups, as contacts are, and write the groups' ranges.

    The ranges, first and end of each kind, become the rows of `Solver.parts`; the last one of it has their
    number. All rows are of one group where contacts come without groups, or in another order.
    """
    order, ends, parts, groups = solver.order, solver.ends, solver.parts, solver.groups
    last = parts.shape[0] - 1
    count, before = 0, 0
    if has_groups:
        for root in range(last):
            for k in range(2 * KINDS):
                parts[root, k] = 0
        for n in range(ends[1]):
            root = root_of_row(order, n, mechanism, points, groups)
            if n >= ends[0]:
                has_groups &= before <= root
                before = root
            count += 1 if parts[root, 0] == 0 else 0
            parts[root, 0] = 1
    if count < 2 or not has_groups:
        start = 0
        for kind in range(KINDS):
            parts[0, 2 * kind], parts[0, 2 * kind + 1] = start, ends[kind]
            start = ends[kind]
        parts[last, 0] = 1
        return
    start = 0
    for kind in range(KINDS):
        for n in range(start, ends[kind]):
            parts[root_of_row(order, n, mechanism, points, groups), 2 * kind + 1] += 1
        for root in range(last):
            number = parts[root, 2 * kind + 1]
            parts[root, 2 * kind], parts[root, 2 * kind + 1] = start, start + number
            start += number
    sort_joints(order, ends[0], parts, mechanism, points, groups, solver.places_of_rows)
    count = 0
    for root in range(last):
        if parts[root, 0] < parts[root, 1] or parts[root, 2] < parts[root, 3]:
            for k in range(2 * KINDS):
                parts[count, k] = parts[root, k]
            count += 1
    parts[last, 0] = count


def sort_joints(order, count, parts, mechanism, points, groups, work):  # pragma: no cover
    """Sort the first rows by their groups, whose ranges are known. work: (n, 4) or larger, written."""
    for n in range(count):
        root = root_of_row(order, n, mechanism, points, groups)
        to = parts[root, 0]
        parts[root, 0] = to + 1
        for k in range(4):
            work[to, k] = order[n, k]
    for n in range(count):
        for k in range(4):
            order[n, k] = work[n, k]
    for n in range(count):  # from the last back, so that each group's first remains
        root = root_of_row(order, count - 1 - n, mechanism, points, groups)
        parts[root, 0] = count - 1 - n


def root_of_row(order, n, mechanism, points, groups):
    """Return the place of the tree that all trees of a row's group share."""
    tree = order[n, 1] if order[n, 1] >= 0 else order[n, 2]
    return root_of(groups, points.tree_places[tree]) if tree >= 0 else 0


def end_of_uncounted(parts, part, goals):
    """Return the kind and the end of the rows of a group whose changes of velocity do not count, 0 for none.

    goals: (n, 6), of which the fourth is below 0 for rows that no impulse moves. Bullet divides the change of
    such a row by 0, and its largest change so far is lost: rounds end when the rows after it have converged.
    """
    for kind in range(4, 0, -3):  # of sliding, then normals
        start, stop = parts[part, 2 * kind], parts[part, 2 * kind + 1]
        for n in range(stop - 1, start - 1, -1):
            if goals[n, 3] < 0.0:
                return kind, start + (n - start) // 2 * 2 + 2 if kind == 4 else n + 1
    return 0, 0
