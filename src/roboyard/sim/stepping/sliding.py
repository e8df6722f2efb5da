"""Sliding on soft contacts without the lift that a convex friction cone gives."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from roboyard._lazy import lazy_module
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine

kernels = lazy_module("roboyard.sim.stepping.sliding_kernels")

ITERATIONS = 4
TOLERANCE = 1e-3
"""Tolerance of the normal velocity of a sliding contact (m/s)."""
SLOW = 0.05
"""Slip (m/s) from which contacts are corrected; below it the lift is under 0.2 mm."""


class SlidingContacts:
    """Watches the slip of a world's soft contacts and solves the steps in which they slide.

    MuJoCo's solver minimises over a convex friction cone, and its contacts separate at mu times their slip: a
    box that slides at 4 m/s hops by 0.2 m. Lowering the reference acceleration of the normal by what the
    tangents add (de Saxce's correction) removes that. It needs the solution, so the solver runs two or three
    times while contacts slide, and once where nothing does. Only contacts of free objects without joints are
    corrected; those of robots and MJCF files with the ground and with one another are left to MuJoCo.
    """

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self._exempt: np.ndarray | None = None
        self._base = np.zeros(0)
        self._acceleration = np.zeros(0)

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new, or bodies were added or removed."""
        self._exempt = None

    def has_objects(self) -> bool:
        """Return whether the world has objects that are watched."""
        exempt = self._exempt
        if exempt is None:
            exempt = self._exempt = self._find_exempt()
        return exempt.size > 0

    def slides(self, data: Any) -> bool:
        """Return whether contacts slide, between mj_step1 and the solver."""
        if not self.has_objects() or not data.ncon:
            return False
        velocity = data.efc_vel
        if velocity.dot(velocity) < SLOW * SLOW:  # of all rows: sooner than looking for those of contacts
            return False
        contact = data.contact
        rows = contact.geom, contact.dim, contact.efc_address
        return kernels().largest_slip(self._exempt, *rows, velocity) > SLOW

    def _find_exempt(self) -> np.ndarray:
        """Return for each geom whether it is of no free object: (ngeom,) of 0 and 1; empty where all are."""
        model = self._world.live_model
        objects = [
            body.mujoco_ids
            for body in self._world.body_by_id.values()
            if body.description is not None and not body.is_fixed and not body.joints
        ]
        if not objects:
            return np.zeros(0, dtype=np.uint8)
        return (~np.isin(model.geom_bodyid, np.concatenate(objects))).astype(np.uint8)

    def prepare(self, data: Any) -> None:
        """Estimate the correction, before the solver."""
        count = data.nefc
        if len(self._base) < count:
            self._base, self._acceleration = np.zeros(2 * count), np.zeros(2 * count)
        contact = data.contact
        rows = self._exempt, contact.geom, contact.dim, contact.efc_address, contact.friction
        kernels().estimate_lift(*rows, self._base, data.efc_aref)

    def correct(self, model: Any, data: Any, timestep: float) -> None:
        """Correct sliding contacts and solve again until they agree, after the solver."""
        contact, acceleration = data.contact, self._acceleration[: data.nefc]
        rows = self._exempt, contact.geom, contact.dim, contact.efc_address, contact.friction
        for _ in range(ITERATIONS):
            mujoco.mj_mulJacVec(model, data, acceleration, data.qacc)
            change = kernels().remove_lift(
                *rows, acceleration, data.efc_force, timestep, self._base, data.efc_aref
            )
            if change < TOLERANCE:
                return
            data.qacc_warmstart[:] = data.qacc
            mujoco.mj_fwdConstraint(model, data)
