"""Pairs of shapes whose boxes meet, in the order in which Bullet has them.

Its broad phase gives each shape a box parallel to the world's axes, which is larger than the shape and stays
until the shape leaves it. Boxes that meet make a pair, whether the shapes touch or not. Each pair has a rank
in the order of solution, but parts of compounds only while their own boxes meet, without a margin. A new
pair comes last, and the last takes the place of one that ends, which is noticed some steps later. A new shape
meets others in the box in which it was made, which may be elsewhere by the first step. A shape
that gets a filter leaves the broad phase and comes back: its pairs end, and those it has come last.
"""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled
from roboyard.sim.stepping.impulses.records import (
    CHECKED,
    EXTRA,
    FULL,
    HELD,
    HIDDEN,
    LISTED,
    PAIRS,
    POINTS,
    RANKED,
    REFRESHED,
    RENUMBERED,
    SHAPES,
    SORTED,
    TABLE,
    TAKEN_UP,
)  # fmt: skip

PLANE = 0
"""MuJoCo's type of these geoms."""
EVERYWHERE = 1e18
"""Half the size of a plane's box (m)."""
BREAKING = 0.02
"""Width (m) by which a shape's box is enlarged when it is compared with the one it is in."""
SPARE = 2e-4
"""Width (m) by which the box that it gets then is enlarged besides, so that a body at rest keeps its box;
PyBullet adds nothing."""
CHECKS = 10
"""Pairs are checked in turn for whether they ended: so many of a hundred in a step."""


def meet(mechanism, state, surface, points):
    """Update the boxes of all geoms, the pairs and their ranks."""
    notes, tight, wide, seats = points.notes, points.tight, points.wide, points.seats
    if notes[RENUMBERED] > 0:
        list_pairs(points)
        notes[RENUMBERED] = 0
    count, moved, met = notes[SHAPES], 0, 1
    for turn in range(count):
        geom = points.turns[turn]
        if wide[geom, 0] > wide[geom, 3]:
            if tight[geom, 0] >= tight[geom, 3]:  # the box in which it was made is not known
                place_box(mechanism, state, surface, tight, geom)
            enlarge(tight, wide, geom, 0.0)
            met += add_pairs(mechanism, points, geom)
            seats[geom, 0] = np.inf
            moved = 1
    if notes[REFRESHED] > 0:
        for k in range(notes[REFRESHED]):
            for turn in range(points.refreshed[k, 0], points.refreshed[k, 1]):
                met += refresh(mechanism, state, surface, points, points.turns[turn])
        notes[REFRESHED] = 0
        moved = 1
        list_pairs(points)
    for turn in range(count):
        geom = points.turns[turn]
        body = mechanism.geom_body[geom]
        if mechanism.geom_weld[geom] == 0:
            x, y, z = state.xpos[body, 0], state.xpos[body, 1], state.xpos[body, 2]
            if seats[geom, 0] == x and seats[geom, 1] == y and seats[geom, 2] == z:
                continue
            seats[geom, 0], seats[geom, 1], seats[geom, 2] = x, y, z
        place_box(mechanism, state, surface, tight, geom)
        if leaves_box(tight, wide, geom):
            enlarge(
                tight,
                wide,
                geom,
                BREAKING + SPARE if overlap(tight, geom, wide, geom, BREAKING) else BREAKING,
            )
            met += add_pairs(mechanism, points, geom)
            moved = 1
    if moved == 1:
        end_pairs(mechanism, points, met)
    rank_pairs(surface.compound, points)


