"""Robots with motors solved row by row, as Bullet solves them.

An impulse solver improves all impulses in turn and stops after a number of rounds. Where joints act on each
other strongly, as the first and third of an arm, or motors are at their largest force, it has not arrived at
the solution by then: with PyBullet, arms under `POSITION_CONTROL` and cars move by what the rounds leave
over. Robots with motors are solved that way, with what touches them, and with all other bodies where there
are few rows; all else is left to MuJoCo, as are worlds with equalities or with so many degrees of freedom
that their Jacobian is sparse.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from roboyard._lazy import lazy_module
from roboyard._records import dataclass
from roboyard.sim.actuation.velocity_motors import VelocityMotors
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.step_rows import StepRows
from roboyard.sim.stepping.surfaces import Surfaces

kernels = lazy_module("roboyard.sim.stepping.impulse_kernels")

DENSE = 128
"""Most rows whose influence on each other is kept as a table; so few are solved in turn wholly."""


class SequentialMotors:
    """The solver of the robots with motors of one world."""

    def __init__(self, world: Engine[Body], motors: VelocityMotors, surfaces: Surfaces) -> None:
        self._world, self._motors, self._surfaces = world, motors, surfaces
        self.rounds: int = world.profile.motor_rounds
        """Rounds in a step; 0 leaves all trees to MuJoCo."""
        self.residual: float = world.profile.motor_residual
        """Square of the change of velocity (rad/s or m/s) below which the rounds end."""
        self._bound: _Bound | None = None
        self._found = -1
        self._work = _work(0, 0)
        self._arguments: tuple[Any, ...] | None = None
        """Arrays that may be replaced between compiles, and last what `solve` is given with them."""

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new, or that bodies were added or removed."""
        self._bound = self._arguments = None

    def arrange(self, model: Any, data: Any, found: StepRows) -> bool:
        """List the rows of robots with motors, and of what touches them, after MuJoCo has made the rows.

        Args:
            model: MjModel.
            data: MjData.
            found: the contacts and rows.

        Returns:
            Whether these are all rows, so that MuJoCo's solver has nothing left to do.
        """
        self._found = -1
        contacts, equalities, motors, limits, count = found.counts
        if not self.rounds or equalities or not motors + limits:
            return False
        bound = self._bound
        if bound is None:
            bound = self._bound = _bind(model, data, list(self._world.body_by_id.values()))
        if bound.is_sparse or (contacts and not self._world.hard_contacts):
            return False
        work = self._work
        if len(work.rows) < count or work.jacobian.shape[1] != bound.nv:
            work = self._work = _work(2 * count, bound.nv)
        self._found = kernels().arrange(
            *(found.rows, found.contacts, contacts, motors, limits, count, work.rows, work.jacobian),
            *bound.trees,
        )
        return self._found == count

    def solve(self, model: Any, data: Any, found: StepRows, timestep: float) -> None:
        """Solve the rows that are arranged, after `mj_fwdAcceleration`.

        The solution is written where these are all rows; `write` does it otherwise, after MuJoCo's solver.

        Args:
            model: MjModel.
            data: MjData.
            found: the contacts and rows.
            timestep: duration of the step (s).
        """
        listed, bound, work = self._found, self._bound, self._work
        if listed < 0 or bound is None:
            return
        jacobian, response = work.part(listed)
        mujoco.mj_solveM(model, data, response, jacobian)
        counts = found.counts
        count = counts[4]
        surfaces = self._surfaces
        base, compliance = surfaces.normal_references(count), surfaces.compliance_of_geoms
        motors, known = self._motors.arrays, self._arguments
        if (
            known is None
            or known[0] is not work
            or known[1] is not base
            or known[2] is not motors
            or known[3] is not compliance
        ):
            arguments = _arguments(bound, work, base, motors, compliance)
            known = self._arguments = work, base, motors, compliance, arguments
        kernels().solve(
            *(found.rows, found.contacts, counts[0], count, 1 if listed == count else 0),
            *(timestep, self.rounds, self.residual, jacobian, response, *known[4]),
        )

    def write(self, data: Any, timestep: float) -> None:
        """Write the solution over MuJoCo's, after its solver, which had other rows."""
        bound, work = self._bound, self._work
        if self._found < 0 or bound is None:
            return
        kernels().write_solution(
            *(work.rows, work.goals, bound.ends, work.jacobian, bound.change, bound.smooth, bound.taken),
            *(bound.dof_tree, *bound.spans, timestep, bound.qacc, data.efc_force, bound.constraint),
        )


