"""What constraints do in a step: bounds and free axes of their rows, and the forces that they applied."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np

from roboyard.sim.body import Body
from roboyard.sim.constraints.bounded_rows import HALF_ANGLE, bound_rows, free_axis
from roboyard.sim.constraints.kinds import SLIDE
from roboyard.sim.constraints.records import Constraint, Ends
from roboyard.sim.constraints.spec_elements import STIFF_SOLIMP
from roboyard.sim.engine import Engine
from roboyard.transforms import Array

LARGEST_FORCE = 1e10
"""Largest force of a constraint without a bound (N or N m), where rows are solved in turn."""
_WELDED = ("weld", "slide")
_ROWS = {"weld": 6, "slide": 6, "point": 3, "gear": 1}
"""Number of rows of a constraint in MuJoCo's arrays."""
CORRECTION = 0.2
"""Share of a bounded constraint's error corrected in a step. It requests a velocity, so that a bound that is
too low to brake in time cannot make it oscillate."""


class ConstraintRows:
    """The rows of one world's constraints."""

    def __init__(self, world: Engine[Body], by_id: dict[int, Constraint]) -> None:
        """Serve the constraints of a dictionary by their ids, which its owner changes."""
        self._world, self._by_id = world, by_id
        self._bounds = np.zeros(0)
        """(neq,) bounds of all equalities, if they are known."""
        self._are_known = False
        self._written: np.ndarray | None = None
        """(neq, 2) bounds where they were last written for the solver of rows in turn."""
        self._numbers: Any = None
        """The memory of those bounds."""
        self._shares: Any = None
        """The memory of the shares that were last written with them."""
        self._tuned_timestep = 0.0
        """Time step for which stiffness is set (s); 0 where that changed."""

    def refresh(self) -> None:
        """Note that constraints, their bounds or MuJoCo's arrays are other ones."""
        self._are_known = False
        self._tuned_timestep = 0.0

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new."""
        self.refresh()
        self._bounds, self._written = np.zeros(0), None
        self._numbers = self._shares = None

    def bound_places(self, constraint: Constraint) -> tuple[np.ndarray, np.ndarray] | None:
        """Return where a finite bound of a constraint is written while MuJoCo's arrays are the same.

        Returns:
            (1,) bound of its rows, (2,) bound in the solver, at most `LARGEST_FORCE`, and that of a weld's
            last rows, twice as large; None where the next step reads all bounds.
        """
        if self._written is None or constraint.element is None or self._world.is_stale:
            return None
        equality, bounds = constraint.element.id, self._of_all(self._world.live_model.neq)
        if not 0 <= equality < min(len(bounds), len(self._written)):
            return None
        return bounds[equality : equality + 1], self._written[equality]

    def share_place(self, constraint: Constraint) -> np.ndarray | None:
        """Return where a share of a constraint is written (1,) while MuJoCo's arrays are the same.

        None where the next step reads all shares.
        """
        if self.bound_places(constraint) is None or self._shares is None:
            return None
        equality = constraint.element.id
        return np.asarray(self._shares)[equality : equality + 1]

    def write_bound(self, constraint: Constraint) -> bool:
        """Write a finite bound where another was; return False where steps read all bounds first."""
        places = self.bound_places(constraint)
        if places is None:
            return False
        force = min(constraint.max_force, LARGEST_FORCE)
        places[0][0], places[1][:] = constraint.max_force, (force, 2.0 * force)
        return True

    def _of_all(self, count: int) -> np.ndarray:
        if len(self._bounds) != count:
            self._bounds, self._are_known = np.full(count, np.inf), False
        return self._bounds

    def applied(self, constraint: Constraint) -> Array:
        """Return the efforts of a constraint in the last step, in the world frame.

        Returns:
            (1,), (3,) or (6,) forces (N) and torques (N m).
        """
        return np.array(self.applied_numbers(constraint))

    def applied_numbers(self, constraint: Constraint) -> list[float]:
        """Return the numbers of `applied`."""
        world = self._world
        data, number, count = world.live_data, constraint.element.id, _ROWS[constraint.kind]
        owners, first = data.efc_id, constraint.first_row
        if (
            first + count > data.ne
            or owners.item(first) != number
            or (first and owners.item(first - 1) == number)
        ):
            equalities = owners[: data.ne].tolist()
            if number not in equalities:
                return []
            first = constraint.first_row = equalities.index(number)  # its rows are one after another
        forces: list[float] = data.efc_force[first : first + count].tolist()
        if constraint.kind in _WELDED:
            forces[3:] = [HALF_ANGLE * moment for moment in forces[3:]]
            if constraint.kind == "slide" and world.hard_contacts:
                forces[3:] = *forces[4:], forces[3]  # see `free_slide`
        return forces

    def prepare(self, model: Any) -> None:
        """Set the stiffness of bounded constraints, which depends on the time step, before a step."""
        timestep = model.opt.timestep
        if timestep == self._tuned_timestep:
            return
        self._tuned_timestep = timestep
        most = STIFF_SOLIMP[1]
        for constraint in self._by_id.values():
            if constraint.tuned != timestep and isfinite(constraint.max_force):
                constraint.tuned = timestep
                pull = (-CORRECTION * most**2 / timestep**2, -most / timestep)
                model.eq_solref[constraint.element.id] = pull

    def ends(self, model: Any) -> tuple[Ends, ...]:
        """Return what the order of solution needs to know of all constraints, as they were added."""
        return tuple(
            [constraint.ends or self._look_up_ends(model, constraint) for constraint in self._by_id.values()]
        )

    def _look_up_ends(self, model: Any, constraint: Constraint) -> Ends:
        equality, aux, sites = constraint.element.id, -1 if constraint.axis is None else SLIDE, (-1, -1)
        if constraint.has_frames:
            owner_of, tree_of, sites = model.site_bodyid.item, model.body_treeid.item, constraint.rows
            trees = tree_of(owner_of(sites[0])), tree_of(owner_of(sites[1]))
        else:
            if constraint.tendon is not None:
                first = model.tendon_adr.item(constraint.tendon.id)
                joints = model.wrap_objid[first : first + 3].tolist()
                aux = model.jnt_dofadr.item(joints[2])
            else:
                joints = model.eq_obj1id.item(equality), model.eq_obj2id.item(equality)
            dof_of, tree_of = model.jnt_dofadr.item, model.dof_treeid.item
            trees = tree_of(dof_of(joints[0])), tree_of(dof_of(joints[1]))
        found = constraint.ends = equality, *trees, aux, *sites
        return found

    def write_bounds(self, bounds: np.ndarray, shares: np.ndarray) -> None:
        """Write (neq, 2) bounds of rows, the last three of a weld's apart, and (neq,) shares.

        The bounds are in the rows' units, of which a weld's last are half angles.
        """
        if self._written is not bounds:
            bounds[:], shares[:] = LARGEST_FORCE, 1.0
            self._written, self._numbers, self._shares = bounds, bounds.reshape(-1).data, shares.data
        numbers, parts = self._numbers, self._shares
        for constraint in self._by_id.values():
            force, equality = constraint.max_force, constraint.element.id
            if force > LARGEST_FORCE:
                force = LARGEST_FORCE
            numbers[2 * equality], numbers[2 * equality + 1] = force, 2.0 * force
            parts[equality] = constraint.share

    def slides(self) -> list[tuple[int, int, Array]]:
        """Return row among MuJoCo's equalities, site of the frame and axis (3,) in it of each slide."""
        return [
            (constraint.element.id, constraint.site_a.id, constraint.axis)
            for constraint in self._by_id.values()
            if constraint.axis is not None
        ]

    def free_axes(self, model: Any, data: Any) -> None:
        """Free slides along their axes, between the halves of a step."""
        for constraint in self._by_id.values():
            if constraint.axis is not None:
                free_axis(
                    model,
                    data,
                    constraint.element.id,
                    constraint.site_a.id,
                    constraint.site_b.id,
                    constraint.axis,
                    follows=not self._world.hard_contacts,
                )

    def bound_forces(self, model: Any, data: Any) -> None:
        """Apply the force bounds of rows, after the solver."""
        bounds = self._of_all(model.neq)
        if not self._are_known:
            bounds[:] = np.inf
            for constraint in self._by_id.values():
                bounds[constraint.element.id] = constraint.max_force
            self._are_known = True
        if data.ne:
            bound_rows(model, data, bounds[data.efc_id[: data.ne]])
