"""A simulation: bodies that are added, removed and stepped, with all rules of a time step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from math import isfinite
from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._lazy import lazy_pattern
from roboyard._mujoco import mujoco
from roboyard.description.model import Mesh, RobotDescription
from roboyard.errors import ModelError, RoboyardError, StaleHandleError
from roboyard.sim.actuation.drives import Drives
from roboyard.sim.actuation.velocity_motors import VelocityMotors
from roboyard.sim.appearance.render_shapes import RenderShapes
from roboyard.sim.body import Body
from roboyard.sim.build.bodies import build
from roboyard.sim.build.planned import PlannedBody, note_sound, plan
from roboyard.sim.build.records import BuildOptions, Built
from roboyard.sim.build.solver_options import Solver
from roboyard.sim.constraints.constraints import Constraints
from roboyard.sim.engine import Engine
from roboyard.sim.physics_profile import PhysicsProfile
from roboyard.sim.soft.soft_bodies import SoftBodies
from roboyard.sim.stepping.collision_filters import CollisionFilters
from roboyard.sim.stepping.sequential.direct_step import DirectStep
from roboyard.sim.stepping.solver_warning import solver_warning
from roboyard.sim.stepping.surfaces import Surfaces
from roboyard.sim.stepping.time_steps import Stepping
from roboyard.sim.stepping.triangle_windows import TriangleWindows
from roboyard.sim.stepping.wrenches import Wrenches
from roboyard.transforms import Array, normalized

_OPTIONS = tuple(field.name for field in fields(BuildOptions))
_UNSTABLE_AT = lazy_pattern(r"at (DOF|\w+) (\d+).*Time = ([-+.\deE]+\d)")
"""Of MuJoCo's warning: the degree of freedom and the time."""


