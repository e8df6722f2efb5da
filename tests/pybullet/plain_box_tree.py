"""A plain version of Bullet's dynamic tree of boxes, with objects for nodes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(eq=False)
class Node:
    """A box of the tree; a leaf has no sides."""

    address: int
    box: np.ndarray
    """(2, 3) least and largest coordinates."""
    item: object = None
    above: Node | None = None
    sides: list[Node] = field(default_factory=list)


class BoxTree:
    """The tree; addresses are given as by an allocator that gives the latest that was freed first."""

    def __init__(self) -> None:
        self.root: Node | None = None
        self.held: int | None = None
        self.free: list[int] = []
        self.given = self.way = 0

    def add(self, box: np.ndarray, item: object) -> Node:
        """Add a box and return its leaf."""
        leaf = Node(self._address(), box, item)
        self._put_in(leaf)
        return leaf

    def remove(self, leaf: Node) -> None:
        """Remove a leaf."""
        self._take_out(leaf)
        self._let_go(leaf.address)

    def move(self, leaf: Node, box: np.ndarray) -> None:
        """Give a leaf another box and place."""
        self._take_out(leaf)
        leaf.box = box
        self._put_in(leaf)

    def improve(self) -> None:
        """Do what is done once in a step."""
        node, bit = self.root, 0
        if node is None:
            return
        while node.sides:
            node = self._exchanged(node).sides[(self.way >> bit) & 1]
            bit = (bit + 1) % 32
        self.move(node, node.box)
        self.way = (self.way + 1) % 2**32

    def meeting(self, box: np.ndarray) -> list[object]:
        """Return the items whose boxes meet a box, in order."""
        return self._meeting(self.root, box) if self.root else []

    def _meeting(self, node: Node, box: np.ndarray) -> list[object]:
        if (node.box[0] > box[1]).any() or (node.box[1] < box[0]).any():
            return []
        if not node.sides:
            return [node.item]
        return self._meeting(node.sides[1], box) + self._meeting(node.sides[0], box)

    def _address(self) -> int:
        held, self.held = self.held, None
        if held is not None:
            return held
        if self.free:
            return self.free.pop()
        self.given += 1
        return self.given

    def _let_go(self, address: int) -> None:
        if self.held is not None:
            self.free.append(self.held)
        self.held = address

    def _put_in(self, leaf: Node) -> None:
        beside = self.root
        if beside is None:
            self.root, leaf.above = leaf, None
            return
        while beside.sides:
            far = [np.abs(leaf.box.sum(axis=0) - side.box.sum(axis=0)).sum() for side in beside.sides]
            beside = beside.sides[0 if far[0] < far[1] else 1]
        above = beside.above
        node = Node(self._address(), _around(beside.box, leaf.box), above=above, sides=[beside, leaf])
        beside.above = leaf.above = node
        self._replace(above, beside, node)
        while above is not None:
            above.box, above = _around(*(side.box for side in above.sides)), above.above

    def _take_out(self, leaf: Node) -> None:
        node = leaf.above
        if node is None:
            self.root = None
            return
        beside = node.sides[1 - node.sides.index(leaf)]
        beside.above = above = node.above
        self._replace(above, node, beside)
        self._let_go(node.address)
        while above is not None:
            above.box, above = _around(*(side.box for side in above.sides)), above.above

    def _replace(self, above: Node | None, old: Node, new: Node) -> None:
        if above is None:
            self.root = new
        else:
            above.sides[above.sides.index(old)] = new

    def _exchanged(self, node: Node) -> Node:
        above = node.above
        if above is None or above.address < node.address:
            return node
        side = above.sides.index(node)
        beside, top = above.sides[1 - side], above.above
        self._replace(top, above, node)
        above.sides, node.sides = node.sides, [beside, beside]
        node.sides[side] = above
        node.above, above.above, beside.above = top, node, node
        for below in above.sides:
            below.above = above
        above.box, node.box = node.box, above.box
        return above


def _around(*boxes: np.ndarray) -> np.ndarray:
    return np.array([np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)])
