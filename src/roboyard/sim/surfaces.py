"""What MuJoCo does not have of its own: restitution of surfaces and drag on links."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from roboyard.errors import RoboyardError

if TYPE_CHECKING:
    from roboyard.sim.link import Link
    from roboyard.sim.world import World


SLIDING_ITERATIONS = 4
SLIDING_TOLERANCE = 1e-3
"""m/s: normal velocity a sliding contact may be off by."""


class Surfaces:
    """Restitution by geom and damping by body, applied between the halves of a step."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._restitution: dict[tuple[int, int], float] = {}
        self._damping: dict[tuple[int, int], tuple[float, float, float, float]] = {}
        self._restitution_rows: np.ndarray | None = None
        self._damping_rows: np.ndarray | None = None
        self._drag: tuple[Any, ...] = ()
        """What the kernel of drag reads and writes."""
        self._base = np.zeros(0)
        self._acceleration = np.zeros(0)

    @property
    def is_active(self) -> bool:
        """Whether steps have to pass through here."""
        return bool(self._restitution or self._damping) or self._world.profile.needs_halves

    def restitution(self, link: Link) -> float:
        """Coefficient of a link; 0 where none was set."""
        return self._restitution.get((link.body.id, link.index), 0.0)

    def set_restitution(self, link: Link, value: float) -> None:
        if not 0.0 <= value <= 1.0:
            raise RoboyardError(f"link {link.name!r}: restitution is between 0 and 1; got {value}")
        self._restitution[(link.body.id, link.index)] = value
        if self._restitution_rows is not None and not self._world.is_stale:
            self._restitution_rows[[geom.id for geom in link._built.geoms]] = value
        self._world.stepping.refresh()

    def damping(self, link: Link) -> tuple[float, float, float, float]:
        """Linear k (1/s), linear q (1/m), angular k (1/s), angular q (-)."""
        return self._damping.get((link.body.id, link.index), (0.0, 0.0, 0.0, 0.0))

    def set_damping(
        self,
        link: Link,
        linear: float,
        angular: float,
        *,
        linear_quadratic: float = 0.0,
        angular_quadratic: float = 0.0,
    ) -> None:
        """Drag: force -m v (k + q |v|) at the centre of mass, torque -I w (k + q |w|)."""
        values = (linear, linear_quadratic, angular, angular_quadratic)
        if not (np.isfinite(values).all() and min(values) >= 0):
            raise RoboyardError(f"link {link.name!r}: damping is at least 0; got {values}")
        self._damping[(link.body.id, link.index)] = values
        if self._damping_rows is not None and not self._world.is_stale:
            self._damping_rows[link.body.mujoco_ids[link.index]] = values
        self._world.stepping.refresh()

    def forget(self, body_id: int) -> None:
        """Drop everything about a body that is being removed."""
        for link in self._world.body_by_id[body_id].links:
            key = (body_id, link.index)
            if key in self._restitution:
                self.set_restitution(link, 0.0)
                del self._restitution[key]
            if key in self._damping:
                self.set_damping(link, 0.0, 0.0)
                del self._damping[key]

    def invalidate(self) -> None:
        """The compiled arrays changed."""
        self._restitution_rows = self._damping_rows = None

    def apply(self, model: Any, data: Any) -> None:
        """Between mj_step1 and mj_step2: add drag to xfrc_applied, bounce to the contacts' references."""
        from roboyard.sim import _kernels

        if self._damping_rows is None or self._restitution_rows is None:
            self._damping_rows, self._restitution_rows = self._gather(model)
            self._drag = (
                *(self._damping_rows, model.body_mass, model.body_inertia, model.body_rootid, data.cvel),
                *(data.xipos, data.ximat, data.subtree_com, data.xfrc_applied),
            )
        if self._damping:
            _kernels.add_damping(*self._drag)
        profile = self._world.profile
        if self._world.hard_contacts and data.ne:
            _kernels.hard_equalities(
                data.efc_pos, data.efc_vel, data.ne, model.opt.timestep, profile.erp, data.efc_aref
            )
        if profile.hard_contacts and data.nl:
            _kernels.hard_limits(
                *(data.efc_type, data.efc_pos, data.efc_vel, data.ne + data.nf, data.nl),
                *(model.opt.timestep, profile.erp, profile.deep, data.efc_aref),
            )
        if not data.ncon:
            return
        contact = data.contact
        if profile.product_friction:
            _kernels.product_friction(
                model.geom_friction[:, 0],
                model.geom_friction[:, 1],
                model.geom_friction[:, 2],
                contact.geom,
                contact.dim,
                contact.efc_address,
                contact.friction,
                contact.mu,
                data.efc_R,
                data.efc_D,
            )
        if self._world.hard_contacts:
            _kernels.hard_contacts(
                self._restitution_rows,
                contact.geom,
                contact.dim,
                contact.efc_address,
                contact.dist,
                contact.friction,
                data.efc_vel,
                model.opt.timestep,
                profile.erp,
                profile.slow,
                self._base_reference(data.nefc),
                data.efc_aref,
            )
        elif self._restitution:
            _kernels.add_bounce(
                self._restitution_rows,
                contact.geom,
                contact.efc_address,
                data.efc_vel,
                data.efc_KBIP,
                model.opt.timestep,
                profile.slow,
                data.efc_aref,
            )

    def _base_reference(self, rows: int) -> np.ndarray:
        if len(self._base) < rows:
            self._base = np.zeros(2 * rows)
            self._acceleration = np.zeros(2 * rows)
        return self._base

    def correct_sliding(self, model: Any, data: Any) -> None:
        """After the solver: correct sliding contacts and solve again until they fit."""
        if not data.ncon:
            return
        from roboyard.sim import _kernels

        contact = data.contact
        rows = data.nefc
        acceleration = self._acceleration[:rows]
        for _ in range(SLIDING_ITERATIONS):
            mujoco.mj_mulJacVec(model, data, acceleration, data.qacc)
            change = _kernels.correct_sliding(
                contact.dim,
                contact.efc_address,
                contact.friction,
                data.efc_vel,
                acceleration,
                data.efc_force,
                model.opt.timestep,
                self._base,
                data.efc_aref,
            )
            if change < SLIDING_TOLERANCE:
                return
            data.qacc_warmstart[:] = data.qacc
            mujoco.mj_fwdConstraint(model, data)

    def _gather(self, model: Any) -> tuple[np.ndarray, np.ndarray]:
        damping, restitution = np.zeros((model.nbody, 4)), np.zeros(model.ngeom)
        bodies = self._world.body_by_id
        if self._damping:
            rows = [bodies[body_id].mujoco_ids[index] for body_id, index in self._damping]
            damping[rows] = list(self._damping.values())
        for (body_id, index), value in self._restitution.items():
            for geom in bodies[body_id].built.links[index].geoms:
                restitution[geom.id] = value
        return damping, restitution
