"""The arrays of `Points`: room for those of a world, and their content before a step."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np

from roboyard._mujoco import mujoco
from roboyard._records import NamedTuple, dataclass
from roboyard.sim.stepping.broad_phase.box_tree import ENTERED, NODE, TIES, TOP, TREE, WAY, enter_leaf, put_in
from roboyard.sim.stepping.face_corners import SCRATCH
from roboyard.sim.stepping.impulses.records import (
    LINKS,
    LISTED,
    NODES_OF_PARTS,
    NOTES,
    PAIRS,
    RANKED,
    RENUMBERED,
    SHAPES,
    WORK,
    Points,
)  # fmt: skip
from roboyard.sim.stepping.narrow_phase.field_kernels import WORK as SEARCHED
from roboyard.sim.stepping.narrow_phase.polytope import WORK as POLYTOPE
from roboyard.transforms import Array


class CreationOrder(NamedTuple):
    """Shapes and links in the order in which bodies were made; the arrays of that name of `Points`."""

    turns: np.ndarray
    links: np.ndarray
    firsts: np.ndarray
    sizes: np.ndarray
    tree_places: np.ndarray

    def copy(self) -> CreationOrder:
        """Return the same order in other arrays."""
        return CreationOrder(*(array.copy() for array in self))


@cache
def no_points() -> Points:
    """Return room for no points, which nothing is written into."""
    return make_points(CreationOrder(*(np.zeros(0, np.int32) for _ in range(5))), 0, 0)


def make_points(order: CreationOrder, pairs: int, meeting: int, nodes: int = 0) -> Points:
    """Return room for the points of so many pairs, and for so many pairs whose boxes meet.

    Args:
        order: of shapes and links, whose arrays become those of the points.
        pairs: number of pairs with points.
        meeting: number of pairs whose boxes meet.
        nodes: how many numbers a tree of boxes has given that is to be copied.
    """
    turns, bodies, notes = order.turns, len(order.links), np.zeros(NOTES, np.int64)
    geoms, ages = len(turns), np.zeros(len(turns), np.int32)
    notes[[SHAPES, LINKS]] = _write_ages(turns, ages), np.count_nonzero(order.links >= 0)
    room, table = _nodes_for(bodies, nodes), 1 << (2 * meeting).bit_length()
    tree = np.full(TREE, -1, np.int64)
    tree[[TOP, WAY, ENTERED]] = 0
    bounds = np.zeros((bodies, 6))
    bounds[:, 0] = 1.0
    return Points(
        kinds=_kinds_that_keep(),
        keys=np.zeros((2, pairs), np.int64),
        counts=np.zeros((2, pairs), np.int32),
        points=np.zeros((2, pairs, 4, 17)),
        fresh=np.zeros(max(SCRATCH, SEARCHED, POLYTOPE)),
        source=np.zeros(4 * pairs, np.int32),
        extra=np.zeros((4 * pairs, 13)),
        slots=np.full(5 * pairs, -1, np.int32),
        turns=turns,
        ages=ages,
        entered=ages.copy(),
        tree_places=order.tree_places,
        links=order.links,
        firsts=order.firsts,
        sizes=order.sizes,
        tight=np.zeros((geoms, 6)),
        written=np.full(geoms, -1, np.int64),
        bounds=bounds,
        seats=np.full((bodies, 9), np.inf),
        leaves=np.full(bodies, -1, np.int32),
        nodes=np.zeros((room, NODE)),
        ties=np.zeros((room, TIES), np.int32),
        tree=tree,
        stack=np.zeros(max(bodies + 2, NODES_OF_PARTS * (3 * geoms + 4)), np.int32),
        pairs=np.zeros((3, meeting), np.int32),
        ranked=np.zeros((3, meeting), np.int32),
        table=np.full(table, -1, np.int32),
        rank_table=np.full(table, -1, np.int32),
        work=np.zeros((WORK, meeting), np.int32),
        following=np.zeros(5 * pairs, np.int32),
        sequence=np.zeros(5 * pairs, np.int32),
        listing=np.zeros(5 * pairs, np.int32),
        refreshed=np.zeros(0, np.int32),
        notes=notes,
    )


def tree_of_boxes(boxes: Array) -> tuple[np.ndarray, Array, np.ndarray, np.ndarray]:
    """Return the tree of boxes to which these were added in turn, and nothing else was done.

    Args:
        boxes: (n, 6) least and largest coordinates (m).

    Returns:
        (n,) leaves, and the arrays `nodes`, `ties` and `tree` of `box_tree`.
    """
    count = len(boxes)
    room = 2 * count + 2
    # dictionaries by the places in arrays, whose single numbers take Python several times as long
    nodes = dict.fromkeys(product(range(room), range(NODE)), 0.0)
    ties = dict.fromkeys(product(range(room), range(TIES)), -1)
    tree, leaves = [-1] * TREE, list[int]()
    tree[TOP] = tree[WAY] = tree[ENTERED] = 0
    for low_x, low_y, low_z, high_x, high_y, high_z in boxes.tolist():
        leaf = enter_leaf(ties, tree)
        leaves.append(leaf)
        sums = low_x + high_x, low_y + high_y, low_z + high_z
        for k, value in enumerate((low_x, low_y, low_z, high_x, high_y, high_z, *sums)):
            nodes[leaf, k] = value
        put_in(nodes, ties, tree, leaf)
    return (
        np.array(leaves, np.int32),
        np.array(list(nodes.values())).reshape(room, NODE),
        np.array(list(ties.values()), np.int32).reshape(room, TIES),
        np.array(tree, np.int64),
    )


def _write_ages(turns: np.ndarray, ages: np.ndarray) -> int:
    """Write the place of each geom in an order, where ages are 0; return the number of geoms in it."""
    shapes = int(np.count_nonzero(turns >= 0))
    ages[turns[:shapes]] = np.arange(shapes)
    return shapes


def _nodes_for(bodies: int, nodes: int) -> int:
    """Return the room for a tree of so many of MuJoCo's bodies that may have given so many numbers."""
    return max(2 * bodies, nodes) + 2


