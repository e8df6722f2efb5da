"""Boxes parallel to the world's axes around links and around the parts of compounds."""

from __future__ import annotations

import math

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


def meets_along(state, surface, a, one, b, two):
    """Return whether the boxes of two parts meet along the axes of the box of the first one's link.

    Bullet compares a part's box along its own link's axes, which it surrounds along those of the first link.
    """
    xmat = state.xmat
    for axis in range(1, 4):
        x = turned(xmat, one, 0, surface.covers, one, axis)
        y = turned(xmat, one, 1, surface.covers, one, axis)
        z = turned(xmat, one, 2, surface.covers, one, axis)
        length = math.sqrt(x * x + y * y + z * z)
        if length == 0.0 or length >= EVERYWHERE:
            continue
        x, y, z = x / length, y / length, z / length
        gap = x * (state.xpos[one, 0] + turned(xmat, one, 0, surface.parts, a, 0))
        gap += y * (state.xpos[one, 1] + turned(xmat, one, 1, surface.parts, a, 0))
        gap += z * (state.xpos[one, 2] + turned(xmat, one, 2, surface.parts, a, 0))
        gap -= x * (state.xpos[two, 0] + turned(xmat, two, 0, surface.parts, b, 0))
        gap -= y * (state.xpos[two, 1] + turned(xmat, two, 1, surface.parts, b, 0))
        gap -= z * (state.xpos[two, 2] + turned(xmat, two, 2, surface.parts, b, 0))
        if abs(gap) > half_along(xmat, one, surface.parts, a, x, y, z) + half_around(
            xmat, two, surface, b, x, y, z
        ):
            return False
    return True


def half_around(xmat, link, surface, part, x, y, z):
    """Return half the size (m) along a unit vector of a part's box, of a compound's along the link's axes."""
    if surface.compound[part] == 0:
        return half_along(xmat, link, surface.parts, part, x, y, z)
    half = 0.0
    for axis in range(1, 4):
        u = turned(xmat, link, 0, surface.covers, link, axis)
        v = turned(xmat, link, 1, surface.covers, link, axis)
        w = turned(xmat, link, 2, surface.covers, link, axis)
        length = math.sqrt(u * u + v * v + w * w)
        if length == 0.0:
            return half_along(xmat, link, surface.parts, part, x, y, z)
        u, v, w = u / length, v / length, w / length
        half += half_along(xmat, link, surface.parts, part, u, v, w) * abs(u * x + v * y + w * z)
    return half


def half_along(xmat, link, boxes, item, x, y, z):
    """Return half the size (m) along a unit vector of one of the boxes in the frame of a link."""
    half = max(boxes[item, 4, 0], boxes[item, 4, 1], boxes[item, 4, 2])
    for edge in range(1, 4):
        along = x * turned(xmat, link, 0, boxes, item, edge)
        along += y * turned(xmat, link, 1, boxes, item, edge)
        half += abs(along + z * turned(xmat, link, 2, boxes, item, edge))
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
