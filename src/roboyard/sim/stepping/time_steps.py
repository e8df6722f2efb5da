"""One time step: MuJoCo's own where possible, else in two halves with Roboyard's rules between."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard.native import lazy_loop
from roboyard.sim.stepping.impulses import records as r
from roboyard.sim.stepping.joint_stops import ATTEMPTS
from roboyard.sim.stepping.sequential.direct_step import DirectStep
from roboyard.sim.stepping.sequential.step_parts import StepParts
from roboyard.sim.stepping.step_rows import StepRows

kernels = lazy_module("roboyard.sim.stepping.kernels")
finding = lazy_module("roboyard.sim.stepping.impulses.finding")
slide_kernels = lazy_module("roboyard.sim.stepping.sequential.slide_kernels")
order = lazy_loop("roboyard.sim.stepping.impulses.order", "execute")


class Stepping(StepParts):
    """Executes the time steps of one world."""

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
                self._soft.whole_step = 0.0 if part else whole
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
                (self.manifolds, "_has_old_turns"),
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

    def _complete_rows(self, model: Any, data: Any, found: StepRows) -> None:
        """Make the rest of MuJoCo's arrays of constraints after its rows."""
        mujoco.mj_island(model, data)
        mujoco.mj_projectConstraint(model, data)
        mujoco.mj_referenceConstraint(model, data)
        found.look()

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
        if self._soft.by_id:
            self._soft.change_accelerations(model, data)
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


def _bound_velocity(
    model: Any, data: Any, velocity: np.ndarray, acceleration: np.ndarray, timestep: float, limits: np.ndarray
) -> None:
    kernels().bound_velocity(
        *(velocity, acceleration, timestep, limits),
        *(model.jnt_type, model.jnt_dofadr, model.jnt_qposadr, data.qpos, model.dof_bodyid, model.body_ipos),
        data.xmat,
    )
