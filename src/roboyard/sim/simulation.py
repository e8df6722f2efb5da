"""A simulation: bodies that are stepped, with all rules of a time step."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from roboyard._lazy import lazy_pattern
from roboyard._mujoco import mujoco
from roboyard.errors import ModelError, RoboyardError
from roboyard.sim.build.solver_options import Solver
from roboyard.sim.physics_profile import PhysicsProfile
from roboyard.sim.simulated_bodies import SimulatedBodies
from roboyard.sim.stepping.sequential.direct_step import DirectStep
from roboyard.sim.stepping.solver_warning import solver_warning

_UNSTABLE_AT = lazy_pattern(r"at (DOF|\w+) (\d+).*Time = ([-+.\deE]+\d)")
"""Of MuJoCo's warning: the degree of freedom and the time."""


class Simulation(SimulatedBodies):
    """Bodies and their time steps; `World` adds the rest."""

    def __init__(
        self,
        *,
        gravity: Sequence[float],
        timestep: float,
        solver: Solver,
        visual_geoms: bool,
        profile: PhysicsProfile,
    ) -> None:
        super().__init__(
            gravity=gravity, timestep=timestep, solver=solver, visual_geoms=visual_geoms, profile=profile
        )
        self.before_step: list[Callable[[], None]] = []
        """Functions called before each time step, in order: controllers."""
        self.after_step: list[Callable[[], None]] = []
        """Functions called at the end of `step`: viewers and recorders."""
        self._stepped = -1
        """The revision that has been stepped."""

    def step(self, n: int = 1) -> None:
        """Advance by n time steps.

        Raises:
            ModelError: the simulation diverged: positions or velocities are not finite; or its contacts need
                more memory than a world may take. The world remains usable.
            RoboyardError: n is negative.
        """
        pool = self.pool
        if n == 1 and not (
            self.revision != self._stepped
            or self.is_stale
            or self._inertia_changed
            or self.windows.is_active
            or self.before_step
            or pool.is_used
        ):
            self._known_step()
            for call in self.after_step:
                call()
            return
        if not n >= 0:
            raise RoboyardError(f"the number of steps must be at least 0, got {n}")
        self.make_ready(n)
        self.step_ready(n)

    def make_ready(self, n: int) -> None:
        """Do what replaces MuJoCo's arrays before n time steps.

        That is to compile what changed, and to delete bodies that were removed long ago.
        """
        if self.pool.is_used and self.pool.inactive:
            self.pool.tick(n)
        self.ensure_compiled()

    def step_ready(self, n: int = 1) -> None:
        """Advance by n of the time steps that `make_ready` was called for; MuJoCo's arrays stay.

        Raises:
            ModelError: as `step` does.
        """
        if self.is_stale:  # the caller has changed something since
            self.ensure_compiled()
        if self.before_step:
            for _ in range(n):
                for call in tuple(self.before_step):
                    call()
                self.ensure_compiled()
                self._advance(1)
        else:
            self._advance(n)
        for call in self.after_step:
            call()

    def _advance(self, n: int) -> None:
        if self._inertia_changed:
            self.sum_inertia()
        if self.windows.shows_slots:
            if n > 1:
                for _ in range(n):
                    self._advance(1)
                return
            self.windows.update()
        if n == 1 and self.revision == self._stepped:
            self._known_step()
            return
        self._go_on(n)

    def _known_step(self) -> None:
        """Advance by one step of bodies that have stepped before."""
        self._take_step(self.stepping.next_step)

    def end_directly(self, answer: int) -> None:
        """Do what `step` does after the compiled loop of `direct_step`, which returned this answer.

        Raises:
            ModelError: as `step` does.
        """
        self._take_step(self.stepping.end_directly, answer)

    def _take_step(self, call: Callable[..., None], *given: int) -> None:
        """Advance by one step through a function of these arguments, model and data."""
        try:
            call(*given, self._model, self._data)
        except mujoco.FatalError as error:  # raised before positions change
            self.recover(error, self.simulation_state())
            self._go_on(1)
            return
        self.is_moved = self._velocity_moved = True
        self.kept_frames = None
        self.heed_warning()

    def direct_step(self) -> DirectStep | None:
        """Return the compiled calls of the last step, which `step` may make again; None for other steps."""
        is_known = self.revision == self._stepped and not (self.is_stale or self._inertia_changed)
        if not is_known or self.windows.is_active or self.pool.is_used or self.before_step or self.after_step:
            return None
        return self.stepping.direct_step(self._model, self._data)

    def heed_warning(self) -> None:
        """Do what a warning of MuJoCo in the last step requires, if there was one.

        Raises:
            ModelError: the simulation diverged.
        """
        if solver_warning.is_raised:
            self._heed_warning()

    def _go_on(self, n: int) -> None:
        done = 0
        while done < n:  # again where MuJoCo's memory was too small and has grown
            done += self._steps(n - done) if self.revision == self._stepped else self._first_step()
        self.is_moved = self._velocity_moved = True
        self.kept_frames = None
        self.heed_warning()

    def _heed_warning(self) -> None:
        """Raise the error of a simulation that diverged; take more memory where contacts were dropped."""
        solver_warning.end()
        if solver_warning.message is not None:
            warning, solver_warning.message = solver_warning.message, None
            for kind in self._data.warning:
                kind.number = 0  # MuJoCo warns of the first time only
            self._data.qacc_warmstart[:] = 0.0  # or the solver goes on from where it was
            raise ModelError(self._divergence(warning))
        if solver_warning.lacks_memory:  # a later step: the next one has more
            solver_warning.lacks_memory = False
            self.recover(None, self.simulation_state())

    def _first_step(self) -> int:
        """Advance by one step after bodies have changed; it is undone where it needed more memory.

        MuJoCo drops contacts for which it has no memory and goes on.

        Returns:
            1, or 0 where memory has grown.
        """
        state = self.simulation_state()
        revision, solver_warning.lacks_memory = self.revision, False
        done = self._steps(1)
        if solver_warning.lacks_memory and done:
            solver_warning.lacks_memory = False
            self.recover(None, state)
            return 0
        self._stepped = revision if done else -1
        return done

    def _steps(self, n: int) -> int:
        """Advance by up to n time steps; fewer where MuJoCo's memory had to grow.

        Returns:
            The number of steps.
        """
        if self.windows.is_outdated and self.windows.shows_slots:  # compiled again, with more memory
            self.windows.update()
        model, data, stepping = self._model, self._data, self.stepping
        step = stepping.plain_step if stepping.is_plain else stepping.step
        done = 0
        try:
            for done in range(n):  # noqa: B007 - counts also where a step fails
                step(model, data)
        except mujoco.FatalError as error:  # raised before positions change
            self.recover(error, self.simulation_state())
            return done
        return n

    def _divergence(self, warning: str) -> str:
        """The message of a diverged simulation, from MuJoCo's warning of the step in which it began."""
        at = _UNSTABLE_AT.search(warning)
        model = self._model
        if at is not None and at[1] == "DOF" and int(at[2]) < model.nv:
            rows = model.dof_bodyid[[int(at[2])]]
        else:
            rows = model.dof_bodyid[np.flatnonzero(~(np.abs(self._data.qvel) < 1e9))[:1]]
        names = [b.name for b in self.body_by_id.values() if np.isin(rows, b.mujoco_ids).any()]
        where = f"body {names[0]!r} has" if names else "the world has"
        time = float(at[3]) if at is not None else self.time
        return (
            f"simulation diverged at {time:.4f} s: {where} non-finite velocities; "
            "check masses, inertias and drive gains, or reduce the time step"
        )