def refresh(mechanism, state, surface, points, geom):
    """End all pairs of a geom and give it a new box and new pairs; return how many boxes it meets.

    The table of pairs is filled later.
    """
    notes, pairs, wide = points.notes, points.pairs, points.wide
    place = met = 0
    while place < notes[LISTED]:
        if pairs[0, place] == geom or pairs[1, place] == geom:
            end_pair(points, place)
        else:
            place += 1
    place_box(mechanism, state, surface, points.tight, geom)
    enlarge(points.tight, wide, geom, 0.0)
    points.seats[geom, 0] = np.inf  # so that its box is compared again, also that of a fixed body
    count = notes[SHAPES]
    for k in range(count):
        other = points.turns[count - 1 - k]
        if overlap(wide, geom, wide, other, 0.0) and other != geom and wide[other, 0] <= wide[other, 3]:
            a, b, place, met = min(geom, other), max(geom, other), notes[LISTED], met + 1
            rank = first_rank(mechanism, a, b)
            if rank < 0:
                if place >= pairs.shape[1]:
                    notes[FULL] = 1
                    break
                pairs[0, place], pairs[1, place], pairs[2, place] = a, b, rank
                notes[LISTED] = place + 1
    notes[SORTED] = 0
    return met


def place_box(mechanism, state, surface, tight, geom):
    """Write the least and largest coordinates (m) of a geom in the world."""
    if mechanism.geom_type[geom] == PLANE:
        for axis in range(3):
            tight[geom, axis], tight[geom, 3 + axis] = -EVERYWHERE, EVERYWHERE
        return
    body, boxes = mechanism.geom_body[geom], surface.boxes
    for axis in range(3):
        middle, half = state.xpos[body, axis], 0.0
        for k in range(3):
            middle += state.xmat[body, 3 * axis + k] * boxes[geom, 0, k]
        for edge in range(1, 4):
            along = 0.0
            for k in range(3):
                along += state.xmat[body, 3 * axis + k] * boxes[geom, edge, k]
            half += abs(along)
        tight[geom, axis], tight[geom, 3 + axis] = middle - half, middle + half


def enlarge(tight, wide, geom, width):
    """Give a geom a box that is larger than its own by a width (m) on each side."""
    for axis in range(3):
        wide[geom, axis] = tight[geom, axis] - width
        wide[geom, 3 + axis] = tight[geom, 3 + axis] + width


def leaves_box(tight, wide, geom):
    """Return whether a geom, enlarged, is not within the box that it is in."""
    out = False
    for axis in range(3):
        out |= tight[geom, axis] - BREAKING < wide[geom, axis]
        out |= tight[geom, 3 + axis] + BREAKING > wide[geom, 3 + axis]
    return out


def overlap(boxes, a, others, b, width):
    """Return whether box a, enlarged by a width (m), and box b of others meet."""
    for axis in range(3):
        if boxes[a, axis] - width > others[b, 3 + axis] or boxes[a, 3 + axis] + width < others[b, axis]:
            return False
    return True


def add_pairs(mechanism, points, geom):
    """Add the pairs of a geom with all that have boxes, where these meet its own, the latest ones first.

    In Bullet's tree a box is on the second side of the node that it is added to, which is searched first.
    Returns how many boxes it meets, whether they are of new pairs or not.
    """
    wide, met = points.wide, 0
    count = points.notes[SHAPES]
    for k in range(count):
        other = points.turns[count - 1 - k]
        if overlap(wide, geom, wide, other, 0.0) and other != geom and wide[other, 0] <= wide[other, 3]:
            a, b = min(geom, other), max(geom, other)
            met += 1
            rank = first_rank(mechanism, a, b)
            if rank < 0 and place_of_pair(points, a, b) < 0:
                add_pair(points, a, b, rank)
    return met


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


def first_rank(mechanism, a, b):
    """Return what a new pair has in place of a rank, 0 where it is none.

    Bullet's broad phase also has pairs of links of one robot that never touch, as those of parents.
    """
    if may_touch(mechanism, a, b):
        return -1
    one, two = mechanism.geom_body[a], mechanism.geom_body[b]
    if one != two and one > 0 and two > 0 and mechanism.body_root[one] == mechanism.body_root[two]:
        return HIDDEN
    return 0


