"""Pairs of links whose boxes meet, and of shapes that may touch, in the order in which Bullet has them.

Its broad phase gives each link a box parallel to the world's axes around all its shapes, a small one if it
has none. The box is larger than they are and stays until they leave it; the boxes are the leaves of a tree.
Boxes that meet make a pair, whether the shapes touch or not. Each pair of their shapes has a rank in the
order of solution, but parts of compounds only while their own boxes meet, without a margin. A new pair comes
last, and the last takes the place of one that ends, which is noticed some steps later. A new link meets
others in the box in which it was made, which may be elsewhere by the first step. A link that gets a filter
leaves the broad phase and comes back: its pairs end, and those it has come last.

Links are numbered as MuJoCo's bodies, shapes as its geoms.
"""

from __future__ import annotations

import numpy as np

from roboyard.sim.build.masks import ALL_MASKS
from roboyard.sim.stepping.broad_phase.box_tree import (
    FIRST,
    LINK,
    ROOT,
    SECOND,
    WAY,
    WAYS,
    enter_leaf,
    find_way,
    free_node,
    overlap,
    put_in,
    take_out,
)
from roboyard.sim.stepping.broad_phase.link_boxes import BREAKING, follow_link, place_box, write_leaf
from roboyard.sim.stepping.broad_phase.pair_table import (
    change_place,
    drop_place,
    find_place,
    note_place,
    note_places,
)
from roboyard.sim.stepping.broad_phase.ranking import end_ranks, rank_pairs
from roboyard.sim.stepping.impulses.records import (
    CHECKED,
    FULL,
    HIDDEN,
    LINKS,
    LISTED,
    RANKED,
    REFRESHED,
    RENUMBERED,
    SORTED,
    STEPS,
)  # fmt: skip

CHECKS = 10
"""Pairs are checked in turn for whether they ended: so many of a hundred in a step."""


def meet(mechanism, state, surface, points, by_entry):
    """Update the boxes of all links, the pairs and their ranks; see `rank_pairs`."""
    notes, nodes, ties, tree = points.notes, points.nodes, points.ties, points.tree
    if notes[RENUMBERED] > 1:
        note_places(points.pairs, points.table, notes[LISTED])
        note_places(points.ranked, points.rank_table, notes[RANKED])
    has_changed = notes[RENUMBERED] > 0 or notes[REFRESHED] > 0
    met = 1
    moved = enter_links(mechanism, state, surface, points)
    met += moved
    for turn in range(notes[LINKS] + 1):
        link = -1
        if turn < notes[LINKS]:
            link = points.links[turn]
            if not follow_link(mechanism, state, surface, points, link):
                continue
            leaf = points.leaves[link]
        elif moved == 0:
            tree[WAY] = (tree[WAY] + 1) & WAYS
            break
        else:
            leaf = find_way(nodes, ties, tree)
        take_out(nodes, ties, tree, leaf)
        if link >= 0:
            write_leaf(nodes, points.bounds, leaf, link, BREAKING)
        put_in(nodes, ties, tree, leaf)
        if link >= 0:
            met += add_pairs(mechanism, points, link)
            moved = 1
    if moved > 0 or has_changed:
        end_pairs(mechanism, points, met, has_changed)
    notes[RENUMBERED] = notes[REFRESHED] = 0
    notes[STEPS] += 1
    rank_pairs(mechanism, state, surface, points, by_entry)


def enter_links(mechanism, state, surface, points):
    """Give boxes to new links, then end all pairs of links that got filters and give them new boxes.

    Returns how many boxes all these meet, 1 at least if there are any.
    """
    notes, nodes, ties, tree = points.notes, points.nodes, points.ties, points.tree
    met = entered = 0
    for turn in range(notes[LINKS] + notes[REFRESHED]):
        if turn < notes[LINKS]:
            link = points.links[turn]
            if points.leaves[link] >= 0:
                continue
            if points.bounds[link, 0] > points.bounds[link, 3]:  # the box in which it was made is not known
                place_box(state, surface.covers, link, link, points.bounds)
        else:
            link = points.refreshed[turn - notes[LINKS]]
            leaf = points.leaves[link]
            take_out(nodes, ties, tree, leaf)
            free_node(ties, tree, leaf)
            end_pairs_of(points, link)
            place_box(state, surface.covers, link, link, points.bounds)
        entered = 1
        leaf = points.leaves[link] = enter_leaf(ties, tree)
        ties[leaf, SECOND], ties[leaf, LINK] = -1, link
        write_leaf(nodes, points.bounds, leaf, link, 0.0)
        put_in(nodes, ties, tree, leaf)
        met += add_pairs(mechanism, points, link)
        points.seats[link, 0] = np.inf  # so that its box is compared again, also that of a fixed link
    return met if met > 0 else entered


