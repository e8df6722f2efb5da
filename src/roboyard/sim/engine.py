"""The engine of a world: one MuJoCo spec, compiled lazily at the next step or query, and its settings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.errors import ModelError, RoboyardError
from roboyard.sim.build.contact_law import set_contact_law, set_law_of_few
from roboyard.sim.build.geoms import add_triangles_for_rays
from roboyard.sim.build.inverse_weights import bound_inverse_weights
from roboyard.sim.build.mesh_assets import MeshAssets, forget_meshes
from roboyard.sim.build.solver_options import (
    Solver,
    apply_options,
    chosen_solver,
    new_spec,
)
from roboyard.sim.discarded_worlds import WORLDS
from roboyard.sim.engine_hooks import BodyT, EngineHooks
from roboyard.sim.frame_updates import CENTRES, KEEP, POSES, SPEEDS, FrameUpdates
from roboyard.sim.physics_profile import PhysicsProfile
from roboyard.sim.pool.body_pool import BodyPool
from roboyard.sim.pool.kept_worlds import (
    Change,
    CompileKey,
    Compiles,
    FormerWorld,
    KeptWorld,
    copy_state,
    keep,
)
from roboyard.sim.pool.lone_bodies import LoneBody
from roboyard.sim.pool.new_bodies import NewBodies
from roboyard.sim.protocols import EngineBody
from roboyard.sim.shape_bounds import shape_bounds
from roboyard.transforms import Array

MEMORY_PER_GEOM = 256 * 1024
"""Bytes of MuJoCo's arena (contacts, constraints) for each collision shape; unused memory costs nothing."""
MEMORY_LEAST, MEMORY_MOST = 64 * 2**20, 2 * 2**30
MEMORY_GROWTH = 4
"""Factor by which the arena grows where a step needs more."""


ALL_MOVED, FORCES_MOVED = 1, 2
_FRAMES = "frames"
"""Name in `Engine.of_arrays`."""
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION
_BOX = int(mujoco.mjtGeom.mjGEOM_BOX)
_SLEEPS = int(mujoco.mjtEnableBit.mjENBL_SLEEP)


