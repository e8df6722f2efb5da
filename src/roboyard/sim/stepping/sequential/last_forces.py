"""Forces of the last step: of contacts, motors and limits, and in joints."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard.sim.actuation.velocity_motors import VelocityMotors
from roboyard.sim.stepping.contact_rows import ContactRows
from roboyard.sim.stepping.impulses import records as r
from roboyard.sim.stepping.manifolds import Manifolds
from roboyard.sim.stepping.sequential.motors import SequentialMotors
from roboyard.sim.stepping.step_row_kernels import Contacts, Rows
from roboyard.sim.stepping.step_rows import StepRows
from roboyard.transforms import Array

effort_kernels = lazy_module("roboyard.sim.stepping.effort_kernels")


class LastForces:
    """Reads the forces of one world's last step."""

    def __init__(
        self, motors: VelocityMotors, manifolds: Manifolds, in_turn: SequentialMotors, *, is_implicit: bool
    ) -> None:
        """Read from the parts of a world's steps; `is_implicit`: its integrator is."""
        self._motors, self._manifolds, self._in_turn = motors, manifolds, in_turn
        self._is_implicit = is_implicit
        self.found: StepRows | None = None
        """Contacts and rows in MuJoCo's arrays; None before the first step with the present ones."""

    def contact_forces(self, model: Any, data: Any) -> Array:
        """Return (ncon, 3) forces (N) of the last step's contacts along the axes of their frames."""
        out = self._own_forces(data)[:, :3]
        if self._in_turn.contact_rows.is_last:
            return out
        theirs = self._mujocos_forces(model, data)[:, :3]
        return np.where((data.contact.efc_address >= 0)[:, None], theirs, out)

    @staticmethod
    def _mujocos_forces(model: Any, data: Any) -> Array:
        """Return (ncon, 6) forces and torques of contacts whose rows MuJoCo has made, 0 of others."""
        out = np.zeros((data.ncon, 6))
        for i in np.flatnonzero(data.contact.efc_address >= 0).tolist():
            mujoco.mj_contactForce(model, data, i, out[i])
        return out

    def contacts_in_place(self) -> tuple[Contacts, Array, np.ndarray, np.ndarray] | None:
        """Return contacts of the last step, the forces of its rows, counts (6,), and places of arrays (13,).

        The first count is that of contacts. The arrays may be longer, and stay from step to step. A contact's
        rows are numbered as `contact_row_kernels.NUMBERED` says, or as MuJoCo does where it made them: then
        the forces begin at the tenth of the places. None where it is not known where they are.
        """
        found = self.found
        rows = self._in_turn.contact_rows.last
        if found is None or rows is None:
            return None
        return found.contacts, rows.force, found.search.counts, rows.starts

    def contact_order(self, count: int) -> np.ndarray:
        """Return (n,) the so many contacts of the last step in the order in which Bullet lists them."""
        points = self._manifolds.points
        if points.notes[r.ORDERED] == count and self.contacts_in_place() is not None:
            return points.listing[:count]
        return np.arange(count, dtype=np.int32)

    @property
    def known_rows(self) -> tuple[ContactRows, Rows | None]:
        """The maker of rows, and the arrays with all rows of the last step; see `ContactRows.last`."""
        return self._in_turn.contact_rows, self._in_turn.contact_rows.last

    def find_reactions(self, model: Any, data: Any) -> None:
        """Compute `cacc`, `cfrc_ext` and `cfrc_int` of the last step, as `mj_rnePostConstraint` does."""
        own = self._own_forces(data) if data.ncon else None
        found = self.found
        applied, speeds = data.xfrc_applied, data.qvel
        kept = applied.copy(), speeds.copy()
        if not self._is_implicit:  # the axes turn by the velocities before the step
            speeds -= model.opt.timestep * data.qacc
        try:
            if own is not None and found is not None and found.is_direct:
                known = self._in_turn.surface, self._manifolds.points, applied
                rows = self._in_turn.contact_rows
                if own.any():
                    rows.add_wrenches(model, data, found, own, *known)
                elif not rows.is_last:
                    theirs = self._mujocos_forces(model, data)
                    rows.add_wrenches(model, data, found, theirs, *known, are_whole=False)
            mujoco.mj_rnePostConstraint(model, data)
        finally:
            applied[:], speeds[:] = kept

    def _own_forces(self, data: Any) -> Array:
        """Return (ncon, 6) forces and torques of contacts whose rows MuJoCo has not made, 0 of others."""
        found = self.found
        if found is None or not found.is_direct or not data.ncon:
            return np.zeros((data.ncon, 6))
        return self._in_turn.contact_rows.forces(found, data.ncon)

    def motor_forces(self) -> np.ndarray:
        """Return the (nv,) efforts of all motors in the last step (N m or N)."""
        own = self._in_turn.contact_rows
        if own.is_last:
            return own.motor_efforts()
        found = self.found
        if found is not None and found.is_direct:
            out = np.zeros(found.search.degrees)
            if effort_kernels().motor_efforts(found.rows, found.search, out):
                return out
        return self._motors.forces()

    def joint_forces(self, model: Any) -> np.ndarray:
        """Return the (nv,) efforts of all motors and limits in the last step (N m or N)."""
        out, own = self.motor_forces().copy(), self._in_turn.contact_rows
        if own.is_last:
            own.add_limit_efforts(model, out)
        elif self.found is not None and self.found.is_direct:
            found = self.found
            effort_kernels().limit_efforts(found.rows, found.search, model.jnt_dofadr, out)
        return out

    def own_motor_forces(self) -> np.ndarray | None:
        """Return the (nv,) efforts of all motors where MuJoCo does not have them."""
        own = self._in_turn.contact_rows
        return own.motor_efforts() if own.is_last else None
