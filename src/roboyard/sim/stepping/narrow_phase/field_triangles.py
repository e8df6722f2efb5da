"""The triangles of a height field or a mesh near a shape, in the order of an impulse engine.

`begin` places the search before the first triangle, `next_triangle` writes the next one. Bullet looks at the
cells of a height field under the shape's box column by column, and at a mesh in the order of its tree.
"""

from __future__ import annotations

import numpy as np

from roboyard.sim.stepping.narrow_phase.closest_points import SECOND
from roboyard.sim.stepping.narrow_phase.field_kernels import BOUNDS, CURSOR, write_bounds

PLACE, TRIANGLE, COLUMN, ROW, HALF, FIRST_ROW, LAST_ROW, LAST_COLUMN = range(CURSOR, CURSOR + 8)
"""Places in the work array: of the leaf, or -1 at the end; of the triangle in it; of a cell, which of its
triangles is next, and the cells that are searched."""


def begin(fields, field, geom_type, body, xpos, xmat, boxes, shape, width, work):  # pragma: no cover
    """Place the search before the triangles that the box around a shape, enlarged by a width (m), may meet.

    The box is written at BOUNDS, in the frame of the field. Returns the margin (m) around the triangles.
    """
    number = fields.ids[field]
    mesh = fields.meshes[number]
    write_bounds(fields, field, geom_type, body, xpos, xmat, boxes, shape, work)
    margin = fields.margins[mesh] if mesh >= 0 else 0.0
    for k in range(3):
        work[BOUNDS + k] -= margin + width
        work[BOUNDS + 3 + k] += margin + width
    if mesh >= 0:
        place = next_leaf(fields, mesh, 0, work)
        work[PLACE] = place
        work[TRIANGLE] = first_triangle(fields, mesh, place) if place >= 0 else 0
        return margin
    rows, columns = fields.rows[number], fields.columns[number]
    wide, deep = fields.sizes[number, 0], fields.sizes[number, 1]
    step_x, step_y = 2.0 * wide / (columns - 1), 2.0 * deep / (rows - 1)
    work[COLUMN] = max(np.ceil((work[BOUNDS] + wide) / step_x) - 1.0, 0.0)
    work[LAST_COLUMN] = min(np.floor((work[BOUNDS + 3] + wide) / step_x), columns - 2.0)
    work[FIRST_ROW] = max(np.ceil((work[BOUNDS + 1] + deep) / step_y) - 1.0, 0.0)
    work[LAST_ROW] = min(np.floor((work[BOUNDS + 4] + deep) / step_y), rows - 2.0)
    work[ROW], work[HALF] = work[LAST_ROW], 0.0
    is_empty = work[COLUMN] > work[LAST_COLUMN] or work[FIRST_ROW] > work[LAST_ROW]
    work[PLACE] = -1.0 if is_empty else 0.0
    return margin


def next_triangle(fields, field, work):  # pragma: no cover
    """Write the next triangle that meets the box at BOUNDS in the world at SECOND.

    Returns:
        Whether there is one.
    """
    mesh = fields.meshes[fields.ids[field]]
    is_near = False
    while work[PLACE] >= 0.0 and not is_near:
        if mesh >= 0:
            triangle = int(work[TRIANGLE])
            is_near = write_triangle(fields, field, triangle, work)
            work[TRIANGLE] += 1.0
            place = int(work[PLACE])
            if triangle + 1 == end_of_leaf(fields, mesh, place):
                place = next_leaf(fields, mesh, after(place), work)
                work[PLACE] = place
                if place >= 0:
                    work[TRIANGLE] = first_triangle(fields, mesh, place)
            continue
        is_near = write_half_of_cell(fields, field, int(work[ROW]), int(work[COLUMN]), int(work[HALF]), work)
        work[HALF] = 1.0 - work[HALF]
        if work[HALF] == 0.0:
            work[ROW] -= 1.0
            if work[ROW] < work[FIRST_ROW]:
                work[ROW] = work[LAST_ROW]
                work[COLUMN] += 1.0
                if work[COLUMN] > work[LAST_COLUMN]:
                    work[PLACE] = -1.0
    return is_near


