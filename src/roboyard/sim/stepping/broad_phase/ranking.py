"""Ranks of pairs of shapes, in the order of solution and in which contacts are listed.

Pairs get ranks in the order in which their links met, or by the turns in which the links entered the broad
phase (PyBullet's `deterministicOverlappingPairs`).
"""

from __future__ import annotations

from roboyard.sim.stepping.broad_phase.box_tree import ENTRY, overlap
from roboyard.sim.stepping.broad_phase.link_boxes import meets_along, place_part
from roboyard.sim.stepping.broad_phase.pair_table import change_place, drop_place, find_place, note_place
from roboyard.sim.stepping.impulses.records import (
    FULL,
    GIVEN,
    GROUP,
    HEAD,
    LISTED,
    NODES_OF_PARTS,
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

    It goes down the trees of boxes of both links' parts at once, the side of the second one first. The parts
    of a compound within another are below the leaf of that one; both links' must have been reached. Ranks end
    after others have begun, those of compounds within others where they are visited.
    """
    pairs, turns, firsts, sizes, stack = points.pairs, points.turns, points.firsts, points.sizes, points.stack
    one, two = pairs[0, place], pairs[1, place]
    if (sizes[one] > 1 or sizes[two] > 1) and comes_first(mechanism, surface, points, two, one):
        one, two = two, one
    is_one, is_two = surface.compound[turns[firsts[one]]] > 0, surface.compound[turns[firsts[two]]] > 0
    stack[0] = stack[1] = stack[3] = stack[4] = 0
    stack[2], stack[5] = sizes[one], sizes[two]
    depth, parted = 1, 0
    while depth > 0:
        depth -= 1
        at = NODES_OF_PARTS * depth
        node, first, count = stack[at], stack[at + 1], stack[at + 2]
        other, second, number = stack[at + 3], stack[at + 4], stack[at + 5]
        side = side_of(surface, points, one, node, count)
        side_of_other = side_of(surface, points, two, other, number)
        if side == 0 and side_of_other == 0:
            parted += rank_parts(state, surface, points, one, first, two, second, is_one, is_two)
            continue
        has_outer = side > 0 or side_of_other > 0
        splits, splits_other = side > 0, side_of_other > 0
        if not has_outer:
            splits, splits_other = side < 0, side_of_other < 0
        side, side_of_other = abs(side), abs(side_of_other)
        for m in range(0 if splits_other else 1, 2):
            for k in range(0 if splits else 1, 2):
                at = NODES_OF_PARTS * depth
                stack[at], stack[at + 1], stack[at + 2] = node, first, count
                if splits:
                    write_side(stack, at, node, first, count, side, k)
                stack[at + 3], stack[at + 4], stack[at + 5] = other, second, number
                if splits_other:
                    write_side(stack, at + 3, other, second, number, side_of_other, m)
                depth += 1
    if parted > 0:
        end_parted(points, one, two, is_one and is_two)
    if not is_one and not is_two and points.notes[FULL] == 0:
        pairs[2, place] = 0


def side_of(surface, points, link, node, count):
    """Return how many parts are on a node's side that is visited first, below 0 as in `Surface.visits`."""
    if count < 2:
        return 0
    side = surface.visits[points.turns[points.firsts[link] + node], 1]
    return side if 0 < abs(side) < count else 1


def write_side(stack, at, node, first, count, side, turn):
    """Write node, first part and number of parts of one side of a node, of the younger one if turn is 1."""
    if turn == 1:
        stack[at], stack[at + 1], stack[at + 2] = node + 1, first, side
    else:
        stack[at], stack[at + 1], stack[at + 2] = node + side, first + side, count - side


def rank_parts(state, surface, points, one, first, two, second, is_one, is_two):
    """Give the n-th visited parts of two links a rank, or take it; return 1 where it is to end later."""
    turns, firsts, compound = points.turns, points.firsts, surface.compound
    a, b = turns[firsts[one] + first], turns[firsts[two] + second]
    if points.sizes[one] > 1 or points.sizes[two] > 1:
        a = turns[firsts[one] + surface.visits[a, 0]]
        b = turns[firsts[two] + surface.visits[b, 0]]
    meets = True
    if is_one or is_two:
        place_part(state, surface, points, a, one)
        place_part(state, surface, points, b, two)
        meets = overlap(points.tight, a, b)
    low, high = min(a, b), max(a, b)
    rank = find_place(points.ranked, points.rank_table, low, high)
    if meets:
        if rank < 0 and (not is_one or meets_along(state, surface, a, one, b, two)):
            add_rank(points, low, high, -1 if is_two else points.ages[a] - points.ages[turns[firsts[one]]])
        return 0
    if rank < 0:
        return 0
    if max(compound[a], compound[b]) < 2:
        return 1
    end_rank(points, rank)
    return 0


def comes_first(mechanism, surface, points, one, two):
    """Return whether Bullet lists a link before another one."""
    a, b = points.turns[points.firsts[one]], points.turns[points.firsts[two]]
    first = min(kind_of(mechanism.geom_type, surface.compound, a), 2)
    second = min(kind_of(mechanism.geom_type, surface.compound, b), 2)
    if first != second:
        return first > second
    return entry_of(points, one) < entry_of(points, two)


def add_rank(points, a, b, place):
    """Give a pair of shapes, a < b, the last rank.

    place: in the order in which the ranks of their links end, below 0 for behind the others.
    """
    notes, ranked, rank = points.notes, points.ranked, points.notes[RANKED]
    if rank >= ranked.shape[1]:
        notes[FULL] = 1
        return
    ranked[0, rank], ranked[1, rank], ranked[2, rank] = a, b, notes[GIVEN] if place < 0 else place
    notes[RANKED] = rank + 1
    notes[GIVEN] += 1
    notes[SORTED] = 0
    note_place(ranked, points.rank_table, rank)


def gather_ranks(points, one, two):
    """Write the shapes of two links that have ranks, in the order in which these end; return their number.

    They are at RANGE_START and RANGE_END of `Points.work`, the numbers of that order at ONE.
    """
    ranked, work, count = points.ranked, points.work, 0
    for k in range(points.sizes[one]):
        for m in range(points.sizes[two]):
            first = points.turns[points.firsts[one] + k]
            second = points.turns[points.firsts[two] + m]
            rank = find_place(ranked, points.rank_table, min(first, second), max(first, second))
            if rank < 0:
                continue
            place, number = count, ranked[2, rank]
            while place > 0 and work[ONE, place - 1] > number:
                for row in (RANGE_START, RANGE_END, ONE):
                    work[row, place] = work[row, place - 1]
                place -= 1
            work[RANGE_START, place], work[RANGE_END, place] = ranked[0, rank], ranked[1, rank]
            work[ONE, place] = number
            count += 1
    return count


def end_parted(points, one, two, is_list):
    """End the ranks of parts whose boxes have parted.

    is_list: whether the parts' pairs are in a list of their links, in which the last takes the place of one
    that ends.
    """
    ranked, work = points.ranked, points.work
    count = gather_ranks(points, one, two)
    for n in range(count):
        work[TWO, n] = n
    left = count
    for n in range(count):
        a, b = work[RANGE_START, n], work[RANGE_END, n]
        if overlap(points.tight, a, b):
            continue
        end_rank(points, find_place(ranked, points.rank_table, a, b))
        place = 0
        while work[TWO, place] != n:
            place += 1
        left -= 1
        work[TWO, place] = work[TWO, left]
    if not is_list:
        return
    for place in range(left):
        n = work[TWO, place]
        rank = find_place(ranked, points.rank_table, work[RANGE_START, n], work[RANGE_END, n])
        ranked[2, rank] = work[ONE, place]


def end_ranks(points, place):
    """End the ranks of all shapes of a pair of links."""
    work = points.work
    for n in range(gather_ranks(points, points.pairs[0, place], points.pairs[1, place])):
        a, b = work[RANGE_START, n], work[RANGE_END, n]
        end_rank(points, find_place(points.ranked, points.rank_table, a, b))


def end_rank(points, rank):
    """Let the pair of the last rank take that of a pair of shapes."""
    ranked, table = points.ranked, points.rank_table
    drop_place(ranked, table, rank)
    last = points.notes[RANKED] - 1
    if rank < last:
        change_place(ranked, table, last, rank)
        for k in range(3):
            ranked[k, rank] = ranked[k, last]
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
