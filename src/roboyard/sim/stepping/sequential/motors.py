"""Robots with motors solved row by row, as Bullet solves them.

An impulse solver improves all impulses in turn and stops after a number of rounds. Where joints act on each
other strongly, as the first and third of an arm, or motors are at their largest force, it has not arrived at
the solution by then: with PyBullet, arms under `POSITION_CONTROL` and cars move by what the rounds leave
over, and so do bodies in a pile. Where soft bodies touch something, only robots with motors or constraints
and what touches them are solved that way and all else is left to MuJoCo, as are worlds with equalities of
files.
"""

from __future__ import annotations

import itertools
from operator import is_
from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.native import lazy_loop
from roboyard.sim.actuation.velocity_motors import VelocityMotors
from roboyard.sim.body import Body
from roboyard.sim.constraints.constraints import Constraints
from roboyard.sim.constraints.records import Ends
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.contact_rows import FIRST_ROWS, ContactRows
from roboyard.sim.stepping.impulses import records as r
from roboyard.sim.stepping.manifolds import Manifolds
from roboyard.sim.stepping.narrow_phase.kept_fields import kept_fields
from roboyard.sim.stepping.sequential import solver_arrays as arrays
from roboyard.sim.stepping.sequential.solution_order import (
    BodyParts,
    list_parts,
    number_places,
    parts_of,
    solution_order,
)
from roboyard.sim.stepping.shape_forms import PLACED
from roboyard.sim.stepping.step_rows import ALL, StepRows
from roboyard.sim.stepping.surfaces import Surfaces

handing_over = lazy_module("roboyard.sim.stepping.impulses.handing_over")
order = lazy_loop("roboyard.sim.stepping.impulses.order", "execute")
solving = lazy_module("roboyard.sim.stepping.impulses.solving")
welds = lazy_module("roboyard.sim.stepping.sequential.weld_kernels")

_BALL = 1
"""MuJoCo's type of spherical joints."""
_ORDERS = 4
"""Orders of solution that are kept, for programs that create and remove the same in turns."""
_MADE, _LAST, _SLOTS = "arrays of rows in turn", "last bundle of rows in turn", "orders of rows in turn"
_SETS = "numbers of sets of limits and motors"
_PARTS = "limits and motors of bodies"
_WORK = "work arrays of rows in turn"
"""Names in `Engine.of_arrays`."""
_KEPT = "motors", "targets", "largest", "rules", "places", "links", "neighbours", "pair"
"""Arrays of the solver whose sizes do not depend on the number of rows."""
_NUMBERS = itertools.count()