def add_pair(points, a, b, rank):
    """Add a pair behind the others, without a rank; note where there is no room for it."""
    pairs, place = points.pairs, points.notes[LISTED]
    if place >= pairs.shape[1]:
        points.notes[FULL] = 1
        return
    pairs[0, place], pairs[1, place], pairs[2, place] = a, b, rank
    points.notes[LISTED] = place + 1
    points.notes[SORTED] = 0  # the pair joins groups, if it has a rank or not
    note_pair(points, place)


def note_pair(points, place):
    """Write a pair's place into the table in which `place_of_pair` looks."""
    mask = points.table.shape[0] - 1
    entry = spread(points.pairs[0, place], points.pairs[1, place]) & mask
    while points.table[entry] >= 0:
        entry = (entry + 1) & mask
    points.table[entry] = place


def place_of_pair(points, a, b):
    """Return the place of a pair among all, -1 where there is none."""
    mask = points.table.shape[0] - 1
    entry = spread(a, b) & mask
    while points.table[entry] >= 0:
        place = points.table[entry]
        if points.pairs[0, place] == a and points.pairs[1, place] == b:
            return place
        entry = (entry + 1) & mask
    return -1


def spread(a, b):
    """Return a number below 2^31 that differs much where a pair differs little."""
    mixed = (int(a) * 2654435761 + int(b) * 40503) & 0x7FFFFFFF
    return mixed ^ (mixed >> 15)


