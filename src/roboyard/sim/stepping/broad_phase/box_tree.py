"""A tree of boxes in which each box goes beside the one that is nearest to it, as Bullet's dynamic tree.

Its leaves are the boxes of links. In which order the boxes that meet another one are found follows from the
tree, so it is the same as Bullet's: a box that is put in goes down to the nearer side of each node and
becomes the second side of a new node; one that is taken out leaves its sibling in place of their node. In
each step one way down is followed, on which nodes above younger ones are exchanged and the leaf at its end is
put in again. Bullet compares the addresses of nodes where this compares their numbers, which are given as an
allocator does: the latest that was freed first.

The arrays of a tree, which all functions have as arguments:

nodes: (n, 9) least and largest coordinates (m) of each node's box, and their sums.
ties: (n, 4) of each node: the node above, -1 for none, its first and second side, the second -1 for leaves,
and the link that a leaf is of.
tree: (5,) numbers at the places ROOT and following.

Source:
    Bullet, btDbvt.cpp and btDbvtBroadphase.cpp.
"""

from __future__ import annotations

ABOVE, FIRST, SECOND, LINK, ENTRY, TIES = range(6)
"""Columns of `ties`."""
ROOT, HELD_NODE, TOP, FREED, WAY, ENTERED, TREE = range(7)
"""Places in `tree`: the root; a node kept for the next one; how many numbers were given; the latest that was
freed, those before it at `ABOVE`; the sides that the next step goes down, one in each bit; how many leaves
were entered. The first four are -1 for none."""
NODE = 9
"""Numbers of a node."""
WAYS = 0xFFFFFFFF
"""Bits of the sides to go down."""


def put_in(nodes, ties, tree, leaf):
    """Put a leaf, whose box is written, beside the leaf that is nearest to it."""
    beside = tree[ROOT]
    if beside < 0:
        tree[ROOT] = leaf
        ties[leaf, ABOVE] = -1
        return
    while ties[beside, SECOND] >= 0:
        one, two = ties[beside, FIRST], ties[beside, SECOND]
        beside = one if distance(nodes, leaf, one) < distance(nodes, leaf, two) else two
    above, node = ties[beside, ABOVE], new_node(ties, tree)
    ties[node, ABOVE], ties[node, FIRST], ties[node, SECOND] = above, beside, leaf
    ties[beside, ABOVE] = ties[leaf, ABOVE] = node
    enclose(nodes, node, beside, leaf)
    if above < 0:
        tree[ROOT] = node
        return
    ties[above, SECOND if ties[above, SECOND] == beside else FIRST] = node
    while above >= 0 and not contains(nodes, above, node):
        enclose(nodes, above, ties[above, FIRST], ties[above, SECOND])
        node, above = above, ties[above, ABOVE]


def take_out(nodes, ties, tree, leaf):
    """Take a leaf out of the tree; it keeps its number."""
    node = ties[leaf, ABOVE]
    if node < 0:
        tree[ROOT] = -1
        return
    above = ties[node, ABOVE]
    beside = ties[node, FIRST] if ties[node, SECOND] == leaf else ties[node, SECOND]
    ties[beside, ABOVE] = above
    free_node(ties, tree, node)
    if above < 0:
        tree[ROOT] = beside
        return
    ties[above, SECOND if ties[above, SECOND] == node else FIRST] = beside
    while above >= 0 and enclose(nodes, above, ties[above, FIRST], ties[above, SECOND]):
        above = ties[above, ABOVE]


def find_way(nodes, ties, tree):
    """Exchange nodes above younger ones on the next way down; return the leaf at its end, -1 for none."""
    node, bit = tree[ROOT], 0
    if node < 0:
        return -1
    while ties[node, SECOND] >= 0:
        node = exchange(nodes, ties, tree, node)
        node = ties[node, SECOND if (tree[WAY] >> bit) & 1 else FIRST]
        bit = (bit + 1) & 31
    tree[WAY] = (tree[WAY] + 1) & WAYS
    return node


def exchange(nodes, ties, tree, node):
    """Exchange a node with the one above it if that is younger; return which of both is below then."""
    above = ties[node, ABOVE]
    if above <= node:
        return node
    side = SECOND if ties[above, SECOND] == node else FIRST
    beside, top = ties[above, FIRST + SECOND - side], ties[above, ABOVE]
    if top < 0:
        tree[ROOT] = node
    else:
        ties[top, SECOND if ties[top, SECOND] == above else FIRST] = node
    ties[beside, ABOVE] = ties[above, ABOVE] = node
    ties[node, ABOVE] = top
    one, two = ties[node, FIRST], ties[node, SECOND]
    ties[above, FIRST], ties[above, SECOND] = one, two
    ties[one, ABOVE] = ties[two, ABOVE] = above
    ties[node, side], ties[node, FIRST + SECOND - side] = above, beside
    for k in range(NODE):
        nodes[node, k], nodes[above, k] = nodes[above, k], nodes[node, k]
    return above


def enter_leaf(ties, tree):
    """Return the number of a new leaf, which notes how many leaves were entered before it."""
    leaf = new_node(ties, tree)
    ties[leaf, ENTRY] = tree[ENTERED]
    tree[ENTERED] += 1
    return leaf


def new_node(ties, tree):
    """Return the number of a node that is free."""
    node = tree[HELD_NODE]
    if node >= 0:
        tree[HELD_NODE] = -1
        return node
    node = tree[FREED]
    if node >= 0:
        tree[FREED] = ties[node, ABOVE]
        return node
    node = tree[TOP]
    tree[TOP] = node + 1
    return node


def free_node(ties, tree, node):
    """Free a node, which the next one gets; the one that was kept for it before is freed for good."""
    kept = tree[HELD_NODE]
    if kept >= 0:
        ties[kept, ABOVE] = tree[FREED]
        tree[FREED] = kept
    tree[HELD_NODE] = node


def distance(nodes, a, b):
    """Return twice the sum of the distances (m) of two boxes' middles along the axes."""
    x, y, z = nodes[a, 6] - nodes[b, 6], nodes[a, 7] - nodes[b, 7], nodes[a, 8] - nodes[b, 8]
    return abs(x) + abs(y) + abs(z)


def enclose(nodes, node, a, b):
    """Write the box of a node around those of two others; return whether it changed."""
    changed = False
    for axis in range(3):
        low, high = min(nodes[a, axis], nodes[b, axis]), max(nodes[a, 3 + axis], nodes[b, 3 + axis])
        changed |= low != nodes[node, axis]
        changed |= high != nodes[node, 3 + axis]
        nodes[node, axis], nodes[node, 3 + axis], nodes[node, 6 + axis] = low, high, low + high
    return changed


def contains(nodes, a, b):
    """Return whether box a contains box b."""
    within = True
    for axis in range(3):
        within &= nodes[a, axis] <= nodes[b, axis]
        within &= nodes[a, 3 + axis] >= nodes[b, 3 + axis]
    return within


def overlap(nodes, a, b):
    """Return whether two boxes meet."""
    meets = True
    for axis in range(3):
        meets &= nodes[a, axis] <= nodes[b, 3 + axis]
        meets &= nodes[a, 3 + axis] >= nodes[b, axis]
    return meets
