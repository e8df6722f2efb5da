"""One time step: MuJoCo's own where possible, else in two halves with Roboyard's rules between."""

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
from roboyard.sim.stepping.joint_stops import ATTEMPTS, JointStops
from roboyard.sim.stepping.manifolds import Manifolds
from roboyard.sim.stepping.sequential.detection import Detection
from roboyard.sim.stepping.sequential.direct_step import DirectStep
from roboyard.sim.stepping.sequential.last_forces import LastForces
from roboyard.sim.stepping.sequential.motors import SequentialMotors
from roboyard.sim.stepping.sliding import SlidingContacts
from roboyard.sim.stepping.step_rows import StepRows
from roboyard.sim.stepping.surfaces import Surfaces
from roboyard.sim.stepping.triangle_windows import TriangleWindows
from roboyard.sim.stepping.wrenches import Wrenches

kernels = lazy_module("roboyard.sim.stepping.kernels")
field_contacts = lazy_module("roboyard.sim.stepping.narrow_phase.field_contacts")
finding = lazy_module("roboyard.sim.stepping.impulses.finding")
surface_shifts = lazy_module("roboyard.sim.stepping.narrow_phase.surface_shifts")
slide_kernels = lazy_module("roboyard.sim.stepping.sequential.slide_kernels")
order = lazy_loop("roboyard.sim.stepping.impulses.order", "execute")

_ROWS = "rows of a step"
"""Name in `Engine.of_arrays`."""