def end_pairs(mechanism, points, fresh):
    """End pairs whose boxes have parted: as many are checked as boxes met, but at least a share of all."""
    notes, pairs, wide = points.notes, points.pairs, points.wide
    count = notes[LISTED]
    left = min(count, max(fresh, count * CHECKS // 100))
    at = notes[CHECKED]
    done, ended = 0, False
    while done < left:
        place = (at + done) % count
        a, b = pairs[0, place], pairs[1, place]
        if overlap(wide, a, wide, b, 0.0):
            rank = first_rank(mechanism, a, b)
            if rank == HIDDEN:
                end_rank(points, place)
                pairs[2, place] = HIDDEN
            elif rank < 0 and pairs[2, place] == HIDDEN:
                pairs[2, place] = -1
            if rank < 0:
                done += 1
                continue
        end_pair(points, place)
        count -= 1
        left -= 1
        ended = True
    notes[CHECKED] = (at + left) % count if count > 0 else 0
    if ended:
        notes[SORTED] = 0
        list_pairs(points)


def end_pair(points, place):
    """End a pair, of which the last one takes the place; the table of pairs is filled later."""
    pairs = points.pairs
    end_rank(points, place)
    last = points.notes[LISTED] - 1
    points.notes[LISTED] = last
    if place < last:
        for k in range(3):
            pairs[k, place] = pairs[k, last]
        if pairs[2, place] >= 0:
            points.ranked[pairs[2, place]] = place


def rank_pairs(compound, points):
    """Give ranks to pairs that have none, and take those of parts of compounds whose own boxes parted."""
    pairs, tight = points.pairs, points.tight
    for place in range(points.notes[LISTED]):
        a, b = pairs[0, place], pairs[1, place]
        if pairs[2, place] == HIDDEN:
            continue
        meets = True
        if compound[a] > 0 or compound[b] > 0:
            meets = overlap(tight, a, tight, b, 0.0)
        if meets and pairs[2, place] < 0:
            pairs[2, place] = points.notes[RANKED]
            points.ranked[points.notes[RANKED]] = place
            points.notes[RANKED] += 1
            points.notes[SORTED] = 0
        elif not meets and pairs[2, place] >= 0:
            end_rank(points, place)


def end_rank(points, place):
    """Let the pair of the last rank take that of a pair, if it has one."""
    pairs, ranked, rank = points.pairs, points.ranked, points.pairs[2, place]
    if rank < 0:
        return
    last = points.notes[RANKED] - 1
    ranked[rank] = ranked[last]
    pairs[2, ranked[rank]] = rank
    pairs[2, place] = -1
    points.notes[RANKED] = last
    points.notes[SORTED] = 0


def list_pairs(points):
    """Fill the table in which `place_of_pair` looks."""
    for entry in range(points.table.shape[0]):
        points.table[entry] = -1
    for place in range(points.notes[LISTED]):
        note_pair(points, place)


@compiled(POINTS, "i4[::1] i4[::1] i4[::1]")
def renumber(points, geom_tree, gone, come):  # pragma: no cover
    """Let the geoms of removed bodies go and those of new bodies come, where all others keep their numbers.

    geom_tree: (ngeom,) tree of each geom, -1 for what is fixed. gone, come: geoms, those that come in the
    order of their links and shapes. What remains of the pairs, of their points and of their ranks stays in
    order. Without any pair all boxes are made again.
    """
    notes, turns, ages = points.notes, points.turns, points.ages
    if notes[PAIRS] == 0 and notes[LISTED] == 0:
        notes[CHECKED] = 0
        for geom in range(ages.shape[0]):
            forget_box(points, geom)
    for k in range(ages.shape[0]):
        ages[k] = 0
    for k in range(gone.shape[0]):
        ages[gone[k]] = -1
    if gone.shape[0] > 0:
        drop_points(points)
        drop_pairs(points)
    left = 0
    for k in range(notes[SHAPES]):
        if ages[turns[k]] == 0:
            turns[left] = turns[k]
            left += 1
    for k in range(left, notes[SHAPES]):
        turns[k] = -1
    for k in range(gone.shape[0]):
        ages[gone[k]] = 0
        forget_box(points, gone[k])
    for k in range(come.shape[0]):
        turns[left] = come[k]
        forget_box(points, come[k])
        left += 1
    notes[SHAPES] = left
    for turn in range(left):
        ages[turns[turn]] = turn
    place_trees(points, geom_tree)
    notes[EXTRA] = notes[HELD] = notes[FULL] = notes[SORTED] = notes[TAKEN_UP] = 0
    notes[RENUMBERED] = 1


def forget_box(points, geom):
    """Let a geom get its boxes in the next step."""
    for axis in range(6):
        points.tight[geom, axis] = points.wide[geom, axis] = 0.0
    points.wide[geom, 0] = 1.0
    for axis in range(3):
        points.seats[geom, axis] = np.inf


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


def drop_pairs(points):
    """Remove the pairs of geoms of age -1; the others move up, in order and rank."""
    notes, pairs, ranked = points.notes, points.pairs, points.ranked
    for rank in range(notes[RANKED]):
        place = ranked[rank]
        if points.ages[pairs[0, place]] < 0 or points.ages[pairs[1, place]] < 0:
            pairs[2, place] = -1
    left = 0
    for rank in range(notes[RANKED]):
        place = ranked[rank]
        if pairs[2, place] >= 0:
            pairs[2, place] = left
            left += 1
    notes[RANKED] = left
    left = 0
    for place in range(notes[LISTED]):
        if points.ages[pairs[0, place]] < 0 or points.ages[pairs[1, place]] < 0:
            continue
        for k in range(3):
            pairs[k, left] = pairs[k, place]
        if pairs[2, left] >= 0:
            ranked[pairs[2, left]] = left
        left += 1
    notes[LISTED] = left
    notes[CHECKED] = min(notes[CHECKED], max(left - 1, 0))


def place_trees(points, geom_tree):
    """Number trees by their first geoms in the order of these, then those without any."""
    places, count = points.tree_places, 0
    for tree in range(places.shape[0]):
        places[tree] = -1
    for turn in range(points.notes[SHAPES]):
        tree = geom_tree[points.turns[turn]]
        if tree >= 0 and places[tree] < 0:
            places[tree] = count
            count += 1
    for tree in range(places.shape[0]):
        if places[tree] < 0:
            places[tree] = count
            count += 1
