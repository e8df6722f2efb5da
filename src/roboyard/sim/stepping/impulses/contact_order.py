"""The order in which Bullet takes the contacts of a step.

Its pairs of shapes are in the order in which they met. In each step it sorts them by groups of bodies that
met one another, with a quicksort that leaves pairs of a group in another order than it finds them. How far
the rounds of the solver get depends on the order: a heavy body on a column stays on it, or sinks until the
column falls.
"""

from __future__ import annotations

from roboyard.sim.stepping.broad_phase.meeting_pairs import meet
from roboyard.sim.stepping.broad_phase.pair_table import find_place
from roboyard.sim.stepping.broad_phase.ranking import entry_of, sort_by_entries
from roboyard.sim.stepping.impulses.records import (
    GROUP,
    HEAD,
    LISTED,
    ONE,
    ORDERED,
    RANGE_END,
    RANGE_START,
    RANK,
    RANKED,
    SORTED,
    TAKEN_UP,
    TWO,
)  # fmt: skip
from roboyard.sim.stepping.impulses.slide_directions import kind_of


def order_contacts(contacts, count, mechanism, state, surface, points, groups, by_entry):
    """Write the contacts in Bullet's order into `Points.sequence`; return how many rows the others have.

    Those are the contacts across gaps that do not push; soft bodies' contacts are in neither.
    groups: (ntree,) work array. Where the surfaces have no boxes, the order is MuJoCo's. All contacts are
    written into `Points.listing`, too, in the order of ranks, in which Bullet lists them. by_entry: whether
    pairs of a group are sorted by the turns in which their links entered the broad phase.
    """
    notes, work, geom = points.notes, points.work, contacts.geom
    taken = left = 0
    notes[ORDERED] = 0
    if surface.boxes.shape[0] == 0:
        for n in range(count):
            if geom[n, 0] < 0 or geom[n, 1] < 0:
                continue
            if is_apart(contacts, n, surface):
                left += contacts.dim[n] if contacts.address[n] >= 0 else 0
                continue
            points.sequence[taken] = n
            taken += 1
        notes[TAKEN_UP] = taken
        return left
    meet(mechanism, state, surface, points, by_entry)
    ranks = notes[RANKED]
    for rank in range(ranks):
        work[HEAD, rank] = -1
    loose = others = a = b = rank = -1
    for n in range(count):
        if geom[n, 0] < 0 or geom[n, 1] < 0:
            points.following[n] = others
            others = n
            continue
        if is_apart(contacts, n, surface):
            left += contacts.dim[n] if contacts.address[n] >= 0 else 0
            points.following[n] = others
            others = n
            continue
        if geom[n, 0] != a or geom[n, 1] != b:
            a, b = geom[n, 0], geom[n, 1]
            rank = find_place(points.ranked, points.rank_table, min(a, b), max(a, b))
        if rank >= 0:
            insert(points, rank, n)
        else:
            points.following[n] = loose
            loose = n
    for rank in range(ranks):
        list_chain(points, work[HEAD, rank])
    list_chain(points, loose)
    list_chain(points, others)
    if notes[SORTED] == 0:
        group_pairs(mechanism, points, ranks, groups)
        if by_entry:
            write_entries(mechanism, surface, points, ranks)
            sort_by_entries(work, RANK, ranks)
        else:
            sort_by_groups(work[RANK], work[GROUP], work[RANGE_START], work[RANGE_END], ranks)
        notes[SORTED] = 1
    for place in range(ranks):
        n = work[HEAD, work[RANK, place]]
        while n >= 0:
            points.sequence[taken] = n
            taken += 1
            n = points.following[n]
    while loose >= 0:
        points.sequence[taken] = loose
        taken += 1
        loose = points.following[loose]
    notes[TAKEN_UP] = taken
    return left


def list_chain(points, n):
    """Add a contact and those that follow it to those that are listed."""
    notes = points.notes
    while n >= 0:
        points.listing[notes[ORDERED]] = n
        notes[ORDERED] += 1
        n = points.following[n]


