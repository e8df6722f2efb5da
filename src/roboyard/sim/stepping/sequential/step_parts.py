"""The parts of a world's time steps, the rules that these apply, and how contacts are found."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard.native import lazy_loop
from roboyard.sim.actuation.velocity_motors import VelocityMotors
from roboyard.sim.body import Body
from roboyard.sim.constraints.constraints import Constraints
from roboyard.sim.engine import Engine
from roboyard.sim.soft.soft_bodies import SoftBodies
from roboyard.sim.stepping.contact_rows import find_with_welds, first_half, without
from roboyard.sim.stepping.fast_turns import FastTurns
from roboyard.sim.stepping.impulses import records as r
from roboyard.sim.stepping.joint_stops import JointStops
from roboyard.sim.stepping.manifolds import Manifolds
from roboyard.sim.stepping.sequential.detection import Detection
from roboyard.sim.stepping.sequential.last_forces import LastForces
from roboyard.sim.stepping.sequential.motors import SequentialMotors
from roboyard.sim.stepping.sliding import SlidingContacts
from roboyard.sim.stepping.step_rows import StepRows
from roboyard.sim.stepping.surfaces import Surfaces
from roboyard.sim.stepping.triangle_windows import TriangleWindows
from roboyard.sim.stepping.wrenches import Wrenches

field_contacts = lazy_module("roboyard.sim.stepping.narrow_phase.field_contacts")
finding = lazy_module("roboyard.sim.stepping.impulses.finding")
surface_shifts = lazy_module("roboyard.sim.stepping.narrow_phase.surface_shifts")
order = lazy_loop("roboyard.sim.stepping.impulses.order", "execute")

_ROWS = "rows of a step"
"""Name in `Engine.of_arrays`."""


class StepParts:
    """The parts of one world's time steps; call `refresh` whenever a rule is added or removed."""

    def __init__(
        self,
        world: Engine[Body],
        *,
        surfaces: Surfaces,
        motors: VelocityMotors,
        constraints: Constraints,
        wrenches: Wrenches,
        windows: TriangleWindows,
        soft: SoftBodies,
    ) -> None:
        self._world = world
        self._is_implicit = world.profile.integrator == "implicitfast"
        self._soft = soft
        self._windows = windows
        self.surfaces, self.motors = surfaces, motors
        self.constraints, self.wrenches = constraints, wrenches
        self.sliding = SlidingContacts(world)
        """Contacts that slide, where contacts are soft."""
        self.stops = JointStops(world)
        """Joints that pass their stops within a step, where limits are soft."""
        self.fast_turns = FastTurns()
        """Mechanisms that turn fast, where the integrator is implicit."""
        self.manifolds = Manifolds(world, windows)
        """Points that pairs keep, where contacts are rigid."""
        self.in_turn = SequentialMotors(world, motors, surfaces, self.manifolds, constraints)
        """Robots with motors, where they are solved row by row as Bullet does."""
        self.forces = LastForces(motors, self.manifolds, self.in_turn, is_implicit=self._is_implicit)
        """Forces of the last step."""
        motors.forces_elsewhere = self.forces.own_motor_forces
        self._flags = 0
        """MuJoCo's flags while it found the contacts of the last step."""
        self._has_surfaces = self._has_motors = self._is_bounded = self._has_rules = self._slides = False
        self._is_in_turn = False
        """Whether robots with motors, or constraints, may be solved row by row."""
        self._makes_rows = True
        """Whether rows of contacts may be made here instead of by MuJoCo."""
        self._has_drag = False
        """Whether the drag of this step was added to external forces."""
        self._accelerations = np.zeros(0)
        """Room for those of a step's rows."""
        self._velocity_limits: dict[int, float] = {}
        self._compiled: tuple[Any, ...] | None = None
        """MuJoCo's options, a step's rows, velocities, accelerations, bounds on velocities, if any, and
        whether there are actuators and height fields."""
        self._knows_constraints = False
        """Whether the rules of constraints are those of the present ones."""
        self._is_direct = False
        """Whether the last step was three compiled calls, and no rule has changed since."""

    def refresh(self) -> None:
        """Look up which rules the steps have to apply."""
        self._has_surfaces = self.surfaces.is_active
        self._has_motors = self.motors.is_active
        self._makes_rows = True
        self._knows_constraints = self._is_direct = False
        self.in_turn.refresh()

    def note_constraints(self) -> None:
        """Note that a constraint came, went or has another bound or axis, without a compile."""
        self._makes_rows = True
        self._knows_constraints = self._is_direct = False
        self.in_turn.note_constraints()

    def _look_up_constraints(self) -> None:
        constraints = self.constraints
        self._knows_constraints = True
        self._is_bounded, self._slides = constraints.is_bounded, constraints.has_slides
        self._is_in_turn = self._has_motors or (self._world.hard_contacts and len(constraints) > 0)
        self._has_rules = self._has_surfaces or self._has_motors or self._is_bounded

    @property
    def is_plain(self) -> bool:
        """Whether MuJoCo's own step has all the rules of this world, but for sliding."""
        if not self._knows_constraints:
            self._look_up_constraints()
        return not (self._has_rules or self.wrenches.pending or self._soft.by_id)

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new."""
        self._compiled = self.forces.found = None
        self._is_direct = False
        self.sliding.invalidate()
        self.stops.invalidate()
        self.fast_turns.invalidate()
        self.manifolds.invalidate()
        self.in_turn.invalidate()

    def note_bodies(self) -> None:
        """Note that bodies were added or removed, with or without a compile."""
        self._is_direct = False
        self.sliding.invalidate()
        self.fast_turns.invalidate()
        self.manifolds.invalidate()
        self.in_turn.note_bodies()

    def change(self, body: Body, *, is_there: bool) -> None:
        """Note that rows of MuJoCo's arrays, which stay, became a body's or are no longer one's."""
        self.sliding.invalidate()
        self.fast_turns.invalidate()
        self.manifolds.change(body, is_there=is_there)
        self.in_turn.change(body, is_there=is_there)

    def forget(self, body_id: int) -> None:
        """Remove the velocity limits and long axes of a body that is removed."""
        self._velocity_limits.pop(body_id, None)
        world = self._world
        if world.long_axes:
            world.long_axes = {k: v for k, v in world.long_axes.items() if k[0] != body_id}

    def set_velocity_limit(self, body_id: int, largest: float) -> None:
        """Bound the velocities of a body's joints (rad/s or m/s) instead of the world's profile."""
        self._velocity_limits[body_id] = largest
        self._compiled = self.forces.found = None

    def _collide(self, call: Callable[[Any, Any], None], model: Any, data: Any) -> None:
        """Call a function of MuJoCo that finds contacts, with room for those that are found here."""
        flags = self._flags_of_fields(model, data)
        if flags:
            without(flags, call, model, data)
        else:
            call(model, data)

    def _first_half(self) -> Callable[[Any, Any], None]:
        """Return what mj_step1 does in this world."""
        merge = self._soft.merge_contacts if self._soft.by_id else None
        return partial(first_half, self._world.axis_lengths(), self.in_turn.contact_rows.welds, merge=merge)

    def _flags_of_fields(self, model: Any, data: Any) -> int:
        """Return MuJoCo's flags with which it leaves room for the points of shapes on height fields."""
        assert self._compiled is not None
        if not (self._compiled[6] and self.manifolds.keeps and self._world.hard_contacts):
            return 0
        return (
            field_contacts().MARK
            if self._windows.fields.leaves_room(model, self.surfaces.forms(model, data))
            else 0
        )

    def _prepare(self, model: Any, data: Any, timestep: float) -> None:
        """Prepare motors, kept points and the solver of both before a step."""
        self.motors.prepare(model, timestep)
        if self._world.hard_contacts:
            self.manifolds.prepare(model, data)
        self.in_turn.prepare(model, data, timestep)

    def _update_points(self, model: Any, data: Any, found: StepRows) -> bool:
        """Move contacts as the rules require and keep points; return whether any was moved or added."""
        margins, reaches = self.surfaces.margins_and_reaches(model, data)
        forms = self.surfaces.forms(model, data)
        moved = len(forms.boxes) > 0 and self.manifolds.move(model, data, found, margins, forms)
        anchors = self.surfaces.anchors
        return self.manifolds.update(model, data, found, margins, reaches, anchors, forms) or moved

    def detect(self, model: Any, data: Any) -> None:
        """Find the contacts of the present positions, whose frames are known."""
        if not self._world.hard_contacts:
            mujoco.mj_collision(model, data)
            return
        self.manifolds.prepare(model, data)
        self.surfaces.margins_and_reaches(model, data)
        if self._detect_directly(model, data):
            return
        if self._compiled is None:
            self._compiled = self._look_up(model, data)
        self._collide(partial(find_with_welds, self.in_turn.contact_rows.welds), model, data)
        found = self._compiled[1]
        if found.look()[0]:
            self._update_points(model, data, found)
            self.surfaces.shift_contacts(model, data, found)
        else:
            self.manifolds.forget()
        if self._windows.shows_slots:
            self._windows.correct_contacts(data)

    def _detect_directly(self, model: Any, data: Any) -> bool:
        """Do what `detect` does in two compiled calls, as prepared by a step; return whether it could."""
        addresses = self._detection_addresses(model, data)
        if not addresses:
            return False
        assert self._compiled is not None
        finding().collide(*addresses, self._flags_of_fields(model, data))
        answer = self.in_turn.execute(self._compiled[1], r.KEEP, r.KEEP)
        self._finish_detection(model, data, answer)
        return True

    def _detection_addresses(self, model: Any, data: Any) -> tuple[int, ...] | None:
        """Return the arguments of the loop that finds contacts, once all is prepared; none without that loop.

        Programs that plan motions detect contacts without any step.
        """
        if self._compiled is None:
            self._compiled = self._look_up(model, data)
        found, timestep = self._compiled[1], self._compiled[0].timestep
        in_turn, own = self.in_turn, self.in_turn.contact_rows
        if self._soft.by_id or self._windows.shows_slots or not found.is_direct:
            return None
        if in_turn.prepared(found, timestep) is None:
            self._prepare(model, data, timestep)
            in_turn.bundle_of(found)
            own.locate(model, data, self._world.axis_lengths())
            if own.last is None and not data.nefc:
                own.note_none()
        elif own.known_addresses(data) is None:
            own.locate(model, data, self._world.axis_lengths())
        return own.known_addresses(data)

    def _finish_detection(self, model: Any, data: Any, answer: int) -> None:
        """Add points and move contacts to the surfaces, once contacts are found and their points kept."""
        assert self._compiled is not None
        found = self._compiled[1]
        if self.in_turn.go_on(answer, found, r.KEEP, r.KEEP, 0, r.OF_NONE) == r.POINTS_ARE_NEW:
            self.manifolds.add(model, data, found)
        if found.counts_now()[0]:
            self.surfaces.shift_contacts(model, data, found)

    def detection(self, model: Any, data: Any) -> Detection | None:
        """Return what `detect` does as compiled calls; None where there are others, or fields or windows."""
        addresses = self._detection_addresses(model, data)
        if not addresses or model.nhfield or self._windows.is_active or not self._world.hard_contacts:
            return None
        assert self._compiled is not None
        found, in_turn, surfaces, manifolds = self._compiled[1], self.in_turn, self.surfaces, self.manifolds
        margins, _ = surfaces.margins_and_reaches(model, data)
        kept = (
            (self, "_compiled"), (in_turn, "_known"), (in_turn, "_bundle"), (in_turn.contact_rows, "welds"),
            (in_turn.contact_rows, "_addresses"), (surfaces, "_widths"), (manifolds, "_bound"),
            (manifolds, "points"), (manifolds, "_has_old_turns"), (found, "search"), (self._world, "profile"),
            (self.motors, "arrays"),
        )  # fmt: skip
        shifts = surface_shifts()
        return Detection(
            kept=tuple(part for owner, name in kept for part in (owner, name, getattr(owner, name))),
            manifolds=manifolds,
            collide=finding().collide,
            collided=(*addresses, 0),
            execute=order().execute,
            executed=(in_turn.prepared(found, self._compiled[0].timestep), r.KEEP, r.KEEP, 0, r.OF_NONE),
            finish=partial(self._finish_detection, model, data),
            shift=shifts.shift_found,
            shifted=(shifts.FOUND.of(found.contacts), found.search.counts, margins),
        )

    def _look_up(self, model: Any, data: Any) -> tuple[Any, ...]:
        largest = self._world.profile.largest_velocity
        limits = None if largest is None else self._gather_limits(model, largest)
        self.in_turn.bound_velocities(limits)
        made = self._world.of_arrays
        found = made.get(_ROWS)
        if found is None or not found.is_direct:
            found = made[_ROWS] = StepRows(data, model.nv, is_sparse=bool(mujoco.mj_isSparse(model)))
        else:
            found.counts_now()
        self.forces.found = found
        return model.opt, found, data.qvel, data.qacc, limits, model.nu > 0, model.nhfield > 0

    def _gather_limits(self, model: Any, usual: float) -> np.ndarray:
        limits = np.full(model.nv, usual)
        for body_id, largest in self._velocity_limits.items():
            for joint in self._world.body_by_id[body_id].joints:
                limits[joint.dof_slice] = largest
        return limits
