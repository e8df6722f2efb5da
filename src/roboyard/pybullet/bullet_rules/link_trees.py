"""Dynamics of one body at given joint positions, with one compiled call and without MuJoCo's other bodies."""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct, error
from typing import Any

import numpy as np

import roboyard.pybullet.bullet_rules.tree_kernels as kernels
from roboyard.description.model import Pose

Vector = Sequence[float]
Rows = tuple[tuple[float, ...], ...]
_REVOLUTE, _PRISMATIC, _FIXED = 0, 1, 4
_FREE, _SLIDE, _HINGE = 0, 2, 3
_MOVABLE = {_REVOLUTE: (kernels.HINGE, _HINGE), _PRISMATIC: (kernels.SLIDE, _SLIDE)}
_IRREGULAR = (error, TypeError, ValueError, OverflowError)


class LinkTree:
    """The links of one body; valid until MuJoCo's model is compiled again.

    Each function returns None for lists that are irregular: of another length, or with other values than
    numbers.
    """

    def __init__(
        self, model: Any, free: Any, tree: kernels.Tree, places: Sequence[int], movable: int
    ) -> None:
        """Create the arrays of the arguments and results.

        Args:
            model: MuJoCo's model.
            free: (7,) the free joint's numbers in qpos; None for a fixed base.
            tree: the links, parents first.
            places: place of the base, then of each link in the tree.
            movable: number of movable joints.
        """
        six = 0 if free is None else 6
        self._tree, self._places = kernels.TREE.of(tree), places
        self._counts = movable + (7 if six else 0), movable + six, movable
        given = np.zeros(sum(self._counts) + self._counts[1] - movable)
        self._given, self._pose = given, given[:7]
        joints = given[7:] if six else given
        self._free = self._pose if free is None else free
        self._pack = Struct(f"{len(given)}d").pack_into
        self._pack_joints, self._pack_all = (
            Struct(f"{movable}d").pack_into,
            Struct(f"{3 * movable}d").pack_into,
        )
        self._efforts = np.zeros(movable + six)
        self._both, self._matrix = np.zeros((6, movable + six)), np.zeros((movable + six,) * 2)
        self._for_efforts = self._tree, model.opt.gravity, self._pose, joints, self._efforts
        self._for_masses = self._tree, self._free, given, 0, self._matrix
        self._words, self._lines, self._table = given.data, self._both.data, self._matrix.data
        self._rows = Struct(f"{movable + six}d").iter_unpack

    def prepared_efforts(self) -> tuple[Any, ...]:
        """Return what machine code needs for `inverse_dynamics`; see `fast.tree_entries`."""
        whole, speeds, _ = self._counts
        return (
            self._given,
            (whole, speeds, speeds),
            kernels.inverse_dynamics,
            self._for_efforts,
            self._efforts,
        )

    def prepared_masses(self) -> tuple[Any, ...]:
        """Return what machine code needs for `mass_matrix`."""
        return self._given, self._counts[2:], kernels.mass_matrix, self._for_masses, self._matrix

    def inverse_dynamics(
        self, positions: Vector, velocities: Vector, accelerations: Vector
    ) -> tuple[float, ...] | None:
        """Return the (n,) efforts (N m, N) that cause accelerations, those of a floating base first."""
        whole, speeds, _ = self._counts
        try:
            if not (len(positions) == whole and len(velocities) == len(accelerations) == speeds):
                return None
            self._pack(self._words, 0, *positions, *velocities, *accelerations)
        except _IRREGULAR:
            return None
        kernels.inverse_dynamics(*self._for_efforts)
        return tuple(self._efforts.tolist())

    def jacobian(
        self, link: int, point: Vector, positions: Vector, velocities: Vector, accelerations: Vector
    ) -> tuple[Rows, Rows] | None:
        """Return the linear and the angular (3, n) Jacobian in base axes.

        Args:
            link: -1 for the base.
            point: (3,) from the link frame's origin in its axes (m).
            positions: (m,) of the movable joints.
            velocities: (m,) without effect.
            accelerations: (m,) without effect.
        """
        count = self._counts[2]
        try:
            if not len(positions) == len(velocities) == len(accelerations) == count:
                return None
            self._pack_all(self._words, 0, *positions, *velocities, *accelerations)
        except _IRREGULAR:
            return None
        x, y, z = point
        place = self._places[link + 1]
        kernels.jacobian(self._tree, self._free, self._given, place, x, y, z, self._both)
        rows = tuple(self._rows(self._lines))
        return rows[:3], rows[3:]

    def mass_matrix(self, positions: Vector) -> Rows | None:
        """Return the (n, n) mass matrix (kg m², kg) at the (m,) positions; further ones are ignored."""
        count = self._counts[2]
        try:
            if len(positions) < count:
                return None
            self._pack_joints(self._words, 0, *(positions if len(positions) == count else positions[:count]))
        except _IRREGULAR:
            return None
        kernels.mass_matrix(*self._for_masses)
        return tuple(self._rows(self._table))


def link_tree(
    model: Any, rows: Sequence[int], types: Sequence[int], frame: Pose, free: Any
) -> LinkTree | None:
    """Return the tree of a body; None for one with other joints than hinges and slides, or none that moves.

    Args:
        model: MuJoCo's model.
        rows: MuJoCo's row of the base, then of each link.
        types: type of the joint above each link but the base (JOINT_REVOLUTE, ...).
        frame: inertial frame of the base in its link frame.
        free: (7,) the free joint's numbers in qpos; None for a fixed base.
    """
    order = sorted(range(len(rows)), key=rows.__getitem__)
    place_of = {rows[link]: place for place, link in enumerate(order)}
    numbers = [link for link, kind in enumerate(types, start=1) if kind in _MOVABLE]
    is_whole = len(types) == len(rows) - 1 and len(place_of) == len(rows) and order[0] == 0
    if not is_whole or not numbers or model.body_parentid[rows[0]]:
        return None  # what MuJoCo adds for joints that are held, Bullet does not have
    parents, kinds, columns, joints = [], [], [], []
    for link in order:
        row = rows[link]
        held, first = int(model.body_jntnum[row]), int(model.body_jntadr[row])
        if link:
            kind, wanted = _MOVABLE.get(types[link - 1], (0, None))
            expected = [] if wanted is None and types[link - 1] == _FIXED else [wanted]
        else:
            kind, expected = 0, [] if free is None else [_FREE]
        parent = place_of.get(int(model.body_parentid[row]), -1)
        if [int(k) for k in model.jnt_type[first : first + held]] != expected or (link and parent < 0):
            return None
        parents.append(parent)
        kinds.append(kind)
        columns.append(numbers.index(link) if kind else -1)
        joints.append(first if kind else -1)
    tree = kernels.Tree(
        *(np.array(values, dtype=np.int64) for values in ([rows[k] for k in order], parents, kinds)),
        *(np.array(values, dtype=np.int64) for values in (columns, joints)),
        frame=np.array([*frame.position, *frame.quaternion], dtype=float),
        work=np.zeros((len(rows), kernels.WIDTH)),
        base=np.zeros((3, 4)),
        **{name: getattr(model, name) for name in _ARRAYS},
        is_floating=int(free is not None),
    )
    return LinkTree(model, free, tree, [order.index(link) for link in range(len(rows))], len(numbers))


_ARRAYS = (
    *("body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia"),
    *("jnt_axis", "jnt_pos", "jnt_qposadr", "qpos0"),
)
