"""Restitution of surfaces and drag on links, which MuJoCo does not have."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from operator import is_
from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard.errors import RoboyardError
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.link import Link
from roboyard.sim.protocols import AnchorPlaces
from roboyard.sim.soft.soft_bodies import SoftBodies
from roboyard.sim.stepping.impulses.records import Surface
from roboyard.sim.stepping.shape_forms import ShapeForms, no_forms
from roboyard.sim.stepping.step_rows import StepRows
from roboyard.transforms import Array

changes = lazy_module("roboyard.sim.stepping.manifold_changes")
kernels = lazy_module("roboyard.sim.stepping.kernels")
soft_kernels = lazy_module("roboyard.sim.soft.kernels")
surface_shifts = lazy_module("roboyard.sim.stepping.narrow_phase.surface_shifts")

SLIDING_ITERATIONS = 4
SLIDING_TOLERANCE = 1e-3
"""Tolerance of the normal velocity of a sliding contact (m/s)."""
SOFT_SLIDING_TOLERANCE = 0.05
"""The same of soft bodies, whose nodes slide at other speeds in each step, where a solution takes as long as
all else. It moves a contact by 0.2 mm in a step of 1/240 s, which the next step corrects."""
_SOFT_PUSH = 0.1
"""Largest speed (m/s) with which soft bodies are pushed out of what they are in, as in Bullet."""


class Surfaces:
    """Restitution and compliance by geom and drag by body, applied between the halves of a step."""

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self._restitution: dict[tuple[int, int], Array] = {}
        self._damping: dict[tuple[int, int], Array] = {}
        self._compliance: dict[tuple[int, int], Array] = {}
        """By body and link: (1,), (4,) and (2,) numbers, which `restitution_places` and its siblings give."""
        self._compliance_rows = np.zeros((0, 2))
        self._anchored: set[tuple[int, int]] = set()
        self.anchors = np.zeros(0, np.uint8)
        """(ngeom,) 1 for the geoms of links with anchors."""
        self.margins_of: Callable[[], np.ndarray] | None = None
        """Function that returns the (ngeom,) widths (m) by which surfaces lie outside MuJoCo's shapes."""
        self.reaches_of: Callable[[], np.ndarray] | None = None
        """Function that returns the (ngeom,) gaps (m) from which on contacts do not push."""
        self.forms_of: Callable[[], ShapeForms] | None = None
        """Returns the forms of shapes; contacts then follow `place_contacts` and `drop_gaps`."""
        self.soft: SoftBodies | None = None
        self._no_margins = self._no_reaches = np.zeros(0)
        self._widths: tuple[int, tuple[Array, Array], ShapeForms] | None = None
        """Revision of the world, and what `margins_and_reaches` and `forms` return in it."""
        self._made_of: tuple[Any, ...] = (None,) * 5
        self._surface: Any = None
        """The last result of `record`, and what it was made of."""
        self._restitution_rows: np.ndarray | None = None
        self._damping_rows: np.ndarray | None = None
        self._drag: tuple[Any, ...] = ()
        """Arguments of the drag kernel."""
        self._friction = self._flex_friction = self._solution = np.zeros(0)
        self._base = np.zeros(0)
        self._acceleration = np.zeros(0)
        self._sliding: tuple[Any, ...] = ()
        self._references: tuple[Any, ...] = ()
        """Arguments of the kernel of sliding contacts in this step."""

    @property
    def is_active(self) -> bool:
        """Whether steps must apply these rules."""
        return bool(self._restitution or self._damping) or self._world.profile.needs_halves

    @property
    def compliance_of_geoms(self) -> np.ndarray:
        """Stiffness (N/m), 0 for a rigid surface, and damping (N s/m) of each geom: (ngeom, 2)."""
        return self._compliance_rows

    def normal_references(self, count: int) -> np.ndarray:
        """Return the references (count,) of this step's rigid contacts before the correction for sliding."""
        if len(self._base) < count:
            self._base, self._acceleration = np.zeros(2 * count), np.zeros(2 * count)
        return self._base

    @property
    def are_compliant(self) -> bool:
        """Whether any surface has a stiffness."""
        return bool(self._compliance)

    def record(self, model: Any, data: Any, rows: int) -> Surface:
        """Return the coefficients as argument of compiled loops, until the world's revision changes.

        Args:
            model: MjModel.
            data: MjData.
            rows: number of rows of constraints for which there is room.
        """
        margins, reaches = self.margins_and_reaches(model, data)
        forms = self.forms(model, data)
        assert self._restitution_rows is not None and self._damping_rows is not None
        made_of = margins, reaches, forms, self._damping_rows, self.normal_references(rows)
        if all(map(is_, made_of, self._made_of)):
            return self._surface
        self._made_of = made_of
        self._surface = Surface(
            friction=self._friction,
            restitution=self._restitution_rows,
            compliance=self._compliance_rows,
            damping=self._damping_rows,
            margins=np.ascontiguousarray(margins),
            reaches=np.ascontiguousarray(reaches),
            boxes=forms.boxes,
            covers=forms.covers,
            parts=forms.parts,
            compound=forms.compound,
            visits=forms.visits,
            rounding=forms.rounding,
            hulls=forms.hulls,
            spans=forms.spans,
            anchors=self.anchors,
            base=made_of[-1],
        )
        return self._surface

    def margins_and_reaches(self, model: Any, data: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return `margins_of` and `reaches_of`: (ngeom,) widths and gaps (m)."""
        known, revision = self._widths, self._world.revision
        if known is None or known[0] != revision:
            if self._damping_rows is None or self._restitution_rows is None:
                self._look_up(model, data)
            margins = self.margins_of() if self.margins_of else self._no_margins
            reaches = self.reaches_of() if self.reaches_of else self._no_reaches
            forms = self.forms_of() if self.forms_of else no_forms()
            known = self._widths = revision, (margins, reaches), forms
            profile = self._world.profile
            if self.reaches_of and self._world.hard_contacts:
                changes().write_seen_gaps(
                    model.geom_type, model.geom_bodyid, margins, reaches, profile.box_margin,
                    profile.contact_margin, model.geom_margin, model.geom_gap, model.body_margin,
                )  # fmt: skip
        return known[1]

    def forms(self, model: Any, data: Any) -> ShapeForms:
        """Return `forms_of`, the forms of all shapes."""
        self.margins_and_reaches(model, data)
        assert self._widths is not None
        return self._widths[2]

    def shift_contacts(self, model: Any, data: Any, found: StepRows) -> None:
        """Move contacts that are not solved from MuJoCo's shapes to the surfaces, as steps do."""
        margins, _ = self.margins_and_reaches(model, data)
        surface_shifts().shift_contacts(found.contacts, found.counts[0], margins)

    def restitution(self, link: Link) -> float:
        """Return the coefficient of restitution of a link; 0 where none was set."""
        found = self._restitution.get((link.body.id, link.index))
        return 0.0 if found is None else found.item()

    def set_restitution(self, link: Link, value: float) -> None:
        """Set the coefficient of restitution of a link.

        Raises:
            RoboyardError: it is not between 0 and 1.
        """
        if not 0.0 <= value <= 1.0:
            raise RoboyardError(f"link {link.name!r}: restitution must be between 0 and 1, got {value}")
        if not _store(self._restitution, link, (value,)):
            return
        if self._restitution_rows is not None and self._world.takes_numbers():
            self._restitution_rows[[geom.id for geom in link._built.geoms]] = value
        self._world.refresh_stepping()

    def set_compliance(self, link: Link, stiffness: float, damping: float) -> None:
        """Make the surface of a link a spring and damper, where the profile has rigid contacts.

        Args:
            link: the link.
            stiffness: of its contacts (N/m); 0 for a rigid surface.
            damping: of its contacts (N s/m).

        Raises:
            RoboyardError: a value is negative or not finite.
        """
        if not (0.0 <= stiffness < inf and 0.0 <= damping < inf):
            raise RoboyardError(
                f"link {link.name!r}: contact stiffness and damping must be at least 0, got {stiffness} and "
                f"{damping}"
            )
        if not _store(self._compliance, link, (stiffness, damping)):
            return
        if self._restitution_rows is not None and self._world.takes_numbers():
            self._compliance_rows[[geom.id for geom in link._built.geoms]] = stiffness, damping
        self._world.refresh_stepping()

    def set_anchor(self, link: Link, *, is_anchored: bool) -> None:
        """Let friction hold the contacts of a link where they began, and pull them back when they creep.

        Args:
            link: the link.
            is_anchored: whether it does; otherwise contacts that creep are not pulled back.
        """
        key = (link.body.id, link.index)
        if (key in self._anchored) == is_anchored:
            return
        (self._anchored.add if is_anchored else self._anchored.discard)(key)
        if self._restitution_rows is not None and self._world.takes_numbers():
            for row in link.geom_ids:
                self.anchors[row] = is_anchored

    def anchor_places(self, link: Link) -> AnchorPlaces:
        """Return where it is noted whether a link is anchored: keys, its own, (ngeom,) anchors, its rows.

        They are valid until MuJoCo's arrays, or `anchors`, are others.
        """
        is_old = self._world.is_stale or self._restitution_rows is None
        rows = [] if is_old else [geom.id for geom in link._built.geoms]
        return self._anchored, (link.body.id, link.index), self.anchors, rows

    def damping_of_all(self, model: Any, data: Any) -> np.ndarray:
        """Return (nbody, 4) linear k and q, angular k and q of all links; see `damping`."""
        if self._damping_rows is None or self._restitution_rows is None:
            self._look_up(model, data)
        assert self._damping_rows is not None
        return self._damping_rows

    def damping(self, link: Link) -> tuple[float, float, float, float]:
        """Return linear k (1/s), linear q (1/m), angular k (1/s) and angular q (-) of a link."""
        linear, linear_quadratic, angular, angular_quadratic = self._damping.get(
            (link.body.id, link.index), (0.0, 0.0, 0.0, 0.0)
        )
        return float(linear), float(linear_quadratic), float(angular), float(angular_quadratic)

    def set_damping(
        self,
        link: Link,
        linear: float,
        angular: float,
        *,
        linear_quadratic: float = 0.0,
        angular_quadratic: float = 0.0,
    ) -> None:
        """Set the drag of a link: force -m v (k + q |v|) at the centre of mass, torque -I w (k + q |w|).

        Args:
            link: the link.
            linear: k of the force (1/s).
            angular: k of the torque (1/s).
            linear_quadratic: q of the force (1/m).
            angular_quadratic: q of the torque.

        Raises:
            RoboyardError: a coefficient is negative or not finite.
        """
        values = (linear, linear_quadratic, angular, angular_quadratic)
        if not all(0.0 <= value < inf for value in values):
            raise RoboyardError(f"link {link.name!r}: damping must be at least 0, got {values}")
        is_known = (link.body.id, link.index) in self._damping
        if not _store(self._damping, link, values):
            return
        if self._damping_rows is not None and self._world.takes_numbers():
            self._damping_rows[link.body.mujoco_ids[link.index]] = values
            if is_known:
                return  # as a step knows the rows
        if not self._world.is_stale:  # a compile does so
            self._world.refresh_stepping()

    def restitution_places(self, link: Link) -> list[Array] | None:
        """Return views (1,) of all places with a link's restitution, until arrays change; None if not set."""
        self._look_up_now()
        return self._places(link, self._restitution, self._restitution_rows)

    def compliance_places(self, link: Link) -> list[Array] | None:
        """Return views (2,) of all places with a link's compliance; see `restitution_places`."""
        self._look_up_now()
        return self._places(link, self._compliance, self._compliance_rows)

    def damping_places(self, link: Link) -> list[Array] | None:
        """Return views (4,) of all places with a link's drag; see `restitution_places`."""
        self._look_up_now()
        kept = self._damping.get((link.body.id, link.index))
        if kept is None:
            return None
        if self._world.is_stale or self._damping_rows is None:
            return [kept]
        return [kept, self._damping_rows[link.body.mujoco_ids[link.index]]]

    def _look_up_now(self) -> None:
        """Look up the arrays before the next step does, where they are those of the world."""
        world = self._world
        if not world.is_stale and (self._damping_rows is None or self._restitution_rows is None):
            self._look_up(world.live_model, world.live_data)

    def _places(self, link: Link, table: dict[tuple[int, int], Array], rows: Any) -> list[Array] | None:
        kept = table.get((link.body.id, link.index))
        if kept is None:
            return None
        if self._world.is_stale:
            return [kept]
        return [kept, *(rows[geom.id : geom.id + 1].reshape(-1) for geom in link._built.geoms)]

    def forget(self, body_id: int) -> None:
        """Remove the settings of a body that is removed."""
        for link in self._world.body_by_id[body_id].links:
            key = (body_id, link.index)
            if key in self._anchored:
                self.set_anchor(link, is_anchored=False)
            if key in self._restitution:
                self.set_restitution(link, 0.0)
                del self._restitution[key]
            if key in self._compliance:
                self.set_compliance(link, 0.0, 0.0)
                del self._compliance[key]
            if key in self._damping:
                self.set_damping(link, 0.0, 0.0)
                del self._damping[key]

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new."""
        self._restitution_rows = self._damping_rows = self._widths = None

    def apply(self, model: Any, data: Any, timestep: float, *, alone: bool = False) -> None:
        """Add drag to xfrc_applied and bounce to the contacts' references, between mj_step1 and mj_step2.

        Args:
            model: MjModel.
            data: MjData.
            timestep: duration of the step (s).
            alone: whether all rows are solved in turn, so that nothing need be prepared for MuJoCo's solver.
        """
        if self._damping_rows is None or self._restitution_rows is None:
            self._look_up(model, data)
        if self._damping:
            kernels().add_damping(*self._drag)
        profile, hard = self._world.profile, self._world.hard_contacts
        if hard and data.ne:
            kernels().hard_equalities(
                data.efc_pos, data.efc_vel, data.ne, timestep, profile.erp, data.efc_aref
            )
        if profile.hard_contacts and data.nl:
            kernels().hard_limits(
                *(data.efc_type, data.efc_pos, data.efc_vel, data.ne + data.nf, data.nl),
                *(timestep, profile.erp, profile.deep, data.efc_aref),
            )
        if data.ncon and (hard or profile.product_friction or self._restitution):
            self._apply_contacts(model, data, timestep, alone=alone)

    def _apply_contacts(self, model: Any, data: Any, timestep: float, *, alone: bool) -> None:
        """Apply friction and restitution of contacts."""
        profile = self._world.profile
        contact = data.contact
        geom, dim, address, friction = contact.geom, contact.dim, contact.efc_address, contact.friction
        velocity, reference = data.efc_vel, data.efc_aref
        weights = data.efc_R, data.efc_D
        coefficients, restitution, compliance = self._friction, self._restitution_rows, self._compliance_rows
        margins, reaches = self.margins_and_reaches(model, data)
        if self.soft:
            geom = self.soft.surfaces_of(contact, len(coefficients))
            with_flexes = self.soft.with_flexes
            coefficients = with_flexes("friction", coefficients, self._flex_friction)
            restitution = with_flexes("restitution", np.asarray(restitution), 0.0)
            compliance = with_flexes("compliance", compliance, 0.0)
            margins = with_flexes("margins", margins, 0.0)
            reaches = with_flexes("reaches", reaches, np.inf)
        if profile.product_friction:
            kernels().product_friction(coefficients, geom, dim, address, friction, contact.mu, *weights)
        if self._world.hard_contacts:
            rows = data.nefc
            if len(self._base) < rows:
                self._base, self._acceleration = np.zeros(2 * rows), np.zeros(2 * rows)
            kernels().hard_contacts(
                *(restitution, geom, dim, address, contact.dist, friction, velocity),
                *(timestep, profile.contact_erp, profile.contact_slop, profile.slow),
                *(self._base, reference, *weights),
                *(margins, reaches, contact.pos, contact.frame),
            )
            if self._compliance:
                kernels().compliant_contacts(
                    *(compliance, geom, dim, address, contact.dist, friction, contact.mu),
                    *(timestep, profile.contact_erp, profile.contact_slop, self._base, reference, *weights),
                )
            if alone:
                return
            if self.soft:
                soft_kernels().limit_push(
                    *(address, contact.flex, velocity, timestep, _SOFT_PUSH, self._base, reference)
                )
                free = self.soft.rows_without_push(model, contact)
                self._base[free] = reference[free] = kernels().NO_PUSH / timestep
            kernels().estimate_sliding(dim, address, friction, velocity, timestep, self._base, reference)
            self._sliding = dim, address, friction, velocity, self._acceleration[:rows]
            self._references = self._base, reference
        elif self._restitution:
            kernels().add_bounce(
                *(restitution, geom, address, velocity, data.efc_KBIP),
                *(timestep, profile.slow, reference),
            )
        if data.nisland and (profile.product_friction or self._world.hard_contacts):
            kernels().copy_to_islands(data.map_iefc2efc, *weights, data.iefc_R, data.iefc_D)

    def correct_sliding(self, model: Any, data: Any, timestep: float) -> None:
        """Correct sliding contacts and solve again until they agree, after the solver."""
        if not data.ncon:
            return
        # MuJoCo does not move a step's constraint arrays before the next step
        force, (_, reference) = data.efc_force, self._references
        contact = data.contact if self.soft else None

        def correct() -> float:
            before = reference.copy() if self.soft else reference
            largest = kernels().correct_sliding(*self._sliding, force, timestep, *self._references)
            if contact is None or not SLIDING_TOLERANCE <= largest < SOFT_SLIDING_TOLERANCE:
                return largest
            rows = contact.efc_address, contact.flex, force
            return timestep * soft_kernels().rigid_change(*rows, before, reference)

        self.solve_slides(model, data, self._sliding[-1], correct)

    def solve_slides(
        self, model: Any, data: Any, acceleration: np.ndarray, correct: Callable[[], float]
    ) -> None:
        """Correct sliding contacts and solve again until they agree, after the solver.

        Args:
            model: MjModel.
            data: MjData.
            acceleration: (nefc,) accelerations of rows, written; m/s² or rad/s².
            correct: changes the references by them and returns the largest change (m/s).
        """
        for _ in range(SLIDING_ITERATIONS):
            mujoco.mj_mulJacVec(model, data, acceleration, self._solution)
            if correct() < SLIDING_TOLERANCE:
                return
            data.qacc_warmstart[:] = self._solution
            mujoco.mj_fwdConstraint(model, data)

    def _look_up(self, model: Any, data: Any) -> None:
        """Look up the arrays that are valid until the next compile."""
        self._damping_rows, self._restitution_rows = self._gather(model)
        self._drag = (
            *(self._damping_rows, model.body_mass, model.body_inertia, model.body_rootid, data.cvel),
            *(data.xipos, data.ximat, data.subtree_com, data.xfrc_applied),
        )
        self._friction, self._solution = model.geom_friction, data.qacc
        self._flex_friction = model.flex_friction

    def _gather(self, model: Any) -> tuple[np.ndarray, np.ndarray]:
        damping, restitution = np.zeros((model.nbody, 4)), np.zeros(model.ngeom)
        bodies = self._world.body_by_id
        if self._damping:
            rows = [bodies[body_id].mujoco_ids[index] for body_id, index in self._damping]
            damping[rows] = list(self._damping.values())
        for (body_id, index), value in self._restitution.items():
            for geom in bodies[body_id].built.links[index].geoms:
                restitution[geom.id] = value.item()
        self._no_margins, self._no_reaches = (
            np.zeros(model.ngeom),
            np.full(model.ngeom, self._world.profile.contact_reach),
        )
        self._compliance_rows = np.zeros((model.ngeom, 2))
        for (body_id, index), values in self._compliance.items():
            self._compliance_rows[[geom.id for geom in bodies[body_id].built.links[index].geoms]] = values
        self.anchors = np.zeros(model.ngeom, np.uint8)
        for body_id, index in self._anchored:
            self.anchors[[geom.id for geom in bodies[body_id].built.links[index].geoms]] = 1
        return damping, restitution


def _store(table: dict[tuple[int, int], Array], link: Link, values: tuple[float, ...]) -> bool:
    """Store numbers of a link; return whether they changed."""
    key = link.body.id, link.index
    known = table.get(key)
    if known is None:
        table[key] = np.array(values, dtype=float)
    elif tuple(known.tolist()) == values:
        return False
    else:
        known[:] = values
    return True