class Stepping:
    """Executes the time steps of one world; call `refresh` whenever a rule is added or removed."""

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

    def next_step(self, model: Any, data: Any) -> None:
        """Execute one step in the way that this world needs."""
        if self._is_direct and self._direct_step(model, data):
            if self._has_drag or self.wrenches.pending:
                self._clear_forces()
        elif self.is_plain:
            self.plain_step(model, data)
        else:
            self.step(model, data)

    def _clear_forces(self) -> None:
        drag, self._has_drag = self._has_drag, False
        self.wrenches.clear(drag=drag)

    def plain_step(self, model: Any, data: Any) -> None:
        """Execute one step of a world whose only rules are that sliding does not lift and stops hold."""
        self.in_turn.contact_rows.last = None
        if self._is_implicit:
            self.fast_turns.choose(model, data)
        if not self.stops.is_watching(model, data):
            self._plain_attempt(model, data)
            return
        self.stops.keep(data, forces=False)
        self._plain_attempt(model, data)
        if self.stops.passed():
            self._repeat(model, data, self._plain_attempt)

    def _repeat(self, model: Any, data: Any, attempt: Callable[..., None]) -> None:
        """Execute a step again with the stops in sight through which it carried joints."""
        for _ in range(ATTEMPTS):
            self.stops.go_back(model, data)
            attempt(model, data, stops=True)
            if not self.stops.passed():
                break
        else:
            self.stops.arrest(model, data)
        self.stops.release(model)

    def _plain_attempt(self, model: Any, data: Any, *, stops: bool = False) -> None:
        if not stops and not self.sliding.may_slide():
            mujoco.mj_step(model, data)
            return
        mujoco.mj_step1(model, data)
        if stops:
            self.stops.approach(data, model.opt.timestep)
        if self.sliding.slides(data):
            if self._compiled is None:
                self._compiled = self._look_up(model, data)
            found = self._compiled[1]
            self._solve(model, data, found, model.opt.timestep, slides=True, alone=False)
        else:
            mujoco.mj_step2(model, data)

    def step(self, model: Any, data: Any) -> None:
        """Execute one step with all rules."""
        self._is_direct, self.in_turn.contact_rows.last = False, None
        if self._soft.by_id:
            self._step_in_parts(model, data)
        elif self._world.hard_contacts:  # stops are rigid, too
            if self._has_surfaces:
                self._motor_step(model, data)
            else:
                self._attempt(model, data)
        else:
            self._whole_step(model, data)
        if self._has_drag or self.wrenches.pending:
            self._clear_forces()

    def _step_in_parts(self, model: Any, data: Any) -> None:
        """Execute a step in as many parts as the stiffness of soft bodies requires."""
        option = model.opt
        whole = option.timestep
        parts = self._soft.parts(whole)
        kept = (data.xfrc_applied.copy(), data.qfrc_applied.copy()) if self._has_surfaces else None
        option.timestep = whole / parts
        try:
            for part in range(parts):
                if part and kept is not None:  # without this part's drag
                    data.xfrc_applied[:], data.qfrc_applied[:] = kept
                self._whole_step(model, data)
        finally:
            option.timestep = whole

    def _motor_step(self, model: Any, data: Any) -> None:
        """Do what `_attempt` does in a world of rigid contacts and motors."""
        compiled = self._compiled
        if compiled is None:
            compiled = self._compiled = self._look_up(model, data)
        found, in_turn = compiled[1], self.in_turn
        timestep = compiled[0].timestep
        self._prepare(model, data, timestep)
        if self.motors.has_spherical or compiled[5] or not self.manifolds.keeps:
            self._attempt(model, data)
            return
        if self._is_bounded:
            self.constraints.rows.prepare(model)
        slides = self._slides
        own = in_turn.contact_rows
        if self._makes_rows and not slides and found.is_direct and own.serves(model, self.manifolds):
            if self._solve_contacts(model, data, found):
                own.last = own.arrays
                mujoco.mj_Euler(model, data)
                self._is_direct = own.makes_joints(model)
                return
            self._makes_rows = False
            self._solve_rows(model, data, found, r.OTHERS, remade=True)
            return
        self._collide(self._first_half(), model, data)
        answer = in_turn.execute(found, r.KEEP, r.KEEP if slides else r.SOLVE)
        if answer == r.POINTS_ARE_NEW:
            self.manifolds.add(model, data, found)
        remade = answer in (r.POINTS_ARE_NEW, r.ROWS_ARE_OLD)
        self._solve_rows(model, data, found, answer, remade=remade)

    def _solve_rows(self, model: Any, data: Any, found: StepRows, answer: int, *, remade: bool) -> None:
        """Execute a step of motors and rigid contacts from MuJoCo's rows on.

        Args:
            model: MjModel.
            data: MjData.
            found: the contacts and rows.
            answer: of the parts of `in_turn.execute` before.
            remade: whether the rows have to be made again.
        """
        in_turn, slides = self.in_turn, self._slides
        if remade:
            mujoco.mj_makeConstraint(model, data)
        if slides:
            self._free_axes(model, data, found)
        if remade or slides:
            answer = in_turn.execute(found, r.ARRANGE, r.SOLVE, remade=int(remade))
        if answer == r.DONE:
            mujoco.mj_Euler(model, data)
            in_turn.contact_rows.last = found.rows if found.is_direct else None
            return
        if remade:
            self._complete_rows(model, data, found)
        timestep = model.opt.timestep
        if found.is_direct:
            self._finish_in_block(model, data, found, timestep)
        else:
            self._finish(model, data, found, timestep, slides=False, alone=False)

    def _free_axes(self, model: Any, data: Any, found: StepRows) -> None:
        """Free slides along their axes, between the halves of a step."""
        if not (found.is_direct and self._world.hard_contacts):
            self.constraints.rows.free_axes(model, data)
            return
        loop, frames = slide_kernels().free_slide, data.site_xmat
        for equality, site, axis in self.constraints.rows.slides():
            loop(found.rows, found.search, frames, equality, site, axis)

    def _direct_step(self, model: Any, data: Any) -> bool:
        """Do what `_motor_step` did in the last step, where only the state and the motors' targets differ.

        Returns:
            Whether it could; else nothing has happened.
        """
        compiled, in_turn = self._compiled, self.in_turn
        if compiled is None or self._soft.by_id or self._has_drag:
            return False
        if not self.manifolds.is_prepared:
            self.manifolds.prepare(model, data)
        timestep, found, own = compiled[0].timestep, compiled[1], in_turn.contact_rows
        bundle, addresses = in_turn.prepared(found, timestep), own.known_addresses(data)
        if bundle is None or not addresses or not self.motors.is_prepared(timestep):
            return False
        finding().find_contacts(*addresses, self._flags)
        answer = order().execute(bundle, r.KEEP, r.SOLVE, 1, r.OF_ALL)
        self._end_directly(answer, model, data)
        return True

    def _end_directly(self, answer: int, model: Any, data: Any) -> None:
        """Execute the rest of a step after the compiled loop, which returned this answer."""
        if answer != r.DONE:
            assert self._compiled is not None
            found, in_turn = self._compiled[1], self.in_turn
            answer = in_turn.go_on(answer, found, r.KEEP, r.SOLVE, 1, r.OF_ALL)
            if not self._solve_new_points(answer, model, data, found):
                self._is_direct = self._makes_rows = False
                in_turn.contact_rows.last = None
                self._solve_rows(model, data, found, r.OTHERS, remade=True)
                return
        mujoco.mj_Euler(model, data)

    def end_directly(self, answer: int, model: Any, data: Any) -> None:
        """Do what `next_step` does after the compiled loop of `direct_step`, which returned this answer."""
        self._end_directly(answer, model, data)
        if self.wrenches.pending:
            self._clear_forces()

    def direct_step(self, model: Any, data: Any) -> DirectStep | None:
        """Return the compiled calls of the last step; None where the next one may need others."""
        compiled, in_turn = self._compiled, self.in_turn
        if not self._is_direct or compiled is None or self._soft.by_id or self._has_drag:
            return None
        found, timestep, own = compiled[1], compiled[0].timestep, in_turn.contact_rows
        bundle, addresses = in_turn.prepared(found, timestep), own.known_addresses(data)
        if bundle is None or not addresses or not self.motors.is_prepared(timestep):
            return None
        return DirectStep(
            kept=(
                (self, "_is_direct"), (self, "_compiled"), (self, "_has_drag"), (self.manifolds, "_bound"),
                (self.manifolds, "points"), (in_turn, "_known"), (in_turn, "_bundle"), (found, "search"),
                (own, "_addresses"), (own, "welds"), (self._world, "profile"), (self.motors, "arrays"),
                (self.motors, "_gathered"), (self.motors, "_bound_timestep"), (self, "_flags"),
            ),
            manifolds=self.manifolds,
            find=finding().find_contacts,
            found=(*addresses, self._flags),
            execute=order().execute,
            executed=(bundle, r.KEEP, r.SOLVE, 1, r.OF_ALL),
            integrate=mujoco.mj_Euler,
        )  # fmt: skip

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

    def _solve_contacts(self, model: Any, data: Any, found: StepRows) -> bool:
        """Execute a step up to the integration without MuJoCo's rows of contacts; return whether it could."""
        in_turn = self.in_turn
        own = in_turn.contact_rows
        if own.makes_joints(model):
            assert self._compiled is not None
            self._flags = self._flags_of_fields(model, data)
            own.find(model, data, self._flags, self._world.axis_lengths())
            answer = in_turn.execute(found, r.KEEP, r.SOLVE, 1, r.OF_ALL)
            return self._solve_new_points(answer, model, data, found)
        others = own.find_with_others(model, data, found, self._collide, self._world.axis_lengths())
        if in_turn.execute(found, r.KEEP, r.KEEP) == r.POINTS_ARE_NEW:
            self.manifolds.add(model, data, found)
        if others:
            own.make_others(model, data)
        if in_turn.execute(found, r.MAKE, r.SOLVE, 1, r.OF_CONTACTS) != r.DONE:
            return False
        if others:
            own.give_forces(found)
        return True

    def _solve_new_points(self, answer: int, model: Any, data: Any, found: StepRows) -> bool:
        """Add points of earlier steps where `in_turn.execute` asks for them; return whether all is solved."""
        if answer == r.POINTS_ARE_NEW:
            self.manifolds.add(model, data, found)
            answer = self.in_turn.execute(found, r.MAKE, r.SOLVE, 1, r.OF_ALL)
        return answer == r.DONE

    def _finish_in_block(self, model: Any, data: Any, found: StepRows, timestep: float) -> None:
        """Do what `_finish` does, with rows in MuJoCo's block and without soft bodies."""
        in_turn = self.in_turn
        mujoco.mj_fwdActuation(model, data)
        in_turn.hand_over(found)
        if self._has_motors:
            self.motors.apply(data, timestep)
        in_turn.solve(found)
        mujoco.mj_fwdConstraint(model, data)
        contacts, _, _, _, rows, _ = found.counts_now()
        if contacts:
            room = self._accelerations
            if len(room) < rows:
                room = self._accelerations = np.zeros(2 * rows)
            acceleration = room[:rows]
            self.surfaces.solve_slides(
                model, data, acceleration, lambda: in_turn.correct_slides(found, acceleration, timestep)
            )
        if self._is_bounded:
            self.constraints.rows.bound_forces(model, data)
        in_turn.write(found, timestep)
        assert self._compiled is not None
        limits = self._compiled[4]
        if limits is not None:
            _bound_velocity(model, data, self._compiled[2], self._compiled[3], timestep, limits)
        mujoco.mj_Euler(model, data)

    def _prepare(self, model: Any, data: Any, timestep: float) -> None:
        """Prepare motors, kept points and the solver of both before a step."""
        self.motors.prepare(model, timestep)
        if self._world.hard_contacts:
            self.manifolds.prepare(model, data)
        self.in_turn.prepare(model, data, timestep)

    def _whole_step(self, model: Any, data: Any) -> None:
        if self._is_implicit:
            self.fast_turns.choose(model, data)
        if self.stops.is_watching(model, data):
            self.stops.keep(data, forces=self._has_surfaces)
            self._attempt(model, data)
            if self.stops.passed():
                self._repeat(model, data, self._attempt)
        else:
            self._attempt(model, data)

    def _attempt(self, model: Any, data: Any, *, stops: bool = False) -> None:
        world = self._world
        compiled = self._compiled
        if compiled is None:
            compiled = self._compiled = self._look_up(model, data)
        option, found = compiled[0], compiled[1]
        timestep = option.timestep
        if self._is_in_turn:
            self._prepare(model, data, timestep)
        elif world.hard_contacts:
            self.manifolds.prepare(model, data)
            self.surfaces.margins_and_reaches(model, data)
        if self._is_bounded:
            self.constraints.rows.prepare(model)
        self._collide(self._first_half(), model, data)
        if self._soft.by_id:
            self._soft.add_forces(model, data)
        if world.hard_contacts:
            self._keep_contacts(model, data, found)
        elif self._is_in_turn:
            found.look()
        if stops:
            self.stops.approach(data, timestep)
        if self._slides:
            self._free_axes(model, data, found)
        alone = self._is_in_turn and self.in_turn.arrange(found)
        if alone and not self._soft.by_id:
            if compiled[5]:
                mujoco.mj_fwdActuation(model, data)
            if self.motors.has_spherical:
                self.motors.apply(data, timestep, alone=True)
            self.in_turn.finish(found)
            self._integrate(model, data)
            return
        slides = not world.hard_contacts and self.sliding.slides(data)
        self._finish(model, data, found, timestep, slides=slides, alone=alone)

    def _finish(
        self, model: Any, data: Any, found: StepRows, timestep: float, *, slides: bool, alone: bool
    ) -> None:
        """Execute the second half of a step, in which MuJoCo's solver has rows to solve, or soft bodies."""
        world = self._world
        if self._has_surfaces:
            self.surfaces.apply(model, data, timestep, alone=alone)
            self._has_drag = True
        if self._has_motors:
            self.motors.apply(data, timestep, alone=alone)
        if slides or world.hard_contacts or self._is_bounded or world.profile.largest_velocity is not None:
            self._solve(model, data, found, timestep, slides=slides, alone=alone)
        else:
            mujoco.mj_step2(model, data)

    def _keep_contacts(self, model: Any, data: Any, found: StepRows) -> None:
        """Find the rows that MuJoCo has made, again where points of earlier steps are added."""
        soft = self._soft
        if not found.look()[0] or (soft.by_id and not soft.has_rigid_contacts):
            self.manifolds.forget()
        elif self._update_points(model, data, found):
            mujoco.mj_makeConstraint(model, data)
            self._complete_rows(model, data, found)
        if self._windows.shows_slots:
            self._windows.correct_contacts(data)

    def _update_points(self, model: Any, data: Any, found: StepRows) -> bool:
        """Move contacts as the rules require and keep points; return whether any was moved or added."""
        margins, reaches = self.surfaces.margins_and_reaches(model, data)
        forms = self.surfaces.forms(model, data)
        moved = len(forms.boxes) > 0 and self.manifolds.move(model, data, found, margins, forms)
        anchors = self.surfaces.anchors
        return self.manifolds.update(model, data, found, margins, reaches, anchors, forms) or moved

    def _complete_rows(self, model: Any, data: Any, found: StepRows) -> None:
        """Make the rest of MuJoCo's arrays of constraints after its rows."""
        mujoco.mj_island(model, data)
        mujoco.mj_projectConstraint(model, data)
        mujoco.mj_referenceConstraint(model, data)
        found.look()

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
            (manifolds, "points"), (found, "search"), (self._world, "profile"), (self.motors, "arrays"),
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

    def _solve(
        self, model: Any, data: Any, found: StepRows, timestep: float, *, slides: bool, alone: bool
    ) -> None:
        """Execute the second half in parts, with the solver repeated where the rules require it.

        `alone`: robots with motors, and what touches them, have all rows.
        """
        if self._compiled is None:
            self._compiled = self._look_up(model, data)
        _, _, qvel, qacc, limits, *_ = self._compiled
        if slides:
            self.sliding.prepare(model, data)
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        if self._is_in_turn:
            self.in_turn.solve(found)
        if not alone:
            self._solve_together(model, data, timestep, slides=slides)
            if self._is_in_turn:
                self.in_turn.write(found, timestep)
        if limits is not None:
            _bound_velocity(model, data, qvel, qacc, timestep, limits)
        if slides:  # as in mj_step2
            mujoco.mj_sensorAcc(model, data)
            mujoco.mj_checkAcc(model, data)
        self._integrate(model, data)

    def _integrate(self, model: Any, data: Any) -> None:
        """Advance positions and velocities by the accelerations."""
        if self._world.profile.integrator == "euler":
            mujoco.mj_Euler(model, data)
        else:
            mujoco.mj_implicit(model, data)

    def _solve_together(self, model: Any, data: Any, timestep: float, *, slides: bool) -> None:
        """Solve all rows at once, again where sliding or bounded constraints require it."""
        mujoco.mj_fwdConstraint(model, data)
        if slides:
            self.sliding.correct(model, data, timestep)
        elif self._world.hard_contacts:
            self.surfaces.correct_sliding(model, data, timestep)
        if self._is_bounded:
            self.constraints.rows.bound_forces(model, data)

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


def _bound_velocity(
    model: Any, data: Any, velocity: np.ndarray, acceleration: np.ndarray, timestep: float, limits: np.ndarray
) -> None:
    kernels().bound_velocity(
        *(velocity, acceleration, timestep, limits),
        *(model.jnt_type, model.jnt_dofadr, model.jnt_qposadr, data.qpos),
    )
