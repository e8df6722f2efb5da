"""The physics of n environments: copies of one world's model on MuJoCo's batch of simulations.

Each simulation is a row of MuJoCo's integration state. Derived fields such as link poses are those of the
present state; they are computed only where a task reads them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from mujoco import batch

from roboyard.errors import ModelError, RoboyardError
from roboyard.sim.stepping.solver_warning import solver_warning
from roboyard.sim.world import World
from roboyard.transforms import Array

_VELOCITY_FIELDS = frozenset({"cvel", "subtree_linvel", "subtree_angmom"})
_POSITION_FIELDS = frozenset(
    {"xpos", "xquat", "xmat", "xipos", "subtree_com", "geom_xpos", "geom_xmat", "cdof"}
)
LARGEST_SPEED = 1e6
"""Simulations with a velocity component above this have diverged (m/s or rad/s)."""


class BatchPhysics:
    """n simulations of a world as it is now."""

    def __init__(self, world: World, count: int, *, threads: int = 0) -> None:
        """Create n simulations in the present state of a world.

        Args:
            world: compiled, with gains of the drives as they are to stay.
            count: n.
            threads: of the processor; 0 for all that this process may use.

        Raises:
            ModelError: the world has rules that MuJoCo's own steps do not know.
        """
        _refuse_rules(world)
        self.world = world
        self.count = count
        if world.model.ntree == 1:  # one island at most: the same numbers, without the search for it
            world.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
        self.batch = batch.Batch(world.model, count, threads)
        mujoco.mj_forward(world.model, world.data)
        world.data.qacc_warmstart[:] = 0.0
        self.start = world.simulation_state()
        """State in which episodes start, before the task's changes."""
        self.start[0] = 0.0
        self.start_qpos = world.data.qpos.copy()
        """(nq,) MuJoCo's positions in that state."""
        self.batch.state[:] = self.start
        self._stage = int(mujoco.mjtStage.mjSTAGE_NONE)
        self._fields: dict[str, Array] = {}
        self._warnings = self.batch.warning.copy()

    def field(self, name: str) -> Array:
        """Return a live (n, ...) array of an MjData field; state fields may be written.

        Bind all fields before the first step: those bound later hold zeros until the next call.
        """
        if name not in self._fields:
            if name in _VELOCITY_FIELDS:
                self._stage = int(mujoco.mjtStage.mjSTAGE_VEL)
            elif name in _POSITION_FIELDS and self._stage == int(mujoco.mjtStage.mjSTAGE_NONE):
                self._stage = int(mujoco.mjtStage.mjSTAGE_POS)
            self._fields[name] = self.batch.bind(name)
            if self._fields[name].base is not self.batch.state:
                self.forward()
        return self._fields[name]

    def model_field(self, name: str) -> Array:
        """Return a live (n, ...) array of an MjModel field, which then may differ between environments."""
        return self.batch.expand(name)

    def update_constants(self, rows: Sequence[int] | np.ndarray | None = None) -> None:
        """Recompute what follows from masses and inertias of `rows` (k,), all by default, after a change."""
        self.batch.set_const(rows)

    def forward(self, rows: np.ndarray | None = None) -> None:
        """Bring derived fields of `rows` (k,), all by default, up to date with the state."""
        self.batch.forward(rows, stage=int(mujoco.mjtStage.mjSTAGE_VEL))

    def reset(self, rows: np.ndarray) -> None:
        """Put simulations `rows` (k,) into the start state; call `forward` after changing it."""
        self.batch.state[rows] = self.start

    def step(self, substeps: int) -> np.ndarray:
        """Advance by time steps.

        Returns:
            (k,) indices of simulations that diverged in it: not finite, or with errors of MuJoCo.
        """
        failed = self._advance(substeps)
        # one pass over the state: a row with a value that is not finite has no finite sum
        speed = self.batch.bind("qvel")
        bad = ~np.isfinite(self.batch.state.sum(axis=1))
        if speed.shape[1]:
            bad |= ~(np.abs(speed).max(axis=1) < LARGEST_SPEED)
        if self._is_warned():
            bad |= self._unstable()
        bad[failed] = True
        return np.flatnonzero(bad)

    def _advance(self, substeps: int) -> np.ndarray:
        """Make time steps; return (k,) indices of simulations with errors of MuJoCo."""
        failed = np.zeros(0, dtype=np.intp)
        try:
            self.batch.step(nstep=substeps, stage=self._stage)
        except batch.SimulationError as error:
            failed = np.asarray(error.ids, dtype=np.intp)
        solver_warning.is_raised, solver_warning.message = False, None  # the rows are returned
        return failed

    def _is_warned(self) -> bool:
        return not np.array_equal(self._warnings, self.batch.warning)

    def _unstable(self) -> np.ndarray:
        """(n,) whether MuJoCo has warned of non-finite accelerations, velocities or positions since."""
        kinds = mujoco.mjtWarning
        columns = [int(kinds.mjWARN_BADQPOS), int(kinds.mjWARN_BADQVEL), int(kinds.mjWARN_BADQACC)]
        grown = (self.batch.warning != self._warnings)[:, columns].any(axis=(1, 2))
        self._warnings = self.batch.warning.copy()
        return grown

    def copy_to_world(self, row: int) -> None:
        """Write the state of one simulation into the world, for pictures and sensors."""
        world = self.world
        data = world.data
        mujoco.mj_setState(world.model, data, self.batch.state[row], int(mujoco.mjtState.mjSTATE_INTEGRATION))
        world.mark_moved()


def _refuse_rules(world: World) -> None:
    """Refuse a world whose steps are more than MuJoCo's own."""
    stepping = world.stepping
    world.model  # noqa: B018 - compiles
    reasons: list[tuple[Any, str]] = [
        (stepping.surfaces.is_active, "restitution or drag of links"),
        (stepping.motors.is_active, "velocity motors"),
        (stepping.constraints.is_bounded, "constraints with a largest force"),
        (world.windows.is_active, "concave meshes as triangles; use convex parts or a heightfield"),
        (world.profile.needs_halves, "a physics profile other than the plain one"),
        (stepping.wrenches.pending, "external forces that wait for the next step"),
    ]
    found = [text for active, text in reasons if active]
    if found:
        raise ModelError(f"many copies of this world cannot be stepped at once: it has {'; '.join(found)}")


def check_count(count: int) -> int:
    """Return a number of environments.

    Raises:
        RoboyardError: it is below 1.
    """
    if count < 1:
        raise RoboyardError(f"num_envs must be at least 1, got {count}")
    return count