@dataclass(frozen=True, slots=True)
class _Bound:
    """MuJoCo's arrays, the order of motors and small results, which hold until the next compile."""

    nv: int
    is_sparse: bool
    trees: tuple[Any, ...]
    """Arguments of `arrange` that hold until the next compile."""
    joints: tuple[Any, ...]
    spans: tuple[Any, ...]
    """First dof and number of dofs of each tree."""
    dof_tree: np.ndarray
    qpos: np.ndarray
    qvel: np.ndarray
    smooth: np.ndarray
    qacc: np.ndarray
    constraint: np.ndarray
    taken: np.ndarray
    ends: np.ndarray
    change: np.ndarray


def _bind(model: Any, data: Any, bodies: list[Body]) -> _Bound:
    nv = model.nv
    slot, limit_slot = np.full(nv, -1, np.int32), np.full(nv, -1, np.int32)
    place = 0
    for dof, is_limit in solution_order(bodies, model):
        if is_limit:
            limit_slot[dof] = place
            place += 2
        else:
            slot[dof] = place
            place += 1
    geom_tree = model.body_treeid[model.geom_bodyid].astype(np.int32)
    taken, ends = np.zeros(model.ntree, np.uint8), np.zeros(5, np.int32)
    joints = model.jnt_type, model.jnt_qposadr
    return _Bound(
        nv=nv,
        is_sparse=bool(mujoco.mj_isSparse(model)),
        trees=(
            *(geom_tree, model.dof_treeid, model.jnt_dofadr, *joints, data.qpos, slot, limit_slot),
            *(model.jnt_range, DENSE, taken, np.full(place, -1, np.int32), ends, nv),
        ),
        joints=(model.dof_jntid, *joints),
        spans=(model.tree_dofadr, model.tree_dofnum),
        dof_tree=model.dof_treeid,
        qpos=data.qpos,
        qvel=data.qvel,
        smooth=data.qacc_smooth,
        qacc=data.qacc,
        constraint=data.qfrc_constraint,
        taken=taken,
        ends=ends,
        change=np.zeros(nv),
    )


def _arguments(
    bound: _Bound,
    work: _Work,
    base: np.ndarray,
    motors: tuple[np.ndarray, np.ndarray],
    compliance: np.ndarray,
) -> tuple[Any, ...]:
    """Return the arrays that `solve` is given after those of the step."""
    return (
        *(work.rows, base, *bound.joints, *motors, bound.qpos, bound.qvel, bound.smooth, bound.ends),
        *(*bound.spans, work.goals, work.mu, work.soft, compliance, work.own, work.influence, work.step),
        *(bound.change, bound.taken, bound.dof_tree, bound.qacc, bound.constraint),
    )


_NO_PART = np.zeros((0, 0)), np.zeros((0, 0))


@dataclass(slots=True)
class _Work:
    """Arrays for the rows of a step, which grow with the number of rows."""

    rows: np.ndarray
    jacobian: np.ndarray
    response: np.ndarray
    goals: np.ndarray
    mu: np.ndarray
    soft: np.ndarray
    own: np.ndarray
    step: np.ndarray
    influence: np.ndarray
    _part: tuple[np.ndarray, np.ndarray] = _NO_PART

    def part(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the first rows (count, nv) of `jacobian` and `response`."""
        if len(self._part[0]) != count:
            self._part = self.jacobian[:count], self.response[:count]
        return self._part


def _work(count: int, nv: int) -> _Work:
    dense = min(count, DENSE)
    return _Work(
        rows=np.zeros((count, 4), np.int32),
        jacobian=np.zeros((count, nv)),
        response=np.zeros((count, nv)),
        goals=np.zeros((count, 6)),
        mu=np.zeros(count),
        soft=np.zeros(count),
        own=np.zeros(count),
        step=np.zeros(max(count, 2)),
        influence=np.zeros((dense, dense)),
    )


def solution_order(bodies: list[Body], model: Any) -> list[tuple[int, bool]]:
    """Return the dofs of joint limits and motors in Bullet's order: (dof, whether it is the limit).

    Each body has its limits when it is loaded and its motors then, joint by joint; Bullet sorts them by body
    with a quicksort that leaves equals in another order than it finds them.

    Args:
        bodies: in the order in which they were loaded.
        model: MjModel.
    """
    items: list[tuple[int, int, bool]] = []
    for key, body in enumerate(bodies):
        starts = [
            (int(body.dof_addresses[j.index]), j) for j in body.joints if body.dof_addresses[j.index] >= 0
        ]
        for dof, joint in starts:
            if joint.is_scalar and model.jnt_limited[model.dof_jntid[dof]]:
                items.append((key, dof, True))
        for _, joint in starts:
            size = joint.dof_slice
            items += [(key, d, False) for d in range(size.start, size.stop)]
    quicksort(items)
    return [(dof, is_limit) for _, dof, is_limit in items]


def quicksort(items: list[tuple[int, int, bool]]) -> None:
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
