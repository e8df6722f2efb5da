"""Boxes parallel to the world's axes around links and around the parts of compounds."""

from __future__ import annotations

EVERYWHERE = 1e18
"""Half the size of a plane's box (m)."""
BREAKING = 0.02
"""Width (m) by which a link's box is enlarged in each step."""


def follow_link(mechanism, state, surface, points, link):
    """Write the boxes of a link and its shapes; return whether its own, enlarged, leaves its leaf."""
    bounds, tight, turns, nodes = points.bounds, points.tight, points.turns, points.nodes
    if mechanism.body_tree[link] < 0 and is_seated(state, points.seats, link):
        return False
    place_link(state, surface, bounds, link)
    first, size = points.firsts[link], points.sizes[link]
    if size > 0 and surface.compound[turns[first]] > 0:
        for k in range(size):
            place_box(mechanism, state, surface, tight, turns[first + k])
    elif size > 0:
        for k in range(6):
            tight[turns[first], k] = bounds[link, k]
    leaf, out = points.leaves[link], False
    for axis in range(3):
        out |= bounds[link, axis] - BREAKING < nodes[leaf, axis]
        out |= bounds[link, 3 + axis] + BREAKING > nodes[leaf, 3 + axis]
    return out


def is_seated(state, seats, link):
    """Return whether a link is where it was when its seat was written, and write it."""
    stays = True
    for k in range(3):
        stays &= seats[link, k] == state.xpos[link, k]
        seats[link, k] = state.xpos[link, k]
    for k in range(6):
        stays &= seats[link, 3 + k] == state.xmat[link, k]
        seats[link, 3 + k] = state.xmat[link, k]
    return stays


def place_link(state, surface, bounds, link):
    """Write the least and largest coordinates (m) of a link in the world; a plane's are everywhere."""
    covers = surface.covers
    for axis in range(3):
        middle, half = state.xpos[link, axis], covers[link, 4, axis]
        for k in range(3):
            middle += state.xmat[link, 3 * axis + k] * covers[link, 0, k]
        for edge in range(1, 4):
            along = 0.0
            for k in range(3):
                along += state.xmat[link, 3 * axis + k] * covers[link, edge, k]
            half += abs(along)
        if half >= EVERYWHERE:
            middle, half = 0.0, EVERYWHERE
        bounds[link, axis], bounds[link, 3 + axis] = middle - half, middle + half


def place_box(mechanism, state, surface, tight, geom):
    """Write the least and largest coordinates (m) of a part of a compound in the world."""
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


def write_leaf(nodes, bounds, leaf, link, width):
    """Write the box of a link, larger by a width (m) on each side, into its leaf."""
    for axis in range(3):
        low, high = bounds[link, axis] - width, bounds[link, 3 + axis] + width
        nodes[leaf, axis], nodes[leaf, 3 + axis], nodes[leaf, 6 + axis] = low, high, low + high