class SequentialMotors:
    """The solver of the robots with motors of one world."""

    def __init__(
        self,
        world: Engine[Body],
        motors: VelocityMotors,
        surfaces: Surfaces,
        manifolds: Manifolds,
        constraints: Constraints,
    ) -> None:
        self._world, self._motors, self._surfaces = world, motors, surfaces
        self._manifolds, self._constraints = manifolds, constraints
        self._rounds: int = world.profile.motor_rounds
        self._residual: float = world.profile.motor_residual
        self._by_entry = self._is_pyramid = False
        self._largest: np.ndarray | None = None
        self._unbounded = np.zeros(0)
        """(nv,) infinite bounds."""
        self._mechanism: r.Mechanism | None = None
        self._state: Any = None
        self._surface: Any = None
        self._fields: Any = None
        self._solver = arrays.no_solver()
        self.contact_rows = ContactRows()
        """Rows of contacts that MuJoCo does not make."""
        self._width = 0
        """Most degrees of freedom that a row moves."""
        self._bundle: Any = None
        self._last_bundle: Any = None
        """The last one, also where it is out of date."""
        """All of these as one argument of compiled loops; None where one is another now."""
        self._bundles: dict[tuple[int, ...], Any] = {}
        """The last few of them, by the ids of their records."""
        self._parts: dict[int, BodyParts] | None = None
        """Limits and motors of each body by its id; None where bodies came or went."""
        self._number = -1
        """Number of the parts; -1 where they changed."""
        self._is_ordered = False
        """Whether the order of solution has all constraints."""
        self._order_memory = np.zeros(0, np.int32)
        """The memory of all arrays of the order of solution."""
        self._ordered: tuple[Any, ...] | None = None
        """Key of the order in these arrays."""
        self._known: tuple[Any, ...] = ()
        """Revision, time step, profile and motors that were looked up."""
        self._written: tuple[Any, ...] = ()
        """The numbers that the solver's rules were written from."""

    def set_rounds(self, rounds: int, residual: float) -> None:
        """Set when the solver ends.

        Args:
            rounds: rounds in a step; 0 leaves all trees to MuJoCo.
            residual: square of the change of velocity (rad/s or m/s) below which the rounds end.
        """
        self._rounds, self._residual = rounds, residual
        self.refresh()

    def sort_pairs(self, by_entry: bool) -> None:
        """Set the order of pairs of shapes: that in which their links met, or in which these were made."""
        if self._by_entry != by_entry:
            self._by_entry = by_entry
            self._manifolds.points.notes[r.SORTED] = 0
            self.refresh()

    def limit_friction(self, *, singly: bool) -> None:
        """Set whether friction is bounded in each of its two directions alone, not by a cone.

        Nothing then resists contacts' spinning.
        """
        if self._is_pyramid != singly:
            self._is_pyramid = singly
            self.refresh()

    def bound_velocities(self, largest: np.ndarray | None) -> None:
        """Set the (nv,) bounds on velocities (rad/s or m/s) after a step; None for none."""
        self._largest = largest
        self.refresh()

    def refresh(self) -> None:
        """Note that a rule was changed."""
        self._known = ()

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new."""
        self._mechanism = self._parts = None
        self._bundles.clear()
        self._known = ()
        self.contact_rows.invalidate()

    def note_bodies(self) -> None:
        """Note that bodies were added or removed; where MuJoCo's arrays stay, the order alone is another."""
        self._parts = None
        self._bundles.clear()
        self._is_ordered = False
        self._known = ()

    def change(self, body: Body, *, is_there: bool) -> None:
        """Note that rows of MuJoCo's arrays, which stay, became a body's or are no longer one's.

        One without joints has no place in the order of solution.
        """
        parts, model = self._parts, self._world.live_model
        known = self._world.of_arrays.get(_PARTS)
        if parts is None or body.joints or known is None or known[0] != model.jnt_limited.tobytes():
            self.note_bodies()
        elif is_there:
            parts[body.id] = parts_of(body, model)
        else:
            del parts[body.id]
        self._number = -1

    def note_constraints(self) -> None:
        """Note that a constraint came, went or has another bound, without a compile."""
        self._is_ordered = False

    def prepare(self, model: Any, data: Any, timestep: float) -> None:
        """Look up arrays and rules that have changed, before a step."""
        world, known = self._world, self._known
        if (
            not known
            or known[0] != world.revision
            or known[1] != timestep
            or known[2] is not world.profile
            or known[3] is not self._motors.arrays
        ):
            self._look_up(model, data, timestep)
        elif not self._is_ordered:
            self._look_up_constraints(model)

    def arrange(self, found: StepRows) -> bool:
        """List the rows of robots with motors, and of what touches them, after MuJoCo has made the rows.

        Returns:
            Whether these are all rows, so that MuJoCo's solver has nothing left to do.
        """
        return self.execute(found, r.ARRANGE, r.ARRANGE) == r.DONE

    def finish(self, found: StepRows, *, remade: bool = False) -> None:
        """Compute accelerations and forces after `arrange`, where its rows are all.

        Args:
            found: the contacts and rows.
            remade: whether the rows were made again, without their velocities.
        """
        self.execute(found, r.ASK, r.SOLVE, remade=1 if remade else 0)

    def solve(self, found: StepRows) -> None:
        """Solve the rows that are arranged, after `mj_fwdAcceleration`.

        The solution is written where these are all rows; `write` does it otherwise, after MuJoCo's solver.
        """
        if self._solver.ends.item(5) >= 0:
            self.execute(found, r.SOLVE, r.SOLVE)

    def hand_over(self, found: StepRows) -> None:
        """Write what rows ask for into MuJoCo's, for its solver, and what forces alone lead to.

        The rows must be in MuJoCo's block.
        """
        handing_over().hand_over(self.bundle_of(found))

    def correct_slides(self, found: StepRows, acceleration: np.ndarray, timestep: float) -> float:
        """Remove the lift of sliding contacts after MuJoCo's solver; return the largest change (m/s).

        Args:
            found: the contacts and rows, whose references are changed.
            acceleration: (nefc,) of rows, m/s² or rad/s².
            timestep: duration of the step (s).
        """
        return handing_over().correct_slides(
            found.rows, found.contacts, found.search, self._surface, acceleration, timestep
        )

    @property
    def surface(self) -> r.Surface | None:
        """Coefficients of geoms, once `prepare` has been called."""
        return self._surface

    def execute(self, found: StepRows, first: int, last: int, remade: int = 0, makes: int = r.OF_NONE) -> int:
        """Execute parts of a step in the compiled loop of that name; return what it returns.

        Args:
            found: the contacts and rows.
            first: part to begin with.
            last: part to end with.
            remade: 1 where rows were made again, without their velocities.
            makes: which rows are made here instead of by MuJoCo.
        """
        answer = order().execute(self.bundle_of(found), first, last, remade, makes)
        return self.go_on(answer, found, first, last, remade, makes)

    def go_on(self, answer: int, found: StepRows, first: int, last: int, remade: int, makes: int) -> int:
        """Execute parts of a step again where there was no room for them; return what `execute` does.

        Args:
            answer: of the compiled loop, which was given the other arguments.
            found: the contacts and rows.
            first: part that it began with.
            last: part to end with.
            remade: 1 where rows were made again, without their velocities.
            makes: which rows are made here instead of by MuJoCo.
        """
        while answer in (r.ROOM, r.ROOM_FOR_ROWS, r.LOST):
            if answer == r.LOST:
                found.leave_memory()
            else:
                counts = found.look()
                self._grow(counts[0], max(counts[ALL], int(self.contact_rows.counts[ALL])))
                if answer == r.ROOM_FOR_ROWS:
                    first = max(first, r.MAKE)
            answer = order().execute(self.bundle_of(found), first, last, remade, makes)
        return answer

    def prepared(self, found: StepRows, timestep: float) -> Any:
        """Return the bundle of compiled loops where `prepare` has nothing to do; else None."""
        world, known, bundle = self._world, self._known, self._bundle
        if (
            not known
            or bundle is None
            or known[0] != world.revision
            or known[1] != timestep
            or known[2] is not world.profile
            or known[3] is not self._motors.arrays
            or not found.is_direct
            or not self._manifolds.is_prepared
            or bundle.records[2] is not found.search
            or bundle.records[5] is not self._manifolds.points
        ):
            return None
        return bundle

    def bundle_of(self, found: StepRows) -> Any:
        """Return all arrays of a step as one argument of compiled loops."""
        if not found.is_direct:
            found.look()
            self._bundle = None
        bundle = self._bundle
        if (
            bundle is None
            or bundle.records[2] is not found.search
            or bundle.records[5] is not self._manifolds.points
        ):
            own = self.contact_rows.records(found)
            parts = (
                *(found.rows, found.contacts, found.search, self._mechanism, self._state),
                *(self._manifolds.points, self._surface, self._solver, self._fields, *own),
            )
            bundles = self._bundles
            key = tuple(map(id, parts))  # of objects that the bundles hold
            bundle = bundles.get(key)
            if bundle is None:
                bundle = bundles[key] = r.EVERYTHING.of(*parts, before=self._before())
                while len(bundles) > _ORDERS:
                    del bundles[next(iter(bundles))]
            self._bundle = self._last_bundle = self._world.of_arrays[_LAST] = bundle
        return bundle

    def _before(self) -> Any:
        """Return the last bundle of this world, or of the one whose arrays it took over."""
        return self._world.of_arrays.get(_LAST) if self._last_bundle is None else self._last_bundle

    def write(self, found: StepRows, timestep: float) -> None:
        """Write the solution over MuJoCo's, after its solver, which had other rows."""
        solver, mechanism, state = self._solver, self._mechanism, self._state
        if mechanism is None or solver.ends.item(5) < 0:
            return
        start, count = found.rows.starts[9], found.counts[ALL]
        solving().write_solution(
            *(solver.order, solver.spans, solver.goals, solver.ends, solver.jacobian, solver.change),
            *(state.smooth, solver.taken, mechanism.dof_tree, timestep),
            *(state.qacc, found.rows.force[start : start + count], state.constraint),
        )

    # ----------------------------------------------------------------------------------------- book-keeping

    def _grow(self, contacts: int, rows: int) -> None:
        self._manifolds.grow(contacts)
        self.contact_rows.grow()
        solver = self._solver
        if rows > len(solver.order):
            lengths = (len(a) for a in (self._state.qvel, solver.wrenches, solver.taken))
            keeps = {name: getattr(solver, name) for name in _KEPT}
            self._solver = arrays.of_solver(2 * rows, *lengths, entries=self._width)._replace(**keeps)
            self._keep_work_arrays()
            self._manifolds.points.notes[r.SORTED] = 0  # its groups are not known
        self._surface = self._surface._replace(base=self._surfaces.normal_references(len(self._solver.order)))
        self._bundle = None

    def _look_up(self, model: Any, data: Any, timestep: float) -> None:
        world, motors = self._world, self._motors.arrays
        if self._mechanism is None:
            made = world.of_arrays.get(_MADE)
            if made is None:
                made = world.of_arrays[_MADE] = *arrays.of_model(model), arrays.of_data(data)
            self._mechanism, self._order_memory, self._state = made
            self._fields = kept_fields(world)
            self._width = min(model.nv, 2 * int(max(model.tree_dofnum, default=0)))
            self._take_work_arrays(model)
            self._manifolds.points.notes[r.SORTED] = 0  # its groups are not known
            self._unbounded = np.full(model.nv, np.inf)
            self._bundle, self._is_ordered, self._ordered, self._written = None, False, None, ()
        mechanism = self._mechanism
        assert mechanism is not None
        self._look_up_welds(mechanism, model)
        self._look_up_constraints(model)
        profile, surfaces, solver = world.profile, self._surfaces, self._solver
        surface = surfaces.record(model, data, len(solver.order))
        if not _same(surface, self._surface):
            self._surface, self._bundle = surface, None
        largest = self._unbounded if self._largest is None else self._largest
        if not _same((motors[0], motors[1], largest), (solver.motors, solver.targets, solver.largest)):
            self._solver = solver._replace(motors=motors[0], targets=motors[1], largest=largest)
            self._bundle = None
        written = (
            *(timestep, profile, self._residual, self._rounds, surfaces.are_compliant, world.hard_contacts),
            *(self._manifolds.keeps, self._largest is not None, self._by_entry, self._is_pyramid),
        )
        if written != self._written:
            self._written = written
            self._write_rules(solver.rules, timestep)
        if self._manifolds.keeps and len(surface.boxes):
            model.opt.disableflags |= PLACED
        else:
            model.opt.disableflags &= ~PLACED
        self._known = world.revision, timestep, profile, motors

    def _look_up_constraints(self, model: Any) -> None:
        """Look up the order of solution and the bounds of constraints."""
        mechanism, constraints = self._mechanism, self._constraints
        assert mechanism is not None
        if not self._is_ordered:
            self._order(mechanism, model)
        count = len(mechanism.equality_share)
        self.contact_rows.has_equalities = count > constraints.inactive_count
        if count:
            constraints.rows.write_bounds(mechanism.equality_bound, mechanism.equality_share)

    def _look_up_welds(self, mechanism: r.Mechanism, model: Any) -> None:
        """Look up which links count as fixed to each other; see `touching_welds`."""
        if self._world.profile.parents_pass:
            return
        found = np.empty((2, model.nbody), np.int32)
        loops = welds()
        answer = loops.touching_welds(mechanism, model.body_weldid, model.body_dofnum, found)
        self.contact_rows.links_touch = answer & loops.TOUCH > 0
        if answer & loops.DIFFER == 0:
            self.contact_rows.welds = None
        elif self.contact_rows.welds is None or not np.array_equal(self.contact_rows.welds, found):
            self.contact_rows.welds = found

    def _take_work_arrays(self, model: Any) -> None:
        """Take the solver's arrays of the world whose model this one took over, or make them."""
        known, made = self._world.of_arrays.get(_WORK), None
        if known is not None:
            made, self.contact_rows = known
            self.contact_rows.invalidate()
        if made is None or len(made.order) < len(self._solver.order):
            rows = max(len(self._solver.order), FIRST_ROWS[0])
            sizes = model.nv, model.nbody, model.ntree
            made = arrays.of_solver(
                rows, *sizes, self._width, has_balls=bool((model.jnt_type == _BALL).any())
            )
        else:
            made.ends[:], made.rules[:] = -1, 0.0
        self._solver = made
        self._keep_work_arrays()

    def _keep_work_arrays(self) -> None:
        self._world.of_arrays[_WORK] = self._solver, self.contact_rows

    def _write_rules(self, rules: np.ndarray, timestep: float) -> None:
        world, profile = self._world, self._world.profile
        rules[r.TIMESTEP], rules[r.ERP], rules[r.CONTACT_ERP] = timestep, profile.erp, profile.contact_erp
        rules[r.DEEP], rules[r.SLOW], rules[r.RESIDUAL] = profile.deep, profile.slow, self._residual
        rules[r.ROUNDS] = self._rounds
        rules[r.IS_PRODUCT] = profile.product_friction
        rules[r.IS_COMPLIANT] = self._surfaces.are_compliant
        rules[r.LIMITS_ARE_HARD], rules[r.CONTACTS_ARE_HARD] = profile.hard_contacts, world.hard_contacts
        rules[r.KEEPS_POINTS], rules[r.SEEN] = self._manifolds.keeps, 2 * profile.contact_margin
        rules[r.IS_BOUNDED], rules[r.SLOP] = self._largest is not None, profile.contact_slop
        rules[r.BY_ENTRY], rules[r.IS_PYRAMID] = self._by_entry, self._is_pyramid

    def _order(self, mechanism: r.Mechanism, model: Any) -> None:
        """Write the order of solution."""
        self._is_ordered = True
        if self._parts is None:
            self._parts, self._number = self._look_up_parts(), -1
        made_from = self._number_of_parts(self._parts), self._constraints.rows.ends(model)
        if made_from == self._ordered:
            return
        self._ordered = made_from
        self._manifolds.points.notes[r.SORTED] = 0  # its groups are joined by equalities, too
        orders = self._world.of_arrays.setdefault(_SLOTS, {})
        found = orders.get(made_from)
        if found is None:
            places = self._write_order(mechanism, model.dof_treeid, made_from[1])
            orders[made_from] = places, self._order_memory.copy()
            while len(orders) > _ORDERS:
                del orders[next(iter(orders))]
        else:
            places, self._order_memory[:] = found
        if places > len(self._solver.places):
            # with room for two constraints more, which may come and go
            room = np.full(places + 2 * r.EQUALITY_ROWS, -1, np.int32)
            self._solver, self._bundle = self._solver._replace(places=room), None

    def _write_order(self, mechanism: r.Mechanism, dof_tree: np.ndarray, ends: tuple[Ends, ...]) -> int:
        """Write the order of solution of bodies' parts and these constraints; return the number of rows."""
        equalities, tree, place = [end[0] for end in ends], mechanism.equality_tree, mechanism.equality_slot
        tree[:], mechanism.equality_aux[:], mechanism.equality_site[:] = -2, -1, -1
        for equality, *trees, aux, first, second in ends:
            tree[equality], mechanism.equality_aux[equality] = trees, aux
            mechanism.equality_site[equality] = first, second
        assert self._parts is not None
        bodies = list(self._parts.values())
        order = solution_order(bodies, equalities, tree)
        places = number_places(order, mechanism.slot, mechanism.limit_slot, place)
        parts = list_parts(bodies, equalities, tree, dof_tree)
        count = parts.shape[1]
        mechanism.parts[: len(parts), :count] = parts
        mechanism.parts[r.PART_KIND, count] = -1
        mechanism.equality_order[:] = -1
        mechanism.equality_order[: len(equalities)] = equalities
        tree[place < 0] = -2
        return places

    def _number_of_parts(self, parts: dict[int, BodyParts]) -> int:
        """Return the same number for the same parts of all bodies, which takes less time to compare."""
        if self._number < 0:
            known: dict[Any, int] = self._world.of_arrays.setdefault(_SETS, {})
            key = tuple((one.trees, one.limits, one.motors) for one in parts.values())
            number = known.get(key)
            if number is None:
                number = known[key] = next(_NUMBERS)
                while len(known) > _ORDERS:
                    del known[next(iter(known))]
            self._number = number
        return self._number

    def _look_up_parts(self) -> dict[int, BodyParts]:
        """Return the limits and motors of each body by its id; they depend on its row."""
        world, model = self._world, self._world.live_model
        limits, known = model.jnt_limited.tobytes(), world.of_arrays.get(_PARTS)
        if known is None or known[0] != limits:
            known = world.of_arrays[_PARTS] = limits, {}
        of_row, found = known[1], dict[int, BodyParts]()
        for key, body in world.body_by_id.items():
            place = body.mujoco_ids.item(0), len(body.links)
            parts = of_row.get(place)
            if parts is None:
                parts = of_row[place] = parts_of(body, model)
            found[key] = parts
        return found


def _same(one: tuple[Any, ...], other: tuple[Any, ...] | None) -> bool:
    """Return whether two records have the same arrays."""
    return other is not None and all(map(is_, one, other))