def write_corner(fields, field, row, column, z, work, place):  # pragma: no cover
    """Write a corner of a height field, whose height in the field is z (m), in the world at `place`."""
    number = fields.ids[field]
    x = fields.sizes[number, 0] * (2.0 * column / (fields.columns[number] - 1) - 1.0)
    y = fields.sizes[number, 1] * (2.0 * row / (fields.rows[number] - 1) - 1.0)
    for k in range(3):
        across = fields.turns[field, 3 * k] * x + fields.turns[field, 3 * k + 1] * y
        work[place + k] = across + fields.turns[field, 3 * k + 2] * z + fields.places[field, k]


def write_half_of_cell(fields, field, row, column, half, work):  # pragma: no cover
    """Write one of a cell's two triangles, on both sides of its diagonal, in the world at SECOND.

    Returns:
        Whether its heights meet the box at BOUNDS; else it is not written.
    """
    number = fields.ids[field]
    columns, rise = fields.columns[number], fields.sizes[number, 2]
    at = fields.starts[number] + row * columns + column
    z, above = rise * fields.heights[at], rise * fields.heights[at + columns + 1]
    side_row, side_column = (row + 1, column) if half == 0 else (row, column + 1)
    beside = rise * fields.heights[at + (columns if half == 0 else 1)]
    if min(z, above, beside) > work[BOUNDS + 5] or max(z, above, beside) < work[BOUNDS + 2]:
        return False
    t = SECOND + 3
    first, last = (t, t + 6) if half == 0 else (t + 6, t)
    write_corner(fields, field, row, column, z, work, first)
    write_corner(fields, field, row + 1, column + 1, above, work, t + 3)
    write_corner(fields, field, side_row, side_column, beside, work, last)
    return True


def first_triangle(fields, mesh, node):  # pragma: no cover
    """Return the first triangle of a leaf of a mesh's tree, given as its node."""
    return fields.leaves[fields.trees[mesh, 1] + node - fields.trees[mesh, 2] + 1]


def end_of_leaf(fields, mesh, node):  # pragma: no cover
    """Return the triangle after the last one of a leaf."""
    return fields.leaves[fields.trees[mesh, 1] + node - fields.trees[mesh, 2] + 2]


def next_leaf(fields, mesh, node, work):  # pragma: no cover
    """Return the leaf of a mesh's tree from a node on whose box meets the one at BOUNDS; -1 for none.

    Nodes are searched from first to second child, and so triangles are in the order of the mesh. A leaf is
    given as its node; `after` returns the one to go on from.
    """
    first, leaves = fields.trees[mesh, 0], fields.trees[mesh, 2]
    boxes = fields.boxes
    while node >= 0:
        at = first + node
        if (
            boxes[at, 0] > work[BOUNDS + 3] or boxes[at, 3] < work[BOUNDS]
            or boxes[at, 1] > work[BOUNDS + 4] or boxes[at, 4] < work[BOUNDS + 1]
            or boxes[at, 2] > work[BOUNDS + 5] or boxes[at, 5] < work[BOUNDS + 2]
        ):  # fmt: skip
            node = after(node)
        elif node >= leaves - 1:
            return node
        else:
            node = 2 * node + 1
    return -1


def after(node):  # pragma: no cover
    """Return the node of a complete binary tree that is searched after a node and all below it; -1: none."""
    while node > 0 and node % 2 == 0:
        node = (node - 1) // 2
    return node + 1 if node > 0 else -1


def write_triangle(fields, field, triangle, work):  # pragma: no cover
    """Write a triangle of a mesh in the world at SECOND; return whether its box meets the one at BOUNDS."""
    corners = fields.corners
    for d in range(3):
        x, y, z = corners[triangle, d], corners[triangle, 3 + d], corners[triangle, 6 + d]
        if min(x, y, z) > work[BOUNDS + 3 + d] or max(x, y, z) < work[BOUNDS + d]:
            return False
    for m in range(0, 9, 3):
        x, y, z = corners[triangle, m], corners[triangle, m + 1], corners[triangle, m + 2]
        for k in range(3):
            across = fields.turns[field, 3 * k] * x + fields.turns[field, 3 * k + 1] * y
            across += fields.turns[field, 3 * k + 2] * z
            work[SECOND + 3 + m + k] = across + fields.places[field, k]
    return True
