"""Ranks of pairs of shapes, in the order of solution and in which contacts are listed.

Pairs get ranks in the order in which their links met, or by the turns in which the links entered the broad
phase (PyBullet's `deterministicOverlappingPairs`).
"""

from __future__ import annotations

from roboyard.sim.stepping.broad_phase.box_tree import ENTRY, overlap
from roboyard.sim.stepping.broad_phase.link_boxes import place_part
from roboyard.sim.stepping.broad_phase.pair_table import change_place, drop_place, find_place, note_place
from roboyard.sim.stepping.impulses.records import (
    FULL,
    GROUP,
    HEAD,
    LISTED,
    ONE,
    RANGE_END,
    RANGE_START,
    RANKED,
    SORTED,
    TWO,
)  # fmt: skip
from roboyard.sim.stepping.impulses.slide_directions import kind_of


def rank_pairs(mechanism, state, surface, points, by_entry):
    """Give ranks to pairs of shapes that have none, and take those of parts of compounds that parted.

    by_entry: whether pairs of the links that entered last come first, instead of those that met first.
    """
    pairs, listed, work = points.pairs, points.notes[LISTED], points.work
    if not by_entry:
        for place in range(listed):
            if pairs[2, place] == -1:
                rank_pair(mechanism, state, surface, points, place)
        return
    count = 0
    for place in range(listed):
        if pairs[2, place] == -1:
            one, two = entry_of(points, pairs[0, place]), entry_of(points, pairs[1, place])
            work[HEAD, count], work[GROUP, count] = place, 0
            work[ONE, count], work[TWO, count] = -min(one, two), -max(one, two)
            count += 1
    sort_by_entries(work, HEAD, count)
    for turn in range(count):
        rank_pair(mechanism, state, surface, points, work[HEAD, turn])


def entry_of(points, link):
    """Return the turn in which a link last entered the broad phase."""
    return points.ties[points.leaves[link], ENTRY]


def rank_pair(mechanism, state, surface, points, place):
    """Do what `rank_pairs` does for the shapes of one pair of links, as Bullet visits them.

    It goes down the trees of boxes of both links' parts at once, the side of the second one first.
    """
    pairs, turns, firsts, sizes = points.pairs, points.turns, points.firsts, points.sizes
    compound, visits = surface.compound, surface.visits
    one, two = pairs[0, place], pairs[1, place]
    has_several = sizes[one] > 1 or sizes[two] > 1
    if has_several and comes_first(mechanism, surface, points, two, one):
        one, two = two, one
    has_parts = compound[turns[firsts[one]]] > 0 or compound[turns[firsts[two]]] > 0
    for m in range(sizes[two]):
        second = turns[firsts[two] + m]
        if has_several:
            second = turns[firsts[two] + visits[second]]
        for k in range(sizes[one]):
            first = turns[firsts[one] + k]
            if has_several:
                first = turns[firsts[one] + visits[first]]
            meets = True
            if has_parts:
                place_part(state, surface, points, first, one)
                place_part(state, surface, points, second, two)
                meets = overlap(points.tight, first, second)
            rank_shapes(points, min(first, second), max(first, second), meets)
    if not has_parts and points.notes[FULL] == 0:
        pairs[2, place] = 0


def comes_first(mechanism, surface, points, one, two):
    """Return whether Bullet lists a link before another one."""
    a, b = points.turns[points.firsts[one]], points.turns[points.firsts[two]]
    first = min(kind_of(mechanism.geom_type, surface.compound, a), 2)
    second = min(kind_of(mechanism.geom_type, surface.compound, b), 2)
    if first != second:
        return first > second
    return entry_of(points, one) < entry_of(points, two)


def rank_shapes(points, a, b, meets):
    """Give a pair of shapes, a < b, a rank, or take it where the boxes of parts of compounds have parted."""
    notes, ranked, rank = points.notes, points.ranked, find_place(points.ranked, points.rank_table, a, b)
    if not meets and rank >= 0:
        end_rank(points, rank)
    elif meets and rank < 0:
        rank = notes[RANKED]
        if rank >= ranked.shape[1]:
            notes[FULL] = 1
            return
        ranked[0, rank], ranked[1, rank] = a, b
        notes[RANKED] = rank + 1
        notes[SORTED] = 0
        note_place(ranked, points.rank_table, rank)


def end_ranks(points, place):
    """End the ranks of all shapes of a pair of links."""
    one, two = points.pairs[0, place], points.pairs[1, place]
    for k in range(points.sizes[one]):
        for m in range(points.sizes[two]):
            first = points.turns[points.firsts[one] + k]
            second = points.turns[points.firsts[two] + m]
            rank = find_place(points.ranked, points.rank_table, min(first, second), max(first, second))
            if rank >= 0:
                end_rank(points, rank)


def end_rank(points, rank):
    """Let the pair of the last rank take that of a pair of shapes."""
    ranked, table = points.ranked, points.rank_table
    drop_place(ranked, table, rank)
    last = points.notes[RANKED] - 1
    if rank < last:
        change_place(ranked, table, last, rank)
        ranked[0, rank], ranked[1, rank] = ranked[0, last], ranked[1, last]
    points.notes[RANKED] = last
    points.notes[SORTED] = 0


def sort_by_entries(work, row, count):
    """Sort numbers in a row of `Points.work` by those at GROUP, ONE and TWO, by Hoare's partition."""
    ranges = 0
    if count > 1:
        work[RANGE_START, 0], work[RANGE_END, 0] = 0, count - 1
        ranges = 1
    while ranges > 0:
        ranges -= 1
        low, high = work[RANGE_START, ranges], work[RANGE_END, ranges]
        middle = (low + high) // 2
        group, one, two = work[GROUP, middle], work[ONE, middle], work[TWO, middle]
        i, j = low, high
        while i <= j:
            while is_before(work[GROUP, i], work[ONE, i], work[TWO, i], group, one, two):
                i += 1
            while is_before(group, one, two, work[GROUP, j], work[ONE, j], work[TWO, j]):
                j -= 1
            if i <= j:
                work[row, i], work[row, j] = work[row, j], work[row, i]
                for k in (GROUP, ONE, TWO):
                    work[k, i], work[k, j] = work[k, j], work[k, i]
                i += 1
                j -= 1
        if low < j:
            work[RANGE_START, ranges], work[RANGE_END, ranges] = low, j
            ranges += 1
        if i < high:
            work[RANGE_START, ranges], work[RANGE_END, ranges] = i, high
            ranges += 1


def is_before(group, one, two, other, third, fourth):
    """Return whether three numbers come before three others."""
    if group != other:
        return group < other
    return one < third or (one == third and two < fourth)
