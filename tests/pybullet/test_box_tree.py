"""The tree of boxes is that of a plain version; so is the table of pairs."""

from __future__ import annotations

import numpy as np
import pytest
from plain_box_tree import BoxTree, Node

from roboyard.sim.stepping.broad_phase.box_tree import (
    FIRST,
    LINK,
    NODE,
    ROOT,
    SECOND,
    TIES,
    TOP,
    TREE,
    WAY,
    find_way,
    free_node,
    new_node,
    put_in,
    take_out,
)
from roboyard.sim.stepping.broad_phase.pair_table import (
    change_place,
    drop_place,
    find_place,
    note_place,
)
from roboyard.sim.stepping.impulses.point_arrays import tree_of_boxes


class _Arrays:
    """The tree as arrays, with the functions of compiled loops."""

    def __init__(self, room: int) -> None:
        self.nodes, self.ties = np.zeros((room, NODE)), np.zeros((room, TIES), np.int32)
        self.tree = np.full(TREE, -1, np.int64)
        self.tree[[TOP, WAY]] = 0

    def _write(self, leaf: int, box: np.ndarray) -> None:
        self.nodes[leaf] = [*box[0], *box[1], *box.sum(axis=0)]
        put_in(self.nodes, self.ties, self.tree, leaf)

    def add(self, box: np.ndarray, item: int) -> int:
        leaf = int(new_node(self.ties, self.tree))
        self.ties[leaf, [SECOND, LINK]] = -1, item
        self._write(leaf, box)
        return leaf

    def remove(self, leaf: int) -> None:
        take_out(self.nodes, self.ties, self.tree, leaf)
        free_node(self.ties, self.tree, leaf)

    def move(self, leaf: int, box: np.ndarray) -> None:
        take_out(self.nodes, self.ties, self.tree, leaf)
        self._write(leaf, box)

    def improve(self) -> None:
        leaf = find_way(self.nodes, self.ties, self.tree)
        if leaf >= 0:
            take_out(self.nodes, self.ties, self.tree, leaf)
            put_in(self.nodes, self.ties, self.tree, leaf)

    def order(self) -> list[int]:
        """Return the items from the second side of the root on."""
        found, left = [], [int(self.tree[ROOT])] if self.tree[ROOT] >= 0 else []
        while left:
            node = left.pop()
            if self.ties[node, SECOND] < 0:
                found.append(int(self.ties[node, LINK]))
            else:
                left += [int(self.ties[node, FIRST]), int(self.ties[node, SECOND])]
        return found


def _random_box(rng: np.random.Generator) -> np.ndarray:
    middle, half = rng.uniform(-1, 1, 3), rng.uniform(0.01, 0.2, 3)
    return np.array([middle - half, middle + half])


def test_the_tree_is_that_of_a_plain_version() -> None:
    everything = np.array([[-1e9] * 3, [1e9] * 3])
    for seed in range(2):
        rng = np.random.default_rng(seed)
        plain, arrays, leaves = BoxTree(), _Arrays(100), dict[int, tuple[Node, int]]()
        for item in range(120):
            for known in [k for k in leaves if rng.random() < 0.3]:
                box = _random_box(rng)
                plain.move(leaves[known][0], box)
                arrays.move(leaves[known][1], box)
            if len(leaves) < 40 and rng.random() < 0.6:
                box = _random_box(rng)
                leaves[item] = plain.add(box, item), arrays.add(box, item)
            elif leaves and rng.random() < 0.3:
                gone = leaves.pop(int(rng.choice(list(leaves))))
                plain.remove(gone[0])
                arrays.remove(gone[1])
            plain.improve()
            arrays.improve()
            assert arrays.order() == plain.meeting(everything), (seed, item)
            box = _random_box(rng)
            met = {k for k, (node, _) in leaves.items() if not _apart(node.box, box)}
            assert set(plain.meeting(box)) == met


def _apart(one: np.ndarray, two: np.ndarray) -> bool:
    return bool((one[0] > two[1]).any() or (one[1] < two[0]).any())


def test_a_tree_of_boxes_that_are_not_numbers_ends() -> None:
    arrays = _Arrays(20)
    boxes = [np.full((2, 3), np.nan), *(_random_box(np.random.default_rng(k)) for k in range(4))]
    leaves = [arrays.add(box, k) for k, box in enumerate(boxes)]
    for step in range(20):
        arrays.move(leaves[step % 5], boxes[(step + 2) % 5])
        arrays.improve()
    assert sorted(arrays.order()) == list(range(5))


@pytest.mark.parametrize("count", [0, 1, 2, 9])
def test_the_tree_of_several_boxes_is_that_of_one_after_the_other(count: int) -> None:
    rng = np.random.default_rng(count)
    boxes = [_random_box(rng) for _ in range(count)]
    arrays = _Arrays(2 * count + 2)
    arrays.ties[:] = -1
    expected = [arrays.add(box, -1) for box in boxes]
    leaves, nodes, ties, tree = tree_of_boxes(np.array(boxes).reshape(count, 6))
    assert leaves.tolist() == expected
    np.testing.assert_array_equal(nodes, arrays.nodes)
    used = int(tree[TOP])
    np.testing.assert_array_equal(ties[:used, :LINK], arrays.ties[:used, :LINK])
    assert tree[[ROOT, TOP]].tolist() == arrays.tree[[ROOT, TOP]].tolist()
    assert (nodes.dtype, ties.dtype, tree.dtype) == (np.float64, np.int32, np.int64)


def test_places_of_pairs_are_found_as_in_a_dictionary() -> None:
    rng = np.random.default_rng(3)
    pairs, table = np.zeros((2, 64), np.int32), np.full(128, -1, np.int32)
    known: dict[tuple[int, int], int] = {}
    for _ in range(3000):
        a, b = sorted(rng.choice(14, 2, replace=False).tolist())
        place = find_place(pairs, table, a, b)
        assert place == known.get((a, b), -1)
        if place < 0 and len(known) < 64:
            pairs[:, len(known)] = a, b
            note_place(pairs, table, len(known))
            known[a, b] = len(known)
        elif place >= 0 and rng.random() < 0.7:
            drop_place(pairs, table, place)
            last = len(known) - 1
            del known[a, b]
            if place < last:
                change_place(pairs, table, last, place)
                pairs[:, place] = pairs[:, last]
                known[tuple(pairs[:, last].tolist())] = place
    assert len(known) > 20 and (table >= 0).sum() == len(known)
