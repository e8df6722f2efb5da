"""Sliding on soft contacts without the lift that a convex friction cone gives."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard.sim.body import Body
from roboyard.sim.build.solver_options import PILE_DOFS
from roboyard.sim.engine import Engine

kernels = lazy_module("roboyard.sim.stepping.sliding_kernels")

ITERATIONS = 4
TOLERANCE = 1e-3
"""Tolerance of the normal velocity of a sliding contact (m/s)."""
SLOW = 0.05
"""Slip (m/s) from which contacts are corrected; below it the lift is under 0.2 mm."""
_AT_REST = (0.2 * SLOW) ** 2
"""Square of the speed (m/s and rad/s) of a robot's base below which its contacts do not slip much."""


class SlidingContacts:
    """Watches the slip of a world's soft contacts and solves the steps in which they slide.

    MuJoCo's solver minimises over a convex friction cone, and its contacts separate at mu times their
    slip: a box that slides at 4 m/s hops by 0.2 m. Lowering the reference acceleration of the normal by
    what the tangents add (de Saxce's correction) removes that. It needs the solution, so the solver runs
    two or three times while contacts slide, and once where nothing does, or in piles: their solver stops
    before it has converged, and corrections of what is not a solution lift more than the estimate does.
    Contacts of the base links of bodies that move freely are corrected: objects, and robots that slide on
    their base; so are those of wheels on the base, which slide sideways where a robot with several axles
    turns. Those of other links behind joints are left to MuJoCo, since a limb that is thrown against the
    ground may wedge, where no solution without lift exists, and so are those of MJCF files, which move as
    in MuJoCo alone.
    """

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self._exempt: np.ndarray | None = None
        self._robot_speeds: list[np.ndarray] | None = None
        self._base = np.zeros(0)
        self._acceleration = np.zeros(0)

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new, or bodies were added or removed."""
        self._exempt = None

    def may_slide(self) -> bool:
        """Return whether the world has links that are watched, and not only those of robots at rest."""
        exempt = self._exempt
        if exempt is None:
            exempt = self._exempt = self._find_exempt()
        if self._robot_speeds is None:
            return exempt.size > 0
        return any(speed.dot(speed) > _AT_REST for speed in self._robot_speeds)

    def slides(self, data: Any) -> bool:
        """Return whether contacts slide, between mj_step1 and the solver."""
        if not data.ncon or not self.may_slide():
            return False
        velocity = data.efc_vel
        if velocity.dot(velocity) < SLOW * SLOW:  # of all rows: sooner than looking for those of contacts
            return False
        contact = data.contact
        rows = contact.geom, contact.dim, contact.efc_address
        return kernels().largest_slip(self._exempt, *rows, velocity) > SLOW

    def _find_exempt(self) -> np.ndarray:
        """Return for each geom whether it is of no free base: (ngeom,) of 0 and 1; empty where all are."""
        world = self._world
        model, data = world.live_model, world.live_data
        moving = [b for b in world.body_by_id.values() if b.description is not None and not b.is_fixed]
        links = [_links_that_slide(model, body.mujoco_ids) for body in moving]
        if model.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL:
            links = []  # a row of such a contact is an edge of the pyramid, not an axis
        exempt = ~np.isin(model.geom_bodyid, np.concatenate(links)) if links else np.ones(0, dtype=bool)
        self._robot_speeds = None
        if exempt.all():
            return np.zeros(0, dtype=np.uint8)
        if all(body.joints for body in moving):
            self._robot_speeds = [data.qvel[body.free_dof : body.free_dof + 6] for body in moving]
        return exempt.astype(np.uint8)

    def prepare(self, model: Any, data: Any) -> None:
        """Estimate the correction, before the solver."""
        count = data.nefc
        if len(self._base) < count:
            self._base, self._acceleration = np.zeros(2 * count), np.zeros(2 * count)
        contact, gravity = data.contact, float(np.linalg.norm(model.opt.gravity))
        rows = self._exempt, contact.geom, contact.dim, contact.efc_address, contact.friction
        kernels().estimate_lift(*rows, gravity, self._base, data.efc_aref)

    def correct(self, model: Any, data: Any, timestep: float) -> None:
        """Correct sliding contacts and solve again until they agree, after the solver."""
        if model.opt.solver == mujoco.mjtSolver.mjSOL_CG and model.nv >= PILE_DOFS:
            return
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


def _links_that_slide(model: Any, links: np.ndarray) -> np.ndarray:
    """Return the base of a body, and the links that turn on it about an axle without limits.

    Args:
        model: MuJoCo's model.
        links: (n,) its links in MuJoCo, the base first.
    """
    kept, rigid = [links[0]], {int(links[0])}
    for link in links[1:]:
        if int(model.body_parentid[link]) not in rigid:
            continue
        joint = model.body_jntadr[link]
        if model.body_jntnum[link] == 0:
            rigid.add(int(link))
            kept.append(link)
        elif (
            model.body_jntnum[link] == 1
            and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE
            and not model.jnt_limited[joint]
        ):
            kept.append(link)
    return np.array(kept)
