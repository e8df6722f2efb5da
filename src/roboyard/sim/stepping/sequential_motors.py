"""Robots with motors solved row by row, as Bullet solves them.

An impulse solver improves all impulses in turn and stops after a number of rounds. Where joints act on each
other strongly, as the first and third of an arm, or motors are at their largest force, it has not arrived at
the solution by then: with PyBullet, arms under `POSITION_CONTROL` and cars move by what the rounds leave
over. Robots with motors are solved that way, with what touches them; all else is left to MuJoCo, as are
worlds with equalities or with so many degrees of freedom that their Jacobian is sparse.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from roboyard._lazy import lazy_module
from roboyard.sim.actuation.velocity_motors import VelocityMotors
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.surfaces import Surfaces

kernels = lazy_module("roboyard.sim.stepping.impulse_kernels")


class SequentialMotors:
    """The solver of the robots with motors of one world."""

    def __init__(self, world: Engine[Body], motors: VelocityMotors, surfaces: Surfaces) -> None:
        self._world, self._motors, self._surfaces = world, motors, surfaces
        self.rounds: int = world.profile.motor_rounds
        """Rounds in a step; 0 leaves all trees to MuJoCo."""
        self.residual: float = world.profile.motor_residual
        """Square of the change of velocity (rad/s or m/s) below which the rounds end."""
        self._bound: tuple[Any, ...] | None = None
        self._is_solved = False
        self._rows, self._goals = np.zeros((0, 4), np.int32), np.zeros((0, 5))
        self._own, self._mu, self._soft, self._step = np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(2)
        self._jacobian = np.zeros((0, 0))

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new, or that bodies were added or removed."""
        self._bound = None

    def solve(self, model: Any, data: Any, timestep: float) -> bool:
        """Solve robots with motors, and what touches them, between `mj_fwdAcceleration` and the solver.

        Returns:
            Whether that are all rows, so that MuJoCo's solver has nothing left to do.
        """
        self._is_solved = False
        count = data.nf + data.nl
        if not self.rounds or data.ne or not count or mujoco.mj_isSparse(model):
            return False
        bound = self._bound
        if bound is None or len(bound[0]) != model.nv:
            bound = self._bound = self._bind(model)
        slot, limit_slot, geom_tree, taken, places, ends, change = bound
        contact, nefc = data.contact, data.nefc
        if data.ncon and not self._world.hard_contacts:
            return False
        kind, index = data.efc_type, data.efc_id
        geom, address = contact.geom, contact.efc_address
        joint_dof, dof_tree = model.jnt_dofadr, model.dof_treeid
        tables = kind, index, geom, address
        if not kernels().choose_trees(
            *(*tables, geom_tree, dof_tree, joint_dof, model.jnt_type, slot, limit_slot, count, taken)
        ):
            return False
        if len(self._rows) < nefc:
            self._rows, self._goals = np.zeros((2 * nefc, 4), np.int32), np.zeros((2 * nefc, 5))
            self._own, self._mu, self._soft = (np.zeros(2 * nefc) for _ in range(3))
        rows, goals, mu = self._rows, self._goals, self._mu
        found = int(
            kernels().order_rows(
                *(*tables, contact.dim, geom_tree, dof_tree, joint_dof, model.jnt_qposadr, data.qpos),
                *(slot, limit_slot, model.jnt_range, taken, count, places, rows, ends),
            )
        )
        jacobian = data.efc_J.reshape(nefc, model.nv)[rows[:found, 0]]
        response = np.empty_like(jacobian)
        mujoco.mj_solveM(model, data, response, jacobian)
        base = self._surfaces.normal_references(nefc)
        if data.ncon:
            compliance = self._surfaces.compliance_of_geoms
            kernels().contact_rows(
                geom, address, contact.dim, contact.friction, compliance, data.efc_R, mu, self._soft
            )
        motors, targets = self._motors.arrays
        trees = model.tree_dofadr, model.tree_dofnum
        kernels().set_goals(
            *(rows, kind, index, data.efc_vel, data.efc_aref, base, data.efc_frictionloss, mu, self._soft),
            *(model.dof_jntid, model.jnt_type, model.jnt_qposadr, motors, targets, data.qpos, data.qvel),
            *(data.qacc_smooth, jacobian, ends, *trees, timestep, goals),
        )
        kernels().solve_in_turn(
            *(rows, goals, ends, jacobian, response, *trees, self.rounds, self.residual),
            *(self._own, self._step, change),
        )
        self._jacobian, self._is_solved = jacobian, True
        if found < nefc:
            return False
        data.qacc[:] = data.qacc_smooth  # of trees that nothing holds
        data.qfrc_constraint[:] = 0.0
        return True

    def write(self, model: Any, data: Any, timestep: float) -> None:
        """Write the solution over MuJoCo's, after the solver."""
        if not self._is_solved or self._bound is None:
            return
        taken, _, ends, change = self._bound[3:]
        kernels().write_solution(
            *(self._rows, self._goals, ends, self._jacobian, change, data.qacc_smooth, taken),
            *(model.dof_treeid, model.tree_dofadr, model.tree_dofnum, timestep),
            *(data.qacc, data.efc_force, data.qfrc_constraint),
        )

    def _bind(self, model: Any) -> tuple[Any, ...]:
        nv = model.nv
        slot, limit_slot = np.full(nv, -1, np.int32), np.full(nv, -1, np.int32)
        place = 0
        for dof, is_limit in solution_order(list(self._world.body_by_id.values()), model):
            if is_limit:
                limit_slot[dof] = place
                place += 2
            else:
                slot[dof] = place
                place += 1
        geom_tree = model.body_treeid[model.geom_bodyid].astype(np.int32)
        taken, ends = np.zeros(model.ntree, np.uint8), np.zeros(5, np.int32)
        return slot, limit_slot, geom_tree, taken, np.full(place, -1, np.int32), ends, np.zeros(nv)


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
