"""The order in which Bullet visits the parts of a compound.

A compound keeps its parts in a tree of boxes, into which they were put one after the other; what may touch
another shape is found from the root down, the younger side first. A file of several objects is a compound in
the link's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard.description.model import Pose
from roboyard.sim.stepping.broad_phase.box_tree import FIRST, ROOT, SECOND
from roboyard.sim.stepping.impulses.point_arrays import tree_of_boxes
from roboyard.transforms import Array, matrix_from_quaternion


def visits_of(parts: Array, sizes: Sequence[int], frame: Pose) -> list[int]:
    """Return the parts of a link in the order in which they are visited.

    Args:
        parts: (n, 5, 3) boxes around them; see `ShapeForms`.
        sizes: number of parts of each shape of the link.
        frame: inertial frame in the link frame, along whose axes the boxes of the tree are.
    """
    if sum(sizes) != len(parts):
        return list(range(len(parts)))
    if len(sizes) == len(parts) <= 2:
        return list(range(len(parts)))[::-1]
    turn = matrix_from_quaternion(frame.quaternion)
    middles = (parts[:, 0] - np.asarray(frame.position)) @ turn
    halves = np.abs(parts[:, 1:4] @ turn).sum(axis=1) + parts[:, 4]
    boxes = np.concatenate([middles - halves, middles + halves], axis=1)
    first, groups = 0, list[list[int]]()
    for size in sizes:
        groups.append(list(range(first, first + size)))
        first += size
    around = [np.concatenate([boxes[g, :3].min(axis=0), boxes[g, 3:].max(axis=0)]) for g in groups if g]
    groups = [group for group in groups if group]
    return [
        groups[place][inner]
        for place in _order_of(np.array(around))
        for inner in _order_of(boxes[groups[place]])
    ]


def _order_of(boxes: Array) -> list[int]:
    """Return boxes (n, 6) in the order in which a tree to which they were added in turn is visited."""
    if len(boxes) <= 2:
        return list(range(len(boxes)))[::-1]
    leaves, _, ties, tree = tree_of_boxes(boxes)
    place_of = {leaf: place for place, leaf in enumerate(leaves.tolist())}
    found, stack = list[int](), [int(tree[ROOT])]
    while stack:
        node = stack.pop()
        if node in place_of and ties[node, SECOND] < 0:
            found.append(place_of[node])
        else:
            stack += [int(ties[node, FIRST]), int(ties[node, SECOND])]
    return found
