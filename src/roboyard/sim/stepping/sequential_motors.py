"""Robots with motors solved row by row, as Bullet solves them.

An impulse solver improves all impulses in turn and stops after a number of rounds. Where joints act on each
other strongly, as the first and third of an arm, or motors are at their largest force, it has not arrived at
the solution by then: with PyBullet, arms under `POSITION_CONTROL` and cars move by what the rounds leave
over. Robots with motors are solved that way, with what touches them, and with all other bodies where there
are few rows; all else is left to MuJoCo, as are worlds with equalities or with so many degrees of freedom
that their Jacobian is sparse.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from roboyard._lazy import lazy_module
from roboyard.sim.actuation.velocity_motors import VelocityMotors
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.surfaces import Surfaces

kernels = lazy_module("roboyard.sim.stepping.impulse_kernels")

DENSE = 128
"""Most rows whose influence on each other is kept as a table; so few are solved in turn wholly."""
_NOTHING = np.zeros((0, 2), np.int32), np.zeros(0, np.int32), np.zeros(0, np.int32)
_NO_FRICTION = np.zeros((0, 5))


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
        self._views: tuple[Any, ...] = ()
        """Kinds of the step's rows, and its contacts."""
        self._work = _work(0, 0)

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new, or that bodies were added or removed."""
        self._bound = None

    def arrange(self, model: Any, data: Any) -> bool:
        """List the rows of robots with motors, and of what touches them, after MuJoCo has made the rows.

        Returns:
            Whether these are all rows, so that MuJoCo's solver has nothing left to do.
        """
        self._found = -1
        count = data.nf + data.nl
        if not self.rounds or data.ne or not count:
            return False
        bound = self._bound
        if bound is None:
            bound = self._bound = _bind(model, data, list(self._world.body_by_id.values()))
        if bound.is_sparse or (data.ncon and not self._world.hard_contacts):
            return False
        nefc = data.nefc
        if len(self._work.rows) < nefc or self._work.jacobian.shape[1] != bound.nv:
            self._work = _work(2 * nefc, bound.nv)
        work = self._work
        if data.ncon:
            contact = data.contact
            touching = contact.geom, contact.efc_address, contact.dim
        else:
            touching = _NOTHING
        kinds = data.efc_type, data.efc_id
        self._views = kinds, touching
        self._found = int(
            kernels().arrange(
                *(*kinds, *touching, *bound.trees, bound.qpos, bound.slot),
                *(
                    bound.limit_slot,
                    bound.limits,
                    count,
                    DENSE,
                    bound.taken,
                    bound.places,
                    work.rows,
                    bound.ends,
                ),
                *(data.efc_J, work.jacobian),
            )
        )
        return self._found == nefc

    def solve(self, model: Any, data: Any, timestep: float) -> None:
        """Solve the rows that are arranged, after `mj_fwdAcceleration`.

        The solution is written where these are all rows; `write` does it otherwise, after MuJoCo's solver.
        """
        found, bound, work = self._found, self._bound, self._work
        if found < 0 or bound is None:
            return
        jacobian, response = work.jacobian[:found], work.response[:found]
        mujoco.mj_solveM(model, data, response, jacobian)
        nefc = data.nefc
        base = self._surfaces.normal_references(nefc)
        kinds, touching = self._views  # MuJoCo does not move them within a step
        friction = data.contact.friction if data.ncon else _NO_FRICTION
        kernels().solve(
            *(work.rows, *kinds, data.efc_vel, data.efc_aref, base),
            *(data.efc_frictionloss, *bound.joints, *self._motors.arrays, bound.qpos, bound.qvel),
            *(bound.smooth, jacobian, response, bound.ends, *bound.spans, work.goals, work.mu, work.soft),
            *(
                *touching,
                friction,
                self._surfaces.compliance_of_geoms,
                data.efc_R,
                work.own,
                work.influence,
                work.step,
            ),
            *(bound.change, bound.taken, bound.dof_tree, bound.qacc, data.efc_force, bound.constraint),
            *(timestep, self.rounds, self.residual, int(found == nefc)),
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
    slot: np.ndarray
    limit_slot: np.ndarray
    trees: tuple[Any, ...]
    """Tree of each geom and dof, and the joints' dofs, types and places in qpos."""
    limits: np.ndarray
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
    places: np.ndarray
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
    return _Bound(
        nv=nv,
        is_sparse=bool(mujoco.mj_isSparse(model)),
        slot=slot,
        limit_slot=limit_slot,
        trees=(geom_tree, model.dof_treeid, model.jnt_dofadr, model.jnt_type, model.jnt_qposadr),
        limits=model.jnt_range,
        joints=(model.dof_jntid, model.jnt_type, model.jnt_qposadr),
        spans=(model.tree_dofadr, model.tree_dofnum),
        dof_tree=model.dof_treeid,
        qpos=data.qpos,
        qvel=data.qvel,
        smooth=data.qacc_smooth,
        qacc=data.qacc,
        constraint=data.qfrc_constraint,
        taken=np.zeros(model.ntree, np.uint8),
        places=np.full(place, -1, np.int32),
        ends=np.zeros(5, np.int32),
        change=np.zeros(nv),
    )


@dataclass(frozen=True, slots=True)
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