class Engine(EngineHooks[BodyT]):
    """Spec, model and data of a world, and which of them are out of date."""

    def __init__(
        self, *, gravity: Sequence[float], timestep: float, solver: Solver, profile: PhysicsProfile
    ) -> None:
        if not 0 < timestep < np.inf:
            raise RoboyardError(f"timestep must be positive and finite, got {timestep}")
        self._made_spec: tuple[Any, MeshAssets] | None = None
        """The spec and its meshes, once there is anything in it."""
        self._planned: list[BodyT] = []
        """Bodies that are not in the spec yet, in the order they were added."""
        self.is_kept = False
        """Whether the world that replaces this one may take over its compiled model."""
        self.compiles = Compiles()
        """All compiles of this world, and of the one that it replaces."""
        self._is_edited = False
        """Whether the spec has changed since the last compile, or has more than planned bodies before it."""
        self.element_edits = 0
        """Number of edits of elements so far, but for those of friction."""
        self._new_bodies: NewBodies[BodyT] = NewBodies()
        self.pool = BodyPool(self)
        self.body_by_id: dict[int, BodyT] = {}
        self.profile = profile
        self.prepared: dict[str, dict[int, Any]] = {}
        """Data of other layers about rows of MuJoCo's arrays, by kind; dropped when these change."""
        self.of_arrays: dict[str, Any] = {}
        """Objects that parts of this world made of MuJoCo's arrays, as long as these are the same."""
        self.revision = 0
        """Grows whenever rows of MuJoCo's arrays change."""
        self.hard_contacts = profile.hard_contacts
        """Whether contacts are solved on the velocity level now (those of a pile never are)."""
        self._gravity = _vector3(gravity)
        self._timestep = float(timestep)
        self._solver: Solver = solver
        self._model: Any = None
        self._data: Any = None
        self.is_stale = True
        """Whether the spec was edited since the last compile."""
        self.edits = 0
        """Number of edits of the spec so far, and of what the arrays of a compile get while it is awaited."""
        self.before_edit: Callable[[], None] | None = None
        """Called before rows of MuJoCo's arrays change, while these still hold the last step."""
        self.is_moved = True
        """Whether positions were written since body frames were computed."""
        self.is_outdated = False
        """Whether a fixed body was moved in the spec alone since the last compile."""
        self._centres_moved = True
        """Whether body frames were computed since what is computed of them."""
        self._velocity_moved: int = ALL_MOVED
        """Which velocities have to be computed: those of bodies and what MuJoCo computes of them, or that."""
        self.keeps_frames = False
        """Whether body frames of the last step are kept in `kept_frames` when they are brought up to date."""
        self.kept_frames: tuple[Array, Array] | None = None
        """(nbody, 3) positions (m) and (nbody, 4) quaternions w, x, y, z before the last position update,
        where MuJoCo's arrays hold later ones."""
        self._inertia_changed = False
        self.long_axes: dict[tuple[int, int], float] = {}
        """Lengths, other than 1, of the axes of joints, by body and joint; see `axis_lengths`."""
        self._lengths: tuple[int, Array] | None = None
        self.late_numbers: dict[Callable[[Array], None], Array] = {}
        """Methods such as `Link.keep_mass` to the numbers that they write into the spec, which lacks them."""
        self.kept_rays: dict[bool, Any] = {}
        """MuJoCo's arrays for rays, by whether they meet visual shapes; dropped when the arrays change."""
        self.kept_poses: tuple[Any, Any, Any, Any, Any] | None = None
        """MuJoCo's arrays of poses in parent frames and of active equalities, model and data; dropped when
        they change."""
        self._reference: Any = None
        """MjData in which MuJoCo computes what depends on masses alone; created when masses change."""
        self._geom_owners: np.ndarray | None = None
        self._memory_least = MEMORY_LEAST
        """Bytes of the arena that this world has needed."""
        self._dofs = self._free_dofs = 0
        """Degrees of freedom of all active bodies in MuJoCo's arrays, and those of their free bases."""
        self._has_joints = False
        self.shows_triangles = False
        """Whether concave meshes get a geom with all their triangles."""
        WORLDS.add(self, _array_bytes)

    @property
    def _spec(self) -> Any:
        return self._spec_and_assets()[0]

    @property
    def assets(self) -> MeshAssets:
        """The meshes of the spec."""
        return self._spec_and_assets()[1]

    def _spec_and_assets(self) -> tuple[Any, MeshAssets]:
        if self._made_spec is None:
            spec = new_spec()
            self._made_spec = spec, MeshAssets(spec, self.profile.hull_steps)
        return self._made_spec

    @property
    def raw_spec(self) -> Any:
        """The spec, inactive bodies included; call `mark_stale` after an edit."""
        self.build_planned()
        self.note_edit()
        return self._spec

    @property
    def spec(self) -> Any:
        """The `mujoco.MjSpec` with the world's bodies only; after an edit call `mark_stale`."""
        self.pool.clear()
        self.show_triangles()
        self.write_late()
        self._complete_spec()
        self._apply_options(self._spec.option)  # a spec that was taken over has those of its compile
        return self.raw_spec

    def note_edit(self, *, of_friction: bool = False) -> None:
        """Note that elements of the spec change, or may: the next world cannot take it over.

        Args:
            of_friction: whether friction coefficients and the dimensions of contacts alone do.
        """
        self._is_edited = True
        self.element_edits += not of_friction

    def build_planned(self) -> None:
        """Add the elements of all planned bodies to the spec."""
        planned, self._planned = self._planned, []
        if not planned:
            return
        self.note_edit()
        spec, assets = self._spec_and_assets()
        for body in planned:
            body.build(spec, assets)

    def add_planned(self, body: BodyT) -> None:
        """Note a body that gets elements with the next compile; the caller marks the world stale."""
        self._planned.append(body)

    def drop_planned(self, body: BodyT) -> bool:
        """Forget a body that is removed, if it is only planned; return whether it is."""
        if body not in self._planned:
            return False
        self._planned.remove(body)
        return True

    @property
    def model(self) -> Any:
        """The compiled `mujoco.MjModel`; a new object after each structural edit."""
        self.note_edit()
        self.pool.clear()
        self._delete_inactive_rows()
        self.show_triangles()
        return self.live_model

    @property
    def data(self) -> Any:
        """The `mujoco.MjData` of `model`; after writing into it call `mark_moved`."""
        self.note_edit()
        self.pool.clear()
        self._delete_inactive_rows()
        self.show_triangles()
        return self.live_data

    @property
    def model_of_bodies(self) -> Any:
        """`model`, but with the rows of inactive constraints."""
        self.note_edit()
        self.pool.clear()
        self.show_triangles()
        return self.live_model

    @property
    def live_model(self) -> Any:
        """The MjModel that is stepped.

        Unlike `model` it may have rows of inactive bodies and constraints, and lack the geoms with all
        triangles of concave meshes.
        """
        if self.is_stale:
            self.ensure_compiled()
        return self._model

    @property
    def live_data(self) -> Any:
        """The MjData of `live_model`."""
        if self.is_stale:
            self.ensure_compiled()
        return self._data

    @property
    def compiled_data(self) -> Any:
        """The MjData of the last compile, also while the next one is awaited, which takes its state over."""
        return self._data

    def show_triangles(self) -> None:
        """Let rays and bounding boxes meet all triangles of concave meshes, from now on."""
        if not self.shows_triangles:
            self.shows_triangles = True
            if any(record.hidden for body in self.body_by_id.values() for record in body.built.links):
                self.mark_stale()

    def mark_stale(self, *, grows: bool = False) -> None:
        """Note an edit of the spec: compile before the next use.

        Args:
            grows: whether the spec itself stays as it is until then: bodies are planned, or filters changed.
        """
        if not grows:
            self.note_edit()
        if not self.is_stale:
            if self.before_edit is not None:
                self.before_edit()
            self.write_late()
        self.is_stale = True
        self.edits += 1
        self.drop_prepared()

    def takes_numbers(self) -> bool:
        """Return whether a number is to be written into MuJoCo's arrays now; else the next compile does so.

        That is then certain: otherwise the removal of a new constraint may avoid it (`forgo_compile`).
        """
        self.edits += self.is_stale
        return not self.is_stale

    def forgo_compile(self, edits: int) -> None:
        """Note that the spec is as it was at the last compile, unless there were more edits than so many."""
        if self.edits == edits and not self.late_numbers:
            self.is_stale = False
            self.drop_prepared()

    def write_late(self) -> None:
        """Write numbers into the spec that it does not have yet."""
        if not self.late_numbers:
            return
        self.edits += self.is_stale
        for write, numbers in self.late_numbers.items():
            write(numbers)
        self.late_numbers.clear()

    def drop_prepared(self) -> None:
        """Drop what other layers have prepared, after arrays were replaced."""
        self.kept_rays.clear()
        self.kept_poses = None
        for known in self.prepared.values():
            if known:
                known.clear()

    def _next_revision(self) -> None:
        self.revision += 1
        self.drop_prepared()

    def mark_inertia_changed(self) -> None:
        """Note that masses or inertias were written: what MuJoCo computes of them is updated when it is next
        needed.
        """
        self._inertia_changed = self.is_moved = self._velocity_moved = True

    def _sum_inertia(self) -> None:
        """Compute masses of trees, contact weights and mean inertia again."""
        self._inertia_changed = False
        if self._reference is None:
            self._reference = mujoco.MjData(self._model)
        mujoco.mj_setConst(self._model, self._reference)
        if self._model.nv:
            self._model.stat.meaninertia = (
                np.add.reduce(self._model.dof_M0) / self._model.nv
            )  # as a compilation
        self.pool.update_inertia()
        bound_inverse_weights(self._model)

    def mark_moved(self) -> None:
        """Note that positions or velocities were written: recompute derived quantities when they are read."""
        self.is_moved = self._velocity_moved = True

    @property
    def is_sleeping(self) -> bool:
        """Whether bodies at rest sleep."""
        return bool(self._model.opt.enableflags & _SLEEPS)

    def mark_fixed_moved(self) -> None:
        """Note that the pose of a fixed body was written. A world with sleeping takes fixed bodies, and what
        hangs on them, for unmoved, so their positions are computed here with sleeping off.
        """
        self.mark_moved()
        option = self._model.opt
        if self.is_sleeping:
            option.enableflags &= ~_SLEEPS
            try:
                mujoco.mj_kinematics(self._model, self._data)
            finally:
                option.enableflags |= _SLEEPS

    def ensure_compiled(self) -> None:
        """Compile if the spec was edited; all remaining bodies keep their state.

        Raises:
            ModelError: MuJoCo rejects the model.
        """
        if not self.is_stale:
            return
        self.write_late()
        forms = [body.form for body in self.body_by_id.values()]
        self._dofs = sum(form.dofs for form in forms)
        self._free_dofs = sum(form.free_dofs for form in forms)
        self._has_joints = any(form.has_joints for form in forms)
        key = self._compile_key() if self.is_kept else None
        compiles = self.compiles
        known = compiles.repeated(key)
        if key is not None and known is not None and known[1] is not None:
            changes = known[1].changes(key, self.pool.template_of)
            if changes is not None:
                self._take_over(known[1], key, changes)
                return
        before = None
        if key is not None and compiles.needs_spec(known):
            before = self._model, self._data
            self._begin_spec(key)
        self.build_planned()
        spec = self._spec
        self._apply_options(spec.option)
        shapes = sum(len(r.geoms) for body in self.body_by_id.values() for r in body.built.links)
        self._before_compile()
        if self.shows_triangles:
            for body in self.body_by_id.values():
                for record in body.built.links:
                    add_triangles_for_rays(record, spec, self.assets)
        shapes += self.pool.prepare(spec) if known is None else self.pool.forgo()
        forget_meshes()
        spec.memory = int(np.clip(shapes * MEMORY_PER_GEOM, self._memory_least, MEMORY_MOST))
        try:
            if self._model is None or before is not None:
                self._model = spec.compile()
                self._data = mujoco.MjData(self._model)
            else:
                self._model, self._data = spec.recompile(self._model, self._data)
        except (ValueError, mujoco.FatalError) as error:
            raise ModelError(f"MuJoCo rejects the world: {' '.join(str(error).split())[:500]}") from error
        self.is_stale = self._inertia_changed = False
        self._reference, self.of_arrays = None, {}
        bound_inverse_weights(self._model)
        self._next_revision()
        self._set_contact_law(self.body_by_id.values())
        self.pool.locate()
        for body in self.body_by_id.values():
            body.refresh(self._model)
        self._is_edited, kept = False, None
        if key is not None and known is not None:  # for the second time
            built = [body.built for body in self.body_by_id.values()]
            extras = self._extra_elements()
            kept = keep(key, spec, self.assets, built, extras, self._model, self._data, self.of_arrays)
        compiles.note(key, kept)
        if before is not None:
            copy_state(*before, self._data)
        self._new_bodies.end(self.body_by_id, self.time)
        self.is_outdated = False
        self._geom_owners = None
        self._after_compile()
        self.mark_moved()

    def lone_body(self, body: BodyT) -> LoneBody | None:
        """Return a new body alone, whose state the next compile takes over; None where that has to be now."""
        if not self.is_stale or not self._new_bodies.avoids_compiles(self.time):
            return None
        if body.mujoco_ids[0] > 0 or any(key == body.id for key, _ in self.long_axes):
            return None  # it has rows, or velocities that MuJoCo does not compute
        return self._new_bodies.of(body)

    @property
    def avoided_compiles(self) -> int:
        """Number of new bodies that were read alone since the last compile."""
        return len(self._new_bodies)

    def _compile_key(self) -> CompileKey | None:
        """Return what a compile is made from; None where the spec has more than planned bodies."""
        pool = self.pool
        if self._is_edited or not self.compiles.are_known or pool.expects_bodies or pool.is_used:
            return None
        found = [body.plan_now() for body in self.body_by_id.values()]
        plans = tuple(plan for plan in found if plan is not None)
        if len(plans) != len(found) or not plans:
            return None
        extra = self._extra_key()
        if extra is None:
            return None
        settings = self._solver, self.profile, self._memory_least, extra
        return CompileKey(bodies=plans, settings=settings)

    def _begin_spec(self, key: CompileKey) -> None:
        """Begin a spec for all bodies; the one before stays as it was compiled."""
        self._made_spec, self._planned = None, list(self.body_by_id.values())
        for body, plan in zip(self._planned, key.bodies, strict=True):
            body.plan_again(plan)
        self._leave_extra_elements()

    def _take_over(self, kept: KeptWorld, key: CompileKey, changes: Sequence[Change]) -> None:
        """Go on with the spec, model and data of the world before, as a compile would leave them."""
        before, former = (self._model, self._data), kept.key
        self._planned = []
        self._made_spec, self._model, self._data = (kept.spec, kept.assets), kept.model, kept.data
        self.of_arrays = kept.of_arrays
        kept.renew(key, changes)
        for body, plan, built in zip(self.body_by_id.values(), key.bodies, kept.built, strict=True):
            body.take_over(plan, built)
        self._take_extra_elements(kept.extras)
        self._apply_options(self._model.opt)
        self.pool.forgo()
        if before[0] is not None:
            copy_state(*before, self._data)
        self.is_stale = self._inertia_changed = False
        self._reference = self._geom_owners = None
        self._next_revision()
        self.hard_contacts = self.profile.hard_contacts and not self._is_pile
        self.pool.locate()
        others = 0
        for body, plan, known in zip(self.body_by_id.values(), key.bodies, former.bodies, strict=True):
            body.refresh(self._model)
            if plan.frictions != known.frictions:
                body.set_frictions(plan)
                others += 1
        if changes or others:
            kept.is_now(key)
        self.compiles.note(kept.key, kept)
        self._new_bodies.end(self.body_by_id, self.time)
        self.is_outdated = False
        self._is_edited = False
        self._after_compile()
        self.mark_moved()

    def retire(self) -> FormerWorld | None:
        """Return what the world that replaces this one may take over, before this one is released."""
        if self._model is None:
            return self.compiles.former
        if self.is_stale or self._is_edited or self.pool.is_used:
            return None
        return self.compiles.of_next()

    def release(self) -> None:
        """Free the world at once; neither it nor its bodies can be used any more.

        Bodies, links, joints and motors refer to each other and to MuJoCo's spec, so that without this their
        memory remains until Python's garbage collector runs.
        """
        parts = [*self.body_by_id.values(), *self._parts_in_cycles()]
        for part in (*parts, self):
            vars(part).clear()

    def simulation_state(self) -> Array:
        """Return MuJoCo's (n,) numbers of the present state: positions to pending forces and warm start."""
        values = np.empty(mujoco.mj_stateSize(self._model, _STATE))
        mujoco.mj_getState(self._model, self._data, values, _STATE)
        return values

    def recover(self, error: Exception | None, values: Array) -> None:
        """Make the world usable after an error within MuJoCo: more memory where that was it, and fresh data.

        Args:
            error: MuJoCo's error; None where it went on without some contacts.
            values: (n,) the state in which the world goes on.

        Raises:
            ModelError: it was no lack of memory, or the world has all that it may take.
        """
        present = int(self._model.narena)
        message = "no memory for contacts" if error is None else " ".join(str(error).split())[:300]
        # what the error left on MuJoCo's stack goes with the old data, which cannot be copied
        self._data, self.of_arrays = mujoco.MjData(self._model), {}
        self.note_edit()
        mujoco.mj_setState(self._model, self._data, values, _STATE)
        grows = "memory" in message and present < MEMORY_MOST
        if grows:
            self._memory_least = min(present * MEMORY_GROWTH, MEMORY_MOST)
            self.is_stale = True
            self.ensure_compiled()
            mujoco.mj_setState(self._model, self._data, values, _STATE)
        else:
            self._next_revision()
            self._after_compile()
        self.mark_moved()
        if not grows and "memory" in message:
            raise ModelError(
                f"the contacts of this step need more than {present / 2**20:.0f} MiB; "
                "move bodies apart that overlap, or remove some"
            ) from None
        if not grows:
            raise ModelError(f"MuJoCo stopped: {message}") from None

    def adopt(self, body: BodyT) -> None:
        """Make rows of the compiled model a new body's."""
        body.refresh(self._model)
        was_pile, had_joints = self._is_pile, self._has_joints
        self._dofs += body.built.dofs
        self._free_dofs += body.built.free_dofs
        self._has_joints |= body.built.has_joints
        is_other = self._is_pile != was_pile
        if is_other or self._has_joints != had_joints:
            self._apply_options(self._model.opt)
            self.pool.update_inertia()
        self._set_contact_law(self.body_by_id.values() if is_other else [body], are_all=is_other)
        if is_other:
            self.bodies_changed()
        self._rows_changed(body, owner=body.id)

    def disown(self, body: BodyT) -> None:
        """Note that a body was removed while its rows remain.

        It must not have been the body that made the world a pile.
        """
        self._dofs -= body.built.dofs
        self._free_dofs -= body.built.free_dofs
        self._rows_changed(body, owner=-1)

    def _rows_changed(self, body: BodyT, *, owner: int) -> None:
        if self._geom_owners is not None:
            for index, record in enumerate(body.built.links):
                rows = [geom.id for geom in (*record.geoms, *record.visuals)]
                self._geom_owners[rows] = (owner, -1 if owner < 0 else index)
        self._next_revision()
        self.mark_moved()
        self.rows_changed(body, is_there=owner >= 0)

    @property
    def _is_pile(self) -> bool:
        return self.would_be_pile(more_dofs=0)

    def would_be_pile(self, *, more_dofs: int) -> bool:
        """Return whether the world is solved as a pile with so many degrees of freedom of free bases more."""
        return chosen_solver(self._solver, self._free_dofs + more_dofs, self.profile) == "cg"

    def _apply_options(self, option: Any) -> None:
        """Write time step, gravity and solver into the options of a spec or an MjModel."""
        apply_options(
            option,
            timestep=self._timestep,
            gravity=self._gravity,
            dofs=self._dofs,
            free_dofs=self._free_dofs,
            has_joints=self._has_joints,
            has_soft_bodies=self.has_soft_bodies,
            solver=self._solver,
            profile=self.profile,
        )

    def _set_contact_law(self, bodies: Iterable[EngineBody], *, are_all: bool = True) -> None:
        """Set how rigid contacts are: by the profile, but soft in a pile.

        Shapes of MJCF files keep their own settings.

        Args:
            bodies: those whose shapes are set.
            are_all: whether these are all bodies of the world.
        """
        profile, is_pile = self.profile, self._is_pile
        self.hard_contacts = profile.hard_contacts and not is_pile
        records = [r for body in bodies for r in body.built.links if r.link is not None]
        write = set_contact_law if are_all else set_law_of_few
        write(self._model, profile, records, is_pile=is_pile)

    def link_frames(self, *, keeps_last: bool) -> Any:
        """Return the MjData with positions of bodies, geoms and sites that agree with qpos.

        Args:
            keeps_last: whether body frames of the last step are kept where the world keeps them at all.
        """
        if self.is_stale:
            self.ensure_compiled()
        return self._frames_so_far(keeps_last=keeps_last)

    def awaited_frames(self) -> Any:
        """Return the MjData of the last compile, whose frames agree with its qpos, while the next is awaited.

        None where a fixed body was moved meanwhile.
        """
        if not self.is_stale or self._model is None or self.is_outdated:
            return None
        self.kept_frames = None
        return self._frames_so_far(keeps_last=False)

    def _frames_so_far(self, *, keeps_last: bool) -> Any:
        if self.is_moved:
            self._update_frames(keeps_last=keeps_last)
        return self._data

    def kinematics(self) -> Any:
        """Return the MjData with positions (xpos, xipos, geom_xpos, ...) that agree with qpos.

        So do centres of mass of trees and axes of motion.
        """
        if self.is_stale:
            self.ensure_compiled()
        if self.is_moved or self._centres_moved:
            self._update_frames(centres=True)
        return self._data

    def link_velocities(self) -> Any:
        """Return the MjData with positions and body velocities (cvel) that agree with qpos and qvel."""
        if self.is_stale:
            self.ensure_compiled()
        if self.is_moved or self._centres_moved or self._velocity_moved == ALL_MOVED:
            self._update_frames(centres=True, speeds=True)
        return self._data

    def axis_lengths(self) -> Array | None:
        """Return the (nv,) lengths of the axes of degrees of freedom; None where all are 1.

        An impulse engine that takes axes as files give them turns a joint by its velocity, and counts it so
        many times larger where it computes velocities of links and forces.
        """
        if not self.long_axes:
            return None
        if self._lengths is None or self._lengths[0] != self.revision:
            lengths, bodies = np.ones(self._model.nv), self.body_by_id
            for (key, joint), length in self.long_axes.items():
                if key in bodies:
                    lengths[bodies[key].dofs_of(joint)] = length
            self._lengths = self.revision, lengths
        return self._lengths[1]

    def velocities(self) -> Any:
        """Return the MjData with `link_velocities`, and what MuJoCo computes of these."""
        data = self.kinematics()
        if self._velocity_moved:
            mujoco.mj_fwdVelocity(self._model, data)
            self._velocity_moved = 0
        return data

    @property
    def frame_updates(self) -> FrameUpdates:
        """Updates of the arrays of a compiled world."""
        updates: FrameUpdates | None = self.of_arrays.get(_FRAMES)
        if updates is None:
            updates = self.of_arrays[_FRAMES] = FrameUpdates(self._model, self._data)
        return updates

    def _update_frames(self, *, keeps_last: bool = True, centres: bool = False, speeds: bool = False) -> None:
        """Compute what has moved of positions, and on request of centres of mass and velocities of bodies."""
        updates = self.frame_updates
        parts = 0
        if self.is_moved:
            parts = POSES
            if keeps_last and self.keeps_frames and self.kept_frames is None:
                parts |= KEEP
                self.kept_frames = updates.kept
            self.is_moved, self._centres_moved = False, True
        if centres and self._centres_moved:
            if self._inertia_changed:
                self._sum_inertia()
            parts |= CENTRES
            self._centres_moved = False
        if speeds and self._velocity_moved == ALL_MOVED:
            parts |= SPEEDS
            self._velocity_moved = FORCES_MOVED
        lengths = self.axis_lengths()
        if lengths is not None and parts & CENTRES:
            updates.update(parts & ~SPEEDS)
            self._data.cdof *= lengths[:, None]
            parts &= SPEEDS
        updates.update(parts)

    def object_velocity(self, row: int, *, at_inertial: bool) -> tuple[Array, Array]:
        """Return linear (3,) (m/s) and angular (3,) (rad/s) velocity of a MuJoCo body in the world frame.

        Args:
            row: of the body.
            at_inertial: take the linear velocity at the centre of mass instead of at the body frame's origin.
        """
        data = self.velocities()
        kind = mujoco.mjtObj.mjOBJ_BODY if at_inertial else mujoco.mjtObj.mjOBJ_XBODY
        out = np.empty(6)
        mujoco.mj_objectVelocity(self._model, data, kind, row, out, 0)
        return out[3:], out[:3]

    def bounds_of(self, mujoco_ids: np.ndarray) -> Array:
        """Return the (2, 3) bounding box of all shapes of some MuJoCo bodies, in the world frame (m).

        Args:
            mujoco_ids: (k,) rows of bodies.
        """
        self.show_triangles()
        data = self.kinematics()
        return shape_bounds(self._model, data, mujoco_ids)

    @property
    def geom_owners(self) -> np.ndarray:
        """(ngeom, 2) int32: body id and link index of each MuJoCo geom; -1 for geoms of inactive bodies."""
        self.ensure_compiled()
        if self._geom_owners is None:
            by_row = np.full((self._model.nbody, 2), -1, dtype=np.int32)
            for body in self.body_by_id.values():
                by_row[body.mujoco_ids, 0] = body.id
                by_row[body.mujoco_ids, 1] = np.arange(len(body.built.links))
            self._geom_owners = by_row[self._model.geom_bodyid]
            for body in self.body_by_id.values():
                if body.built.is_ground:
                    self._geom_owners[[geom.id for geom in body.built.links[0].geoms]] = (body.id, 0)
        return self._geom_owners

    # --------------------------------------------------------------------------------------------- settings

    @property
    def gravity(self) -> Array:
        """Gravity (3,) in the world frame (m/s²)."""
        return np.array(self._gravity)

    @gravity.setter
    def gravity(self, value: Sequence[float]) -> None:
        self._gravity = _vector3(value)
        if self.takes_numbers():
            self._model.opt.gravity[:] = self._gravity

    @property
    def timestep(self) -> float:
        """Time step (s)."""
        return self._timestep

    @timestep.setter
    def timestep(self, value: float) -> None:
        if not 0 < value < np.inf:
            raise RoboyardError(f"timestep must be positive and finite, got {value}")
        self._timestep = float(value)
        if self.takes_numbers():
            self._model.opt.timestep = self._timestep

    @property
    def solver(self) -> str:
        """The solver of contacts now: "newton" or "cg"."""
        free_dofs = sum(b.form.free_dofs for b in self.body_by_id.values())
        return chosen_solver(self._solver, free_dofs, self.profile)

    @solver.setter
    def solver(self, value: Solver) -> None:
        self._solver = value
        self.mark_stale(grows=True)

    @property
    def time(self) -> float:
        """Simulated time (s)."""
        return 0.0 if self._data is None else float(self._data.time)


def _vector3(value: Sequence[float]) -> tuple[float, float, float]:
    numbers = [float(v) for v in value]
    if len(numbers) != 3 or not np.isfinite(numbers).all():
        raise RoboyardError(f"gravity must be three finite numbers, got {tuple(value)}")
    return numbers[0], numbers[1], numbers[2]


def _array_bytes(world: Any) -> int:
    """Return the bytes of MuJoCo's arrays of a world, with the part of the arena that it has used."""
    there = vars(world)  # empty once the world is released
    model, data = there.get("_model"), there.get("_data")
    if model is None or data is None:
        return 0
    return int(model.nbuffer + data.nbuffer + data.maxuse_arena)
