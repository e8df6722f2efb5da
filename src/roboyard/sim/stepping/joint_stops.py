"""Joint stops that a step must not carry a joint through.

MuJoCo makes the row of a joint limit once the joint is beyond it. A joint at 12 rad/s is 0.05 rad further
after a step of 1/240 s, and a limb that hits the floor takes up its speed within the step. Such a step is
undone and solved again with the stop in sight: the row of the limit is there before the joint is, and asks
that the joint arrives at the stop, v' >= -distance / dt, instead of passing it. Bullet treats contacts
alike. Steps in which no joint passes its stop remain MuJoCo's own.

Where several stops act on each other and on stiff drives, no request brings that about: drives are
integrated implicitly, with more inertia than MuJoCo solves constraints for. Then the velocities after the
step are changed by the least impulses at stops that do, which takes energy away, as an impact without
rebound.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine

kernels = lazy_module("roboyard.sim.stepping.stop_kernels")

ATTEMPTS = 6
"""Times that a step is solved again; each time, joints may pass their stops that did not before."""
ROUNDS = 100
"""Rounds in which impulses at stops are improved in turn."""


class JointStops:
    """Watches the joints of one world for those that pass a stop within a step.

    The joints of MJCF files are watched, too; those of worlds whose limits constrain velocities are not.
    """

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self.invalidate()

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new."""
        self._is_bound = self._is_watching = False
        self._side = np.zeros(0, dtype=np.uint8)

    def is_watching(self, model: Any, data: Any) -> bool:
        """Return whether the world has joints with soft stops."""
        if not self._is_bound:
            self._bind(model, data)
        return self._is_watching

    def _bind(self, model: Any, data: Any) -> None:
        limited = np.flatnonzero((model.jnt_limited == 1) & (model.jnt_type >= 2))  # slides and hinges
        self._is_watching = len(limited) > 0 and not self._world.hard_contacts
        self._is_bound = True
        self._options = model.opt
        count = model.njnt
        self._side = np.zeros(count, dtype=np.uint8)
        self._ask, self._bracket = np.zeros(count), np.zeros((count, 5))
        self._qpos, self._qvel, self._act = data.qpos, data.qvel, data.act
        self._kept = np.zeros(model.nq), np.zeros(model.nv), np.zeros(model.na)
        self._forces = np.zeros((model.nbody, 6))
        self._has_forces = False
        self._limits, self._places = model.jnt_range, model.jnt_qposadr
        self._joints = (
            *(limited, self._limits, self._places, model.jnt_dofadr),
            *(self._kept[0], self._qpos, self._qvel),
        )
        self._noted = self._side, self._ask, self._bracket

    def keep(self, data: Any, *, forces: bool) -> None:
        """Keep the state before a step, and the forces on links where the step adds to them."""
        qpos, qvel, act = self._kept
        qpos[:] = self._qpos
        qvel[:] = self._qvel
        if act.size:
            act[:] = self._act
        self._time = data.time
        self._has_forces = forces
        if forces:
            self._forces[:] = data.xfrc_applied

    def passed(self) -> bool:
        """Return whether joints passed their stops or were thrown back by them; they are noted."""
        return kernels().passed_stops(*self._joints, self._options.timestep, *self._noted) > 0

    def go_back(self, model: Any, data: Any) -> None:
        """Undo the step, and bring the stops of the noted joints into sight."""
        qpos, qvel, act = self._kept
        data.qpos[:], data.qvel[:], data.time = qpos, qvel, self._time
        if act.size:
            data.act[:] = act
        if self._has_forces:
            data.xfrc_applied[:] = self._forces
        noted = self._side > 0
        model.jnt_margin[noted] = 1.0 + np.ptp(self._limits[noted], axis=1)

    def approach(self, data: Any, timestep: float) -> None:
        """Let the noted joints arrive at their stops, between the halves of the step."""
        first, count = data.ne + data.nf, data.nl
        if count:
            kernels().approach_stops(
                *(data.efc_type, data.efc_id, data.efc_pos, data.efc_vel, first, count, timestep),
                *(self._limits, self._places, self._qpos, self._side, self._ask, data.efc_aref),
            )

    def arrest(self, model: Any, data: Any) -> None:
        """Change velocities and positions after a step by impulses at stops, so that no joint passes one."""
        timestep, kept = self._options.timestep, self._kept[0]
        joints, _, places, dofs = self._joints[:4]
        low, high = self._limits[joints, 0], self._limits[joints, 1]
        here = kept[places[joints]]
        inwards = np.concatenate([np.ones(len(joints)), -np.ones(len(joints))])
        way = np.concatenate([low - here, here - high])  # positive beyond a stop
        asked = np.where(way <= 0.0, way, kernels().CORRECTION * way) / timestep
        rows = np.zeros((len(inwards), model.nv))
        rows[np.arange(len(inwards)), np.tile(dofs[joints], 2)] = inwards
        changes = np.zeros_like(rows)
        mujoco.mj_solveM(model, data, changes, rows)
        effect = rows @ changes.T
        impulses = stopping_impulses(effect, asked - rows @ data.qvel)
        data.qvel[:] += impulses @ changes
        data.qpos[:] = kept
        mujoco.mj_integratePos(model, data.qpos, data.qvel, timestep)

    def release(self, model: Any) -> None:
        """Forget the noted joints after the step."""
        model.jnt_margin[self._side > 0] = 0.0
        self._side[:] = 0


def stopping_impulses(effect: np.ndarray, lacking: np.ndarray) -> np.ndarray:
    """Return the (n,) impulses at stops, none negative, after which no velocity is less than what is asked.

    Solved row by row in rounds (projected Gauss-Seidel), for the rows that lack some velocity alone.

    Args:
        effect: (n, n) changes of velocity (rad/s or m/s) by unit impulses, symmetric.
        lacking: (n,) velocities that are asked for, less those without impulses (rad/s or m/s).
    """
    impulses, lacking = np.zeros(len(lacking)), lacking.copy()
    enough = 1e-9 * float(np.abs(lacking).max(initial=0.0))
    active = np.zeros(0, dtype=int)
    while len(more := np.setdiff1d(np.flatnonzero(lacking > enough), active)):
        active = np.union1d(active, more)
        for _ in range(ROUNDS):
            largest = 0.0
            for k in active:
                change = max(-impulses[k], lacking[k] / effect[k, k])
                impulses[k] += change
                lacking -= change * effect[k]
                largest = max(largest, abs(change * effect[k, k]))
            if largest <= enough:
                break
    return impulses
