"""The order in which limits, motors and constraints are solved, as Bullet's."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._records import dataclass
from roboyard.sim.body import Body
from roboyard.sim.stepping.impulses import records as r
from roboyard.sim.stepping.impulses.records import EQUALITY, LIMIT, MOTOR


@dataclass(frozen=True, slots=True, eq=False)
class BodyParts:
    """Joint limits and motors of one body."""

    trees: tuple[int, ...]
    """Its kinematic trees."""
    limits: tuple[int, ...]
    """Degrees of freedom with limits, joint by joint."""
    motors: tuple[range, ...]
    """Degrees of freedom of each joint."""


def parts_of(body: Body, model: Any) -> BodyParts:
    """Return what has a place in the order of solution of a body."""
    trees = {tree: None for tree in model.body_treeid[body.mujoco_ids].tolist() if tree >= 0}
    joints = [joint for joint in body.joints if body.dof_addresses[joint.index] >= 0]
    limits = []
    for joint in joints:
        dof = int(body.dof_addresses[joint.index])
        if joint.is_scalar and model.jnt_limited[model.dof_jntid[dof]]:
            limits.append(dof)
    motors = [range(joint.dof_slice.start, joint.dof_slice.stop) for joint in joints]
    return BodyParts(tuple(trees), tuple(limits), tuple(motors))


def solution_order(
    bodies: list[BodyParts], equalities: list[int], equality_tree: np.ndarray
) -> list[tuple[int, int]]:
    """Return joint limits, motors and equalities in Bullet's order: (dof or equality, kind).

    This is the order as long as no boxes of bodies meet; see `order_parts` for that of a step.

    Each body has its limits when it is loaded and its motors then, joint by joint, constraints follow; Bullet
    sorts them by groups of bodies that constraints connect, with a quicksort that leaves equals in another
    order than it finds them. The three rows of a spherical joint's motor stay together.

    Args:
        bodies: in the order in which they were loaded.
        equalities: rows of constraints, in the order in which these were made.
        equality_tree: (neq, 2) trees, -1 for none, -2 for equalities that MuJoCo solves.
    """
    group = list(range(len(bodies)))
    members: list[tuple[int, int]] = []
    if equalities:
        body_of = {tree: key for key, body in enumerate(bodies) for tree in body.trees}
        for equality, (a, b) in zip(equalities, equality_tree[equalities].tolist(), strict=True):
            ends = [body_of[tree] for tree in (a, b) if tree in body_of]
            if ends:
                members.append((ends[0], equality))
                old, new = group[ends[0]], group[ends[-1]]
                group = [new if key == old else key for key in group]
    items: list[tuple[int, range, int]] = []
    for key, body in zip(group, bodies, strict=True):
        items += [(key, range(dof, dof + 1), LIMIT) for dof in body.limits]
        items += [(key, dofs, MOTOR) for dofs in body.motors]
    items += [(group[place], range(equality, equality + 1), EQUALITY) for place, equality in members]
    quicksort(items)
    return [(index, kind) for _, indices, kind in items for index in indices]


def list_parts(
    bodies: list[BodyParts], equalities: list[int], equality_tree: np.ndarray, dof_tree: np.ndarray
) -> np.ndarray:
    """Return (4, n) int32 kind, first dof or equality, number of rows of a motor, and tree of all parts.

    They are in the order in which Bullet adds them. Equalities that it does not solve are skipped.

    Args:
        bodies: as for `solution_order`, with the next two.
        dof_tree: (nv,) trees.
    """
    rows = list[tuple[int, int, int]]()
    for body in bodies:
        rows += [(LIMIT, dof, 1) for dof in body.limits]
        rows += [(MOTOR, dofs.start, len(dofs)) for dofs in body.motors]
    trees = [dof_tree.item(dof) for _, dof, _ in rows]
    known = {tree for body in bodies for tree in body.trees}
    for equality, ends in zip(equalities, equality_tree[equalities].tolist(), strict=True):
        found = [tree for tree in ends if tree in known]
        if found:
            rows.append((EQUALITY, equality, 1))
            trees.append(found[0])
    return np.array([*zip(*rows, strict=True), trees] if rows else np.zeros((4, 0)), np.int32)


def quicksort(items: list[tuple[int, Any, int]]) -> None:
    """Sort items by their first number in place, by Hoare's partition about the middle one."""
    ranges = [(0, len(items) - 1)] if len(items) > 1 else []
    while ranges:
        low, high = ranges.pop()
        pivot = items[(low + high) // 2][0]
        i, j = low, high
        while i <= j:
            while items[i][0] < pivot:
                i += 1
            while items[j][0] > pivot:
                j -= 1
            if i <= j:
                items[i], items[j] = items[j], items[i]
                i, j = i + 1, j - 1
        ranges += [(a, b) for a, b in ((low, j), (i, high)) if a < b]


def number_places(
    order: list[tuple[int, int]], slot: np.ndarray, limit_slot: np.ndarray, equality_slot: np.ndarray
) -> int:
    """Write the first row of each motor, limit and equality, -1 for none; return the number of rows.

    Args:
        order: of solution, as `solution_order` returns it.
        slot: (nv,) of motors.
        limit_slot: (nv,) of limits.
        equality_slot: (neq,) of equalities.
    """
    for values in (slot, limit_slot, equality_slot):
        values[:] = -1
    places = 0
    for index, kind in order:
        if kind == EQUALITY:
            equality_slot[index] = places
            places += r.EQUALITY_ROWS
        elif kind == LIMIT:
            limit_slot[index] = places
            places += 2
        else:
            slot[index] = places
            places += 1
    return places
