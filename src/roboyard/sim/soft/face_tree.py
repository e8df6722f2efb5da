"""Tree of the faces of a soft body, by which those that may touch each other are found."""

from __future__ import annotations

import numpy as np

from roboyard._records import NamedTuple
from roboyard.sim.soft.rest_shape import Ints, edges_of

SEED, FACTOR, ADDEND, BITS = 243703, 1664525, 1013904223, 0xFFFFFFFF
"""Numbers of Bullet's generator."""


class FaceTree(NamedTuple):
    """A binary tree whose leaves are faces; neighbours are joined first."""

    children: Ints
    """(k, 2) of the inner nodes, each after its children; numbers below that of faces are faces, the others
    inner nodes. The last one is the root."""
    height: int
    """Most inner nodes on a way from the root to a face."""


def face_tree(faces: Ints) -> FaceTree:
    """Return the tree of (m, 3) faces that Bullet builds of them.

    In each round a face, or what was joined before, is joined with its first neighbour that is not yet; two
    are neighbours if any of their faces share an edge. Which faces are compared at all depends on the tree.
    """
    near = _neighbours(faces)
    present = list(range(len(faces)))
    children: list[tuple[int, int]] = []
    height = 0
    while len(present) > 1:
        height += 1
        pairs = _pairs(near)
        owner = {old: new for new, pair in enumerate(pairs) for old in pair}
        joined = []
        for pair in pairs:
            if len(pair) == 2:
                joined.append(len(faces) + len(children))
                children.append((present[pair[0]], present[pair[1]]))
            else:
                joined.append(present[pair[0]])
        near = [
            sorted({owner[other] for old in pair for other in near[old]} - {new})
            for new, pair in enumerate(pairs)
        ]
        present = joined
    return FaceTree(np.array(children, dtype=np.int32).reshape(-1, 2), height)


def shuffled(faces: Ints) -> Ints:
    """Return (m, 3) faces of cloth in the order in which Bullet, which shuffles springs first, builds a tree.

    Source: Bullet 3.2, `btSoftBody::randomizeConstraints`.
    """
    order, seed = list(range(len(faces))), SEED
    for _ in range(len(edges_of(faces))):
        seed = (FACTOR * seed + ADDEND) & BITS
    for k in range(len(order)):
        seed = (FACTOR * seed + ADDEND) & BITS
        other = seed % len(order)
        order[k], order[other] = order[other], order[k]
    return np.ascontiguousarray(faces[order])


def _neighbours(faces: Ints) -> list[list[int]]:
    """Return the faces that share an edge with each face, in their order."""
    of_edge: dict[tuple[int, int], list[int]] = {}
    for number, face in enumerate(np.sort(faces, axis=1).tolist()):
        a, b, c = face
        for edge in ((a, b), (b, c), (a, c)):
            of_edge.setdefault(edge, []).append(number)
    found: list[set[int]] = [set() for _ in range(len(faces))]
    for sharing in of_edge.values():
        for number in sharing:
            found[number].update(sharing)
    return [sorted(others - {number}) for number, others in enumerate(found)]


def _pairs(near: list[list[int]]) -> list[tuple[int, ...]]:
    """Return who is joined with whom in a round; parts without neighbours are joined once all are."""
    taken = [False] * len(near)
    pairs: list[tuple[int, ...]] = []
    for number, others in enumerate(near):
        if taken[number]:
            continue
        taken[number] = True
        free = next((other for other in others if not taken[other]), -1)
        if free < 0:
            pairs.append((number,))
        else:
            taken[free] = True
            pairs.append((number, free))
    if len(pairs) == len(near):
        return [tuple(range(k, min(k + 2, len(near)))) for k in range(0, len(near), 2)]
    return pairs