def is_apart(contacts, n, surface):
    """Return whether a contact's gap is one from which on it does not push; see `hard_contacts`."""
    a, b = contacts.geom[n, 0], contacts.geom[n, 1]
    gap = contacts.dist[n] - (surface.margins[a] + surface.margins[b])
    return gap > min(surface.reaches[a], surface.reaches[b])


def insert(points, rank, contact):
    """Insert a contact into its pair's chain before the first whose kept point comes later, or at its end."""
    following, work, slots = points.following, points.work, points.slots
    last, n = -1, work[HEAD, rank]
    while n >= 0 and not 0 <= slots[contact] < slots[n]:
        last, n = n, following[n]
    following[contact] = n
    if last < 0:
        work[HEAD, rank] = contact
    else:
        following[last] = contact


def group_pairs(mechanism, points, ranks, groups):
    """Write for each rank the place of a tree that all trees of its group share."""
    pairs, ranked, work, places = points.pairs, points.ranked, points.work, points.tree_places
    geom_tree, body_tree = mechanism.geom_tree, mechanism.body_tree
    equality_order, equality_tree = mechanism.equality_order, mechanism.equality_tree
    for tree in range(groups.shape[0]):
        groups[tree] = tree
    for place in range(points.notes[LISTED]):
        unite(groups, places, body_tree[pairs[0, place]], body_tree[pairs[1, place]])
    for tree in range(1, groups.shape[0]):
        if root_body(mechanism, tree) == root_body(mechanism, tree - 1):  # limbs of a robot on a fixed base
            unite(groups, places, tree - 1, tree)
    for place in range(equality_order.shape[0]):
        equality = equality_order[place]
        if equality < 0:
            break
        unite(groups, places, equality_tree[equality, 0], equality_tree[equality, 1])
    for rank in range(ranks):
        tree = geom_tree[ranked[0, rank]]
        if tree < 0:
            tree = geom_tree[ranked[1, rank]]
        work[RANK, rank] = rank
        work[GROUP, rank] = root_of(groups, places[tree]) if tree >= 0 else -1


def write_entries(mechanism, surface, points, ranks):
    """Write the turns in which the links of each rank entered, of the one that Bullet lists first, first."""
    work, ranked, geom_body = points.work, points.ranked, mechanism.geom_body
    for rank in range(ranks):
        a, b = ranked[0, rank], ranked[1, rank]
        one, two = entry_of(points, geom_body[a]), entry_of(points, geom_body[b])
        kinds = (
            kind_of(mechanism.geom_type, surface.compound, a),
            kind_of(mechanism.geom_type, surface.compound, b),
        )
        if kinds[1] > kinds[0] or (kinds[1] == kinds[0] and two < one):
            one, two = two, one
        work[ONE, rank], work[TWO, rank] = one, two


def root_body(mechanism, tree):
    """Return the body of MuJoCo's world that a tree is of."""
    return mechanism.body_root[mechanism.dof_body[mechanism.tree_dof[tree]]]


def unite(groups, places, a, b):
    """Join the groups of two trees, of which none is below 0."""
    if a >= 0 and b >= 0:
        groups[root_of(groups, places[a])] = root_of(groups, places[b])


def root_of(groups, place):
    """Return the place that all places of a group lead to."""
    while groups[place] != place:
        groups[place] = groups[groups[place]]
        place = groups[place]
    return place


def sort_by_groups(items, group, starts, stops, count):
    """Sort items by their groups, by Hoare's partition about the middle one.

    starts, stops: work arrays, as long as there are items.
    """
    ranges = 0
    if count > 1:
        starts[0], stops[0] = 0, count - 1
        ranges = 1
    while ranges > 0:
        ranges -= 1
        low, high = starts[ranges], stops[ranges]
        pivot = group[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while group[i] < pivot:
                i += 1
            while group[j] > pivot:
                j -= 1
            if i <= j:
                items[i], items[j] = items[j], items[i]
                group[i], group[j] = group[j], group[i]
                i += 1
                j -= 1
        if low < j:
            starts[ranges], stops[ranges] = low, j
            ranges += 1
        if i < high:
            starts[ranges], stops[ranges] = i, high
            ranges += 1
