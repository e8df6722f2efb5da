"""Boxes parallel to the world's axes around links and around the parts of compounds."""

from __future__ import annotations

from roboyard.sim.stepping.impulses.records import STEPS

EVERYWHERE = 1e18
"""Half the size of a plane's box (m)."""
BREAKING = 0.02
"""Width (m) by which a link's box is enlarged in each step."""
REST = 1e-4
"""Width (m) by which it may leave its leaf and stay there, so that links at rest do; PyBullet's leave it."""


def follow_link(mechanism, state, surface, points, link):
    """Write the box of a link; return whether it leaves the link's leaf when it is enlarged."""
    bounds, nodes = points.bounds, points.nodes
    if mechanism.body_tree[link] < 0 and is_seated(state, points.seats, link):
        return False
    place_box(state, surface.covers, link, link, bounds)
    leaf, out = points.leaves[link], False
    for axis in range(3):
        out |= bounds[link, axis] - BREAKING < nodes[leaf, axis] - REST
        out |= bounds[link, 3 + axis] + BREAKING > nodes[leaf, 3 + axis] + REST
    return out


def place_part(state, surface, points, geom, link):
    """Write the box of a shape of a link, once in a step."""
    if points.written[geom] != points.notes[STEPS]:
        points.written[geom] = points.notes[STEPS]
        place_box(state, surface.parts, geom, link, points.tight)


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


def place_box(state, boxes, item, link, placed):
    """Write the least and largest coordinates (m) in the world of one of the boxes in the frame of a link.

    boxes: (n, 5, 3) middle, three half axes, and half the size along the world's axes in addition (m); boxes
    without an end, as of planes, are everywhere.
    """
    for axis in range(3):
        middle = state.xpos[link, axis] + turned(state.xmat, link, axis, boxes, item, 0)
        half = half_size(state.xmat, link, axis, boxes, item)
        if half >= EVERYWHERE:
            middle, half = 0.0, EVERYWHERE
        placed[item, axis], placed[item, 3 + axis] = middle - half, middle + half


def half_size(xmat, link, axis, boxes, item):
    """Return half the size (m) along an axis of the world of one of the boxes in the frame of a link."""
    half = boxes[item, 4, axis]
    for edge in range(1, 4):
        half += abs(turned(xmat, link, axis, boxes, item, edge))
    return half


def turned(xmat, link, axis, boxes, item, row):
    """Return the coordinate along an axis of the world of a vector in the frame of a link."""
    along = 0.0
    for k in range(3):
        along += xmat[link, 3 * axis + k] * boxes[item, row, k]
    return along


def write_leaf(nodes, bounds, leaf, link, width):
    """Write the box of a link, larger by a width (m) on each side, into its leaf."""
    for axis in range(3):
        low, high = bounds[link, axis] - width, bounds[link, 3 + axis] + width
        nodes[leaf, axis], nodes[leaf, 3 + axis], nodes[leaf, 6 + axis] = low, high, low + high