def has_room(points: Points, pairs: int, meeting: int, *, nodes: int) -> bool:
    """Return whether arrays are as large as those of `make_points` would be."""
    enough = points.keys.shape[1] >= pairs and points.pairs.shape[1] >= meeting
    return enough and len(points.nodes) >= _nodes_for(len(points.links), nodes)


def start_again(points: Points, order: CreationOrder) -> None:
    """Leave the arrays of other bodies as `make_points` would make them, but for room."""
    for name, array in order._asdict().items():
        getattr(points, name)[:] = array
    points.ages[:] = 0
    points.notes[SHAPES] = _write_ages(order.turns, points.ages)
    points.notes[LINKS] = np.count_nonzero(order.links >= 0)
    forget_points(points)


@dataclass(frozen=True, slots=True)
class Content:
    """The content of the arrays of `Points` before a step, in as many of their columns as are used."""

    keys: np.ndarray
    counts: np.ndarray
    points: Array
    pairs: np.ndarray
    ranked: np.ndarray
    whole: tuple[np.ndarray, ...]
    """The arrays of `_WHOLE`."""


_WHOLE = ("links", "tree_places", "leaves", "nodes", "ties", "tree", "bounds", "notes")
"""Arrays that are copied as they are."""


def forget_points(points: Points) -> None:
    """Leave the arrays as `make_points` returns them, but for room and order of geoms and links."""
    shapes, links = points.notes[[SHAPES, LINKS]].tolist()
    points.notes[:], points.bounds[:], points.bounds[:, 0] = 0, 0.0, 1.0
    points.notes[[SHAPES, LINKS, RENUMBERED]] = shapes, links, 2  # so that the tables are emptied
    points.leaves[:], points.tree[:] = -1, -1
    points.tree[[TOP, WAY, ENTERED]] = 0
    _forget_boxes(points)


def _forget_boxes(points: Points) -> None:
    points.written[:], points.seats[:], points.slots[:] = -1, np.inf, -1


def content_of(points: Points) -> Content:
    """Return a copy of what the arrays hold, where no step was taken since `forget_points`."""
    pairs, listed, ranked = points.notes[[PAIRS, LISTED, RANKED]].tolist()
    return Content(
        keys=points.keys[0, :pairs].copy(),
        counts=points.counts[0, :pairs].copy(),
        points=points.points[0, :pairs].copy(),
        pairs=points.pairs[:, :listed].copy(),
        ranked=points.ranked[:, :ranked].copy(),
        whole=tuple(getattr(points, name).copy() for name in _WHOLE),
    )


def write_content(points: Points, content: Content) -> None:
    """Write what the arrays held."""
    pairs, listed, ranked = len(content.keys), content.pairs.shape[1], content.ranked.shape[1]
    for name, array in zip(_WHOLE, content.whole, strict=True):
        getattr(points, name)[:] = array
    if pairs:
        points.keys[0, :pairs], points.counts[0, :pairs] = content.keys, content.counts
        points.points[0, :pairs] = content.points
    points.pairs[:, :listed], points.ranked[:, :ranked] = content.pairs, content.ranked
    _forget_boxes(points)


@cache
def _kinds_that_keep() -> np.ndarray:
    """Return (8, 8) 1 for pairs of geom types that keep points: all but two balls, as in Bullet."""
    kinds = mujoco.mjtGeom
    convex = [
        int(kind)
        for kind in (
            kinds.mjGEOM_CAPSULE,
            kinds.mjGEOM_ELLIPSOID,
            kinds.mjGEOM_CYLINDER,
            kinds.mjGEOM_BOX,
            kinds.mjGEOM_MESH,
        )
    ]
    keep = np.zeros((8, 8), np.uint8)
    keep[np.ix_(convex, convex)] = 1
    sphere = int(kinds.mjGEOM_SPHERE)
    keep[sphere, convex] = keep[convex, sphere] = 1
    surfaces = [int(kinds.mjGEOM_PLANE), int(kinds.mjGEOM_HFIELD)]  # of each prism of one it finds one
    keep[np.ix_(surfaces, [sphere, *convex])] = keep[np.ix_([sphere, *convex], surfaces)] = 1
    return keep
