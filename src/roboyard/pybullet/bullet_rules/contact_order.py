"""Which of two contacting links Bullet calls A, and along which directions it reports friction.

Bullet orders a pair by the kinds of its shapes: a compound before a single convex shape, both before
triangles, heightfields and planes; of two of a kind, the body created first comes first. A link is a compound
if it has several shapes, or one that is not at its inertial frame. So is each OBJ file that a robot's file
names, within the link's: its parts come before other parts of compounds.

A compound keeps its parts in a tree of boxes, into which they were put one after the other; what may touch
another shape is found from the root down, the younger side first.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np

from roboyard.description.model import Collision, Heightfield, Mesh, Plane, Pose
from roboyard.pybullet.bullet_rules.mesh_objects import is_obj, split_geometry
from roboyard.pybullet.bullet_rules.models import LinkModel
from roboyard.pybullet.bullet_rules.shape_bounds import is_at
from roboyard.sim.stepping.broad_phase.box_tree import FIRST, ROOT, SECOND
from roboyard.sim.stepping.impulses.point_arrays import tree_of_boxes
from roboyard.transforms import Array, matrix_from_quaternion

SURFACE, CONVEX, COMPOUND, NESTED = range(4)
"""Kinds of shapes: triangles and planes, single convex shapes, parts of compounds, of compounds in these."""
_NEARLY_FLAT = sqrt(0.5)

Vector3 = tuple[float, float, float]


def kinds_of(link: LinkModel, *, from_file: bool) -> list[int]:
    """Return the kind of each shape of a link, after OBJ files were split into their objects.

    Args:
        link: the link.
        from_file: whether OBJ files are compounds of their own, as in the files of robots.
    """
    collisions = link.collisions
    if not collisions:
        return []
    if is_field(collisions):  # stored rotated, at its own origin
        return [SURFACE]
    parts = [split_geometry(shape.geometry) if not shape.concave else (None,) for shape in collisions]
    is_alone = len(collisions) == 1 and is_at(collisions[0], link.frame)
    if is_alone and len(parts[0]) == 1 and not (from_file and is_obj(collisions[0])):
        return [SURFACE if _is_surface(collisions[0]) else CONVEX]
    found: list[int] = []
    for shape, own in zip(collisions, parts, strict=True):
        nests = from_file and not is_alone and is_obj(shape)
        found += [SURFACE if _is_surface(shape) else NESTED if nests else COMPOUND] * len(own)
    return found


def _is_surface(shape: Collision) -> bool:
    geometry = shape.geometry
    return isinstance(geometry, Plane | Heightfield) or (shape.concave and isinstance(geometry, Mesh))


def is_field(shapes: Sequence[Collision]) -> bool:
    """Return whether a link is a single height field, which is no compound although it is stored rotated."""
    return len(shapes) == 1 and isinstance(shapes[0].geometry, Heightfield)


def tangents(normal: Vector3) -> tuple[Vector3, Vector3]:
    """Return two unit directions along a surface with this unit normal, as Bullet chooses them.

    If the normal is close to z, the first is perpendicular to it in the y-z plane; otherwise it is
    horizontal. The second completes a right-handed frame (normal, first, second).
    """
    x, y, z = normal
    if abs(z) > _NEARLY_FLAT:
        squared = y * y + z * z
        scale = 1.0 / sqrt(squared)
        first = (0.0, -z * scale, y * scale)
        return first, (squared * scale, -x * first[2], x * first[1])
    squared = x * x + y * y
    scale = 1.0 / sqrt(squared)
    first = (-y * scale, x * scale, 0.0)
    return first, (-z * first[1], z * first[0], squared * scale)


def visits_of(parts: Array, sizes: Sequence[int], frame: Pose, *, nests: bool) -> list[tuple[int, int]]:
    """Return the parts of a link in the order in which they are visited, and the tree's nodes.

    Args:
        parts: (n, 5, 3) boxes around them; see `ShapeForms`.
        sizes: number of parts of each shape of the link.
        frame: inertial frame in the link frame, along whose axes the boxes of the tree are.
        nests: whether each shape is a compound within the link's.

    Returns:
        The n rows of `ShapeForms.visits`.
    """
    count = len(parts)
    if sum(sizes) != count:
        return [(place, 1) for place in range(count)]
    if len(sizes) == count == 2:
        return [(1, 1), (0, 0)]
    turn = matrix_from_quaternion(frame.quaternion)
    middles = (parts[:, 0] - np.asarray(frame.position)) @ turn
    halves = np.abs(parts[:, 1:4] @ turn).sum(axis=1) + parts[:, 4]
    boxes = np.concatenate([middles - halves, middles + halves], axis=1)
    first, groups = 0, list[list[int]]()
    for size in sizes:
        groups.append(list(range(first, first + size)))
        first += size
    groups = [group for group in groups if group]
    around = [np.concatenate([boxes[g, :3].min(axis=0), boxes[g, 3:].max(axis=0)]) for g in groups]
    branches = list[_Branch]()
    for group in groups:
        order, nodes = _tree_of(boxes[group], [([place], []) for place in group])
        branches.append((order, [-node for node in nodes] if nests or len(groups) > 1 else nodes))
    order, nodes = _tree_of(np.array(around), branches)
    return list(zip(order, [*nodes, 0], strict=True))


_Branch = tuple[list[int], list[int]]
"""Parts in the order in which they are visited, and of each node above them, from the root down, the number
of parts on its side that is visited first."""


def _tree_of(boxes: Array, branches: Sequence[_Branch]) -> _Branch:
    """Return the tree to whose leaves, the boxes (n, 6), branches were added in turn."""
    if len(boxes) == 1:
        return branches[0]
    leaves, _, ties, tree = tree_of_boxes(boxes)
    branch_of = dict(zip(leaves.tolist(), branches, strict=True))
    sides: list[tuple[int, int]] = ties[:, [FIRST, SECOND]].tolist()
    order, nodes, stack = list[int](), list[int](), [int(tree[ROOT])]
    while stack:
        node = stack.pop()
        first, second = sides[node]
        if second < 0:
            order += branch_of[node][0]
            nodes += branch_of[node][1]
            continue
        nodes.append(_parts_below(sides, branch_of, second))
        stack += [first, second]
    return order, nodes


def _parts_below(sides: list[tuple[int, int]], branch_of: dict[int, _Branch], node: int) -> int:
    """Return the number of parts below a node.

    Args:
        sides: first and second side of each node, the second -1 for leaves.
        branch_of: branches at the leaves.
        node: the node.
    """
    count, stack = 0, [node]
    while stack:
        node = stack.pop()
        first, second = sides[node]
        if second < 0:
            count += len(branch_of[node][0])
        else:
            stack += [first, second]
    return count
