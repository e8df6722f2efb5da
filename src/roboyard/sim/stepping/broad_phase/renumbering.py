"""Geoms of bodies that come and go while all others keep their numbers."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.sim.stepping.broad_phase.box_tree import LINK, free_node, take_out
from roboyard.sim.stepping.broad_phase.meeting_pairs import end_pairs_of
from roboyard.sim.stepping.broad_phase.pair_table import note_places
from roboyard.sim.stepping.impulses.records import (
    EXTRA,
    FULL,
    HELD,
    LINKS,
    LISTED,
    PAIRS,
    POINTS,
    RANKED,
    RENUMBERED,
    SHAPES,
    SORTED,
    TABLE,
    TAKEN_UP,
)  # fmt: skip


@compiled(POINTS, "i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] i4[::1]")
def renumber(points, body_tree, geom_body, gone, come, gone_links, come_links):  # pragma: no cover
    """Let the geoms of removed bodies go and those of new bodies come, where all others keep their numbers.

    body_tree: (nbody,) tree of each link, -1 for what is fixed. geom_body: (ngeom,) link of each geom. gone,
    come: geoms, in the order of their links and shapes. gone_links, come_links: the links, in order. What
    remains of the points stays in order, and of ranks and pairs as if these had ended.
    """
    notes, turns, ages, links = points.notes, points.turns, points.ages, points.links
    if notes[RENUMBERED] > 1 and gone_links.shape[0] > 0:
        note_places(points.pairs, points.table, notes[LISTED])
        note_places(points.ranked, points.rank_table, notes[RANKED])
        notes[RENUMBERED] = 1
    for k in range(gone_links.shape[0]):
        drop_link(points, gone_links[k])
    for k in range(ages.shape[0]):
        ages[k] = 0
    for k in range(gone.shape[0]):
        ages[gone[k]] = -1
    if gone.shape[0] > 0:
        drop_points(points)
    left = 0
    for k in range(notes[SHAPES]):
        if ages[turns[k]] == 0:
            turns[left] = turns[k]
            left += 1
    for k in range(left, notes[SHAPES]):
        turns[k] = -1
    for k in range(gone.shape[0]):
        ages[gone[k]] = 0
    for k in range(come.shape[0]):
        turns[left] = come[k]
        left += 1
    notes[SHAPES] = left
    for k in range(come_links.shape[0]):
        link = come_links[k]
        links[notes[LINKS]] = link
        notes[LINKS] += 1
        points.seats[link, 0] = np.inf
        points.bounds[link, 0], points.bounds[link, 3] = 1.0, 0.0
    place_shapes(points, geom_body)
    place_trees(points, body_tree)
    notes[EXTRA] = notes[HELD] = notes[FULL] = notes[SORTED] = notes[TAKEN_UP] = 0
    notes[RENUMBERED] = max(notes[RENUMBERED], 1)


def drop_link(points, link):
    """Let a link go: its pairs end, and the last link takes its place."""
    notes, links = points.notes, points.links
    leaf = points.leaves[link]
    if leaf >= 0:
        take_out(points.nodes, points.ties, points.tree, leaf)
        free_node(points.ties, points.tree, leaf)
        end_pairs_of(points, link)
        points.leaves[link] = -1
    for turn in range(notes[LINKS]):
        if links[turn] == link:
            last = notes[LINKS] - 1
            links[turn] = links[last]
            links[last] = -1
            notes[LINKS] = last
            break


def place_shapes(points, geom_body):
    """Write the places of geoms in the order of creation, and of the first ones of links."""
    turns, sizes = points.turns, points.sizes
    for link in range(sizes.shape[0]):
        sizes[link] = 0
    for turn in range(points.notes[SHAPES]):
        points.ages[turns[turn]] = turn
        link = geom_body[turns[turn]]
        if sizes[link] == 0:
            points.firsts[link] = turn
        sizes[link] += 1


@compiled(POINTS, "i4[::1] i4[::1] i4[::1]")
def take_leaves(points, leaves, links, body_tree):  # pragma: no cover
    """Give the leaves of a tree that was copied their links, and take out those of none.

    leaves: (n,) nodes. links: (n,) their links, -1 for those that are gone. The links are the first ones in
    the order of updates then. body_tree: (nbody,) tree of each link, -1 for what is fixed.
    """
    notes, order = points.notes, points.links
    count = notes[LINKS]
    for k in range(leaves.shape[0]):
        link = links[k]
        if link < 0:
            take_out(points.nodes, points.ties, points.tree, leaves[k])
            free_node(points.ties, points.tree, leaves[k])
        else:
            points.leaves[link] = leaves[k]
            points.ties[leaves[k], LINK] = link
    left = 0
    for k in range(count):  # those without leaves behind the others, in order
        if points.leaves[order[k]] < 0:
            points.stack[left] = order[k]
            left += 1
    place = 0
    for k in range(links.shape[0]):
        if links[k] >= 0:
            order[place] = links[k]
            place += 1
    for k in range(left):
        order[place + k] = points.stack[k]
    place_trees(points, body_tree)


def drop_points(points):
    """Remove the kept points of geoms of age -1."""
    table = points.notes[TABLE]
    keys, counts, kept = points.keys[table], points.counts[table], points.points[table]
    geoms, left = points.ages.shape[0], 0
    for k in range(points.notes[PAIRS]):
        if points.ages[keys[k] // geoms] < 0 or points.ages[keys[k] % geoms] < 0:
            continue
        if left < k:
            keys[left], counts[left] = keys[k], counts[k]
            for m in range(kept.shape[1]):
                for j in range(kept.shape[2]):
                    kept[left, m, j] = kept[k, m, j]
        left += 1
    points.notes[PAIRS] = left


def place_trees(points, body_tree):
    """Number trees by their first links in the order of these, then those without any."""
    places, count = points.tree_places, 0
    for tree in range(places.shape[0]):
        places[tree] = -1
    for turn in range(points.notes[LINKS]):
        tree = body_tree[points.links[turn]]
        if tree >= 0 and places[tree] < 0:
            places[tree] = count
            count += 1
    for tree in range(places.shape[0]):
        if places[tree] < 0:
            places[tree] = count
            count += 1