def add_pairs(mechanism, points, link):
    """Add the pairs of a link with all whose boxes meet its own, in the order in which the tree has them.

    Returns how many boxes it meets, whether they are of new pairs or not.
    """
    nodes, ties, stack, leaf = points.nodes, points.ties, points.stack, points.leaves[link]
    stack[0] = points.tree[ROOT]
    depth, met = 1, 0
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if not overlap(nodes, node, leaf):
            continue
        if ties[node, SECOND] >= 0:
            stack[depth], stack[depth + 1] = ties[node, FIRST], ties[node, SECOND]
            depth += 2
        elif node != leaf:
            met += 1
            a, b = min(link, ties[node, LINK]), max(link, ties[node, LINK])
            if find_place(points.pairs, points.table, a, b) < 0:
                add_pair(points, a, b, first_rank(mechanism, points, a, b))
    return met


def add_pair(points, a, b, rank):
    """Add a pair of links behind the others, unless its rank is 0; note where there is no room for it."""
    pairs, place = points.pairs, points.notes[LISTED]
    if rank == 0:
        return
    if place >= pairs.shape[1]:
        points.notes[FULL] = 1
        return
    pairs[0, place], pairs[1, place], pairs[2, place] = a, b, rank
    points.notes[LISTED] = place + 1
    points.notes[SORTED] = 0  # the pair joins groups, whether it has ranks or not
    note_place(pairs, points.table, place)


def first_rank(mechanism, points, one, two):
    """Return -1 for two links that may touch, HIDDEN for a pair that does not, and 0 for what is none.

    Bullet's broad phase also has pairs of links of one robot that never touch, as those of parents, and of
    links without shapes.
    """
    turns, firsts = points.turns, points.firsts
    has_shapes = points.sizes[one] > 0 and points.sizes[two] > 0
    if has_shapes and may_touch(mechanism, turns[firsts[one]], turns[firsts[two]]):
        return -1
    if mechanism.body_root[one] == mechanism.body_root[two]:
        return HIDDEN
    is_fixed = mechanism.body_tree[one] < 0 and mechanism.body_tree[two] < 0
    if has_shapes or is_fixed:
        return 0
    for link in one, two:
        if points.sizes[link] > 0:
            geom = turns[firsts[link]]
            if mechanism.contype[geom] & ALL_MASKS | mechanism.conaffinity[geom] & 1 == 0:
                return 0
    return HIDDEN


def may_touch(mechanism, a, b):
    """Return whether MuJoCo looks for contacts of two geoms."""
    if mechanism.geom_weld[a] == mechanism.geom_weld[b]:
        return False
    bits = mechanism.contype[a] & mechanism.conaffinity[b] | mechanism.contype[b] & mechanism.conaffinity[a]
    if bits == 0:
        return False
    one, two = mechanism.geom_body[a], mechanism.geom_body[b]
    signature = (min(one, two) << 16) + max(one, two)
    found = False
    for k in range(mechanism.excluded.shape[0]):
        found |= mechanism.excluded[k] == signature
    return not found


def end_pairs(mechanism, points, fresh, has_changed):
    """End pairs whose boxes have parted: as many are checked as boxes met, but at least a share of all.

    has_changed: whether filters may have changed, so that links may touch that did not, or no longer.
    """
    notes, pairs, leaves = points.notes, points.pairs, points.leaves
    count = notes[LISTED]
    left = min(count, max(fresh, count * CHECKS // 100))
    at = notes[CHECKED]
    done = 0
    while done < left:
        place = (at + done) % count
        one, two = pairs[0, place], pairs[1, place]
        if overlap(points.nodes, leaves[one], leaves[two]):
            rank = first_rank(mechanism, points, one, two) if has_changed else -1
            if rank == HIDDEN and pairs[2, place] != HIDDEN:
                end_ranks(points, place)
                pairs[2, place] = HIDDEN
            elif rank < 0 and has_changed and pairs[2, place] == HIDDEN:
                pairs[2, place] = rank
            if rank < 0:
                done += 1
                continue
        end_pair(points, place)
        count -= 1
        left -= 1
    notes[CHECKED] = (at + left) % count if count > 0 else 0


def end_pairs_of(points, link):
    """End all pairs of a link."""
    place = 0
    while place < points.notes[LISTED]:
        if points.pairs[0, place] == link or points.pairs[1, place] == link:
            end_pair(points, place)
        else:
            place += 1


def end_pair(points, place):
    """End a pair of links, of which the last one takes the place."""
    pairs, table = points.pairs, points.table
    end_ranks(points, place)
    drop_place(pairs, table, place)
    last = points.notes[LISTED] - 1
    points.notes[LISTED] = last
    points.notes[SORTED] = 0
    if place < last:
        change_place(pairs, table, last, place)
        for k in range(3):
            pairs[k, place] = pairs[k, last]