class Simulation(Engine[Body]):
    """An engine with bodies, drives, constraints and the rules of a time step; `World` adds the rest."""

    def __init__(
        self,
        *,
        gravity: Sequence[float],
        timestep: float,
        solver: Solver,
        visual_geoms: bool,
        profile: PhysicsProfile,
    ) -> None:
        super().__init__(gravity=gravity, timestep=timestep, solver=solver, profile=profile)
        self._drives = Drives(self)
        self._surfaces = Surfaces(self)
        self._wrenches = Wrenches(self)
        self.motors = VelocityMotors(self)
        """Motors as bounded constraints on the velocity (PyBullet's)."""
        self.constraints = Constraints(self)
        """Welds, points, slides and gears between links."""
        self.soft = SoftBodies(self)
        """Bodies that deform."""
        self._surfaces.soft = self.soft
        self.windows = TriangleWindows(self, self._surfaces, self.soft)
        """Concave meshes of fixed bodies."""
        self.stepping = Stepping(
            self,
            soft=self.soft,
            windows=self.windows,
            surfaces=self._surfaces,
            motors=self.motors,
            constraints=self.constraints,
            wrenches=self._wrenches,
        )
        """Takes the time steps."""
        self.filters = CollisionFilters(self)
        """Which links may touch."""
        self.visual_geoms = visual_geoms
        """Whether MuJoCo has the visual shapes, too."""
        self.before_step: list[Callable[[], None]] = []
        """Functions called before each time step, in order: controllers."""
        self.after_step: list[Callable[[], None]] = []
        """Functions called at the end of `step`: viewers and recorders."""
        self._stepped = -1
        """The revision that has been stepped."""
        self._next_id = 0
        self._names: set[str] = set()
        self._options: dict[tuple[Any, ...], BuildOptions] = {}
        """How bodies were built so far."""
        self._copies: dict[str, int] = {}
        """By requested name: the largest number up to which all numbered names are taken."""
        self.render_shapes = RenderShapes(self)
        """Visual shapes for cameras."""

    @property
    def drives(self) -> Drives:
        """The drives of joints."""
        return self._drives

    @property
    def surfaces(self) -> Surfaces:
        """Restitution and drag of links."""
        return self._surfaces

    @property
    def wrenches(self) -> Wrenches:
        """External forces on links."""
        return self._wrenches

    def flex_owners(self) -> dict[int, int]:
        """Return the body id of each row of MuJoCo's flexes."""
        return self.soft.owner_of_flex()

    @property
    def has_soft_bodies(self) -> bool:
        """Whether any body is soft."""
        return bool(self.soft.by_id)

    def soft_surfaces(self) -> Sequence[tuple[int, Array, np.ndarray]]:
        """Return body id, (n, 3) nodes (m) and (m, 3) surface triangles of each soft body."""
        return [(soft.body.id, soft.positions, soft.surface) for soft in self.soft.by_id.values()]

    def refresh_stepping(self) -> None:
        """Note that a rule of the time step was added, changed or removed."""
        self.stepping.refresh()

    def contact_forces(self) -> Array:
        """Return (ncon, 3) forces (N) of the last step's contacts along the axes of their frames."""
        return self.stepping.forces.contact_forces(self._model, self._data)

    def find_reactions(self) -> None:
        """Compute MuJoCo's `cacc`, `cfrc_ext` and `cfrc_int` of the last step."""
        self.stepping.forces.find_reactions(self._model, self._data)

    def _parts_in_cycles(self) -> Sequence[object]:
        return (self.motors,)

    def rows_changed(self, body: Body, *, is_there: bool) -> None:
        """Note that rows of MuJoCo's arrays, which stay, became a body's or are no longer one's."""
        self.stepping.change(body, is_there=is_there)

    def bodies_changed(self) -> None:
        """Note that bodies came or went in any other way."""
        self.stepping.note_bodies()

    def constraints_changed(self) -> None:
        """Note that a constraint came, went or has another bound or axis, without a compile."""
        self.stepping.note_constraints()

    def _complete_spec(self) -> None:
        self.constraints.complete_spec()
        self.filters.complete_spec()
        self.filters.complete_masks()

    def _extra_key(self) -> Any:
        held = self.constraints.key()
        return None if held is None or self.soft.by_id else (self.filters.key(), held)

    def _extra_elements(self) -> Any:
        return self.filters.elements(), self.constraints.elements()

    def _take_extra_elements(self, elements: Any) -> None:
        excluded, held = elements
        self.filters.take(excluded)
        self.constraints.take(held)

    def _leave_extra_elements(self) -> None:
        self.filters.leave()
        self.constraints.leave()

    def _delete_inactive_rows(self) -> None:
        self.constraints.delete_inactive()
        self.filters.complete_spec()

    def restore_active(self, active: np.ndarray, since: int) -> None:
        """Correct (neq,) which constraints were active by those that came or went; see `Constraints`."""
        self.constraints.restore_active(active, since)

    @property
    def next_constraint(self) -> int:
        """The id that the next constraint gets."""
        return self.constraints.next_id

    def _before_compile(self) -> None:
        self.constraints.enter_new()
        self.filters.write()

    def _after_compile(self) -> None:
        for part in (self._surfaces, self.motors, self.constraints, self.stepping, self.render_shapes):
            part.invalidate()
        self.filters.write_groups()
        self.soft.invalidate()
        self.windows.invalidate()
        self.stepping.refresh()

    # --------------------------------------------------------------------------------------------- bodies

    @property
    def bodies(self) -> tuple[Body, ...]:
        """All bodies, in the order they were added."""
        return tuple(self.body_by_id.values())

    def add_description(
        self,
        description: RobotDescription,
        position: ArrayLike = (0, 0, 0),
        orientation: ArrayLike = (0, 0, 0, 1),
        *,
        fixed_base: bool = False,
        scale: float = 1.0,
        self_collision: bool = True,
        name: str | None = None,
        drives: bool = True,
        joint_damping: bool = True,
        joint_friction: bool = True,
        keep_link_order: bool = False,
    ) -> Body:
        """Add a body from a description; `add_urdf`, `add_box` and their siblings call this.

        Args:
            description: the robot or object.
            position: (3,) of the root link's frame in the world frame (m).
            orientation: (4,) quaternion x, y, z, w of the root link's frame.
            fixed_base: whether the root link is fixed to the world.
            scale: uniform factor on all lengths; masses grow with its cube.
            self_collision: whether links of this body may touch one another.
            name: its name in the world, made unique; by default the description's.
            drives: whether joints get drives.
            joint_damping: whether the description's joint damping acts.
            joint_friction: whether the description's joint friction acts.
            keep_link_order: number links as the description lists them, root first, instead of depth first.

        Raises:
            MeshError: a mesh cannot be read.
            RoboyardError: the position is not finite.
        """
        place = np.asarray(position, dtype=float)
        if not all(map(isfinite, place.ravel().tolist())):
            raise RoboyardError(f"position must be finite, got {place.tolist()}")
        unique = self._unique_name(name or description.name or "body")
        contype, conaffinity = self.filters.masks(description, self_collision)
        profile = self.profile
        searches_meshes = _has_concave(description) and self.windows.may_search()
        given: tuple[Any, ...] = (
            *(fixed_base, keep_link_order, scale, self.visual_geoms, drives and profile.pid_drives),
            *(joint_friction and profile.joint_friction, joint_damping, profile.hard_contacts),
            *(profile.hull_steps, searches_meshes, contype, conaffinity),
        )
        options = self._options.get(given)
        if options is None:
            options = self._options[given] = BuildOptions(**dict(zip(_OPTIONS, given, strict=True)))
        prefix, xyz, quaternion = f"{unique}/", place, normalized(orientation)
        taken = self.pool.acquire(description, prefix, xyz, quaternion, options)
        form = taken or plan(description, prefix, xyz, quaternion, options)
        if form is None:
            form = build(self.raw_spec, self.assets, description, prefix, xyz, quaternion, options)
            note_sound(description, options)
        if taken is None:
            self.mark_stale(grows=True)  # while all bodies of this world have rows
            self.stepping.note_bodies()
        body = self._register(unique, form, description, fixed_base=fixed_base, scale=scale)
        if taken is None:
            if isinstance(form, PlannedBody):
                self.add_planned(body)
            self.pool.note_added(body, options)
        else:
            self.pool.activate(body)
            self.adopt(body)
        for link, record in zip(body.links, form.links, strict=True):
            contact = record.link.contact if record.link is not None else None
            if contact is not None and contact.restitution:
                link.restitution = float(np.clip(contact.restitution, 0.0, 1.0))
        return body

    def register(
        self,
        name: str,
        form: Built | PlannedBody,
        description: RobotDescription | None,
        *,
        fixed_base: bool,
        scale: float = 1.0,
    ) -> Body:
        """Make a body of freshly built elements, or of a plan; the caller marks the world stale.

        Args:
            name: unique in this world.
            form: the elements in the spec, or the plan of them.
            description: None for a body of an MJCF file.
            fixed_base: whether the root is fixed to the world.
            scale: of the description's lengths.
        """
        self.stepping.note_bodies()
        return self._register(name, form, description, fixed_base=fixed_base, scale=scale)

    def _register(
        self,
        name: str,
        form: Built | PlannedBody,
        description: RobotDescription | None,
        *,
        fixed_base: bool,
        scale: float,
    ) -> Body:
        body = Body(self, self._next_id, name, form, description, fixed_base=fixed_base, scale=scale)
        self._next_id += 1
        self.body_by_id[body.id] = body
        self._names.add(name)
        self.filters.assign_masks(body)
        self.render_shapes.add(body)
        return body

    def reserve_name(self, name: str) -> str:
        """Return a name that no body has, `name` itself or with a number, and keep it from later bodies."""
        unique = self._unique_name(name)
        self._names.add(unique)
        return unique

    def _unique_name(self, wanted: str) -> str:
        name, k = wanted, self._copies.get(wanted, 1)
        while name in self._names:
            k += 1
            name = f"{wanted}_{k}"
        self._copies[wanted] = max(1, k - 1)
        return name

    def remove(self, body: Body) -> None:
        """Remove a body; all others keep their state.

        Raises:
            StaleHandleError: the body is not in this world.
        """
        if body.is_removed or self.body_by_id.get(body.id) is not body:
            raise StaleHandleError(f"body {body.name!r} is not in this world")
        self.write_late()  # while its rows are there
        can_stay = self.pool.can_release(body)
        if not (can_stay or self.is_stale) and self.before_edit is not None:
            self.before_edit()
        self.soft.forget(body.id)
        self.constraints.forget(body.id)
        self.filters.forget(body)
        self._surfaces.forget(body.id)
        self.motors.forget(body.id)
        self.stepping.forget(body.id)
        self.render_shapes.forget(body.id)
        del self.body_by_id[body.id]
        self._names.discard(body.name)
        self._copies.clear()
        self.pool.forget(body)
        if self.drop_planned(body):
            self.stepping.note_bodies()
            self.mark_stale(grows=True)
        elif can_stay and not self.is_stale:
            self.pool.release(body)
            self.disown(body)
        else:
            self.stepping.note_bodies()
            self.pool.discard(body.built)
            self.mark_stale()
        body.detach()

    # --------------------------------------------------------------------------------------------- stepping

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
        if pool.is_used and pool.inactive:
            pool.tick(n)
        if self.is_stale:
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


def _has_concave(description: RobotDescription) -> bool:
    """Return whether a description has a concave mesh."""
    return any(
        shape.concave and isinstance(shape.geometry, Mesh)
        for link in description.links
        for shape in link.collisions
    )
