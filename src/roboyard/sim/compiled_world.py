"""Compiles of a world's spec, lazily at the next step or query, or what takes their place."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.errors import ModelError
from roboyard.sim.build.contact_law import set_contact_law, set_law_of_few
from roboyard.sim.build.geoms import add_triangles_for_rays
from roboyard.sim.build.inertia_sums import InertiaSums
from roboyard.sim.build.inverse_weights import bound_inverse_weights
from roboyard.sim.build.mesh_assets import forget_meshes
from roboyard.sim.build.records import windows_of
from roboyard.sim.build.solver_options import Solver, total_inertia
from roboyard.sim.discarded_worlds import WORLDS
from roboyard.sim.engine_hooks import BodyT
from roboyard.sim.physics_profile import PhysicsProfile
from roboyard.sim.pool.body_pool import BodyPool
from roboyard.sim.pool.former_arrays import FormerArrays
from roboyard.sim.pool.kept_worlds import (
    MOST_BYTES,
    Changes,
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
from roboyard.sim.world_spec import WorldSpec
from roboyard.transforms import Array

MEMORY_PER_GEOM = 256 * 1024
"""Bytes of MuJoCo's arena (contacts, constraints) for each collision shape; unused memory costs nothing."""
MEMORY_LEAST, MEMORY_MOST = 64 * 2**20, 2 * 2**30
MEMORY_GROWTH = 4
"""Factor by which the arena grows where a step needs more."""
ALL_MOVED, FORCES_MOVED = 1, 2
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class CompiledWorld(WorldSpec[BodyT]):
    """A spec that is compiled when model or data are needed, and which of their numbers are out of date."""

    def __init__(
        self, *, gravity: Sequence[float], timestep: float, solver: Solver, profile: PhysicsProfile
    ) -> None:
        super().__init__(gravity=gravity, timestep=timestep, solver=solver, profile=profile)
        self.is_kept = False
        """Whether the world that replaces this one may take over its compiled model."""
        self.compiles = Compiles()
        """All compiles of this world, and of the one that it replaces."""
        self._new_bodies: NewBodies[BodyT] = NewBodies()
        self.pool = BodyPool(self)
        self.of_arrays: dict[str, Any] = {}
        """Objects that parts of this world made of MuJoCo's arrays, as long as these are the same."""
        self.hard_contacts = profile.hard_contacts
        """Whether contacts are solved on the velocity level now (those of a pile never are)."""
        self.is_moved = True
        """Whether positions were written since body frames were computed."""
        self.is_outdated = False
        """Whether a fixed body was moved in the spec alone since the last compile."""
        self._velocity_moved: int = ALL_MOVED
        """Which velocities have to be computed: those of bodies and what MuJoCo computes of them, or that."""
        self._inertia_changed = False
        self.long_axes: dict[tuple[int, int], float] = {}
        """Lengths, other than 1, of the axes of joints, by body and joint; see `Engine.axis_lengths`."""
        self._inertia_sums = InertiaSums()
        self._reference: Any = None
        """MjData in which MuJoCo computes what depends on masses alone; created when masses change."""
        self._geom_owners: np.ndarray | None = None
        self._memory_least = MEMORY_LEAST
        """Bytes of the arena that this world has needed."""
        WORLDS.add(self, _array_bytes)

    def mark_inertia_changed(self) -> None:
        """Note that masses or inertias were written: what MuJoCo computes of them is updated when it is next
        needed.
        """
        self._inertia_changed = self.is_moved = self._velocity_moved = True

    def sum_inertia(self) -> None:
        """Compute masses of trees, contact weights and mean inertia again."""
        self._inertia_changed = False
        if not self._inertia_sums.update(self._model, self.revision):
            if self._reference is None:
                self._reference = mujoco.MjData(self._model)
            mujoco.mj_setConst(self._model, self._reference)
            self._inertia_sums.note(self._model, self.revision)
        if self._model.nv:
            self._model.stat.meaninertia = total_inertia(self._model.dof_M0) / self._model.nv or 1.0
        self.pool.update_inertia()
        bound_inverse_weights(self._model)

    def mark_moved(self) -> None:
        """Note that positions or velocities were written: recompute derived quantities when they are read."""
        self.is_moved = self._velocity_moved = True

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
        arrays = compiles.take_arrays()
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
            if self._model is None and known is None and arrays is not None:
                self._compile_into(arrays)
            elif self._model is None or before is not None:
                self._model = spec.compile()
                self._data, self.of_arrays = mujoco.MjData(self._model), {}
            else:
                self._model, self._data = spec.recompile(self._model, self._data)
                self.of_arrays = {}
        except (ValueError, mujoco.FatalError) as error:
            raise ModelError(f"MuJoCo rejects the world: {' '.join(str(error).split())[:500]}") from error
        self.is_stale = self._inertia_changed = False
        self._reference = None
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

    def _compile_into(self, arrays: FormerArrays) -> None:
        """Compile for the first time, into the arrays of the world before where only numbers differ."""
        model = self._spec.compile()
        if not windows_of(self.body_by_id.values()) and arrays.take(model):
            self._model, self._data, self.of_arrays = arrays.model, arrays.data, arrays.of_arrays
        else:
            self._model, self._data, self.of_arrays = model, mujoco.MjData(model), {}

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

    def _take_over(self, kept: KeptWorld, key: CompileKey, changes: Changes) -> None:
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
        bodies = list(self.body_by_id.values())
        if kept.rows is None:
            for body in bodies:
                body.refresh(self._model)
            kept.rows = [body.rows() for body in bodies]
        else:
            for body, rows in zip(bodies, kept.rows, strict=True):
                body.take_rows(rows)
        for body, plan, known in zip(bodies, key.bodies, former.bodies, strict=True):
            if plan.frictions != known.frictions:
                body.set_frictions(plan)
                others += 1
        if any(changes) or others:
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
        arrays = FormerArrays(self._model, self._data, self.of_arrays)
        former = self.compiles.of_next(arrays)
        if windows_of(self.body_by_id.values()) or _array_bytes(self) > MOST_BYTES:
            former.arrays = None
        return former

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


def _array_bytes(world: Any) -> int:
    """Return the bytes of MuJoCo's arrays of a world, with the part of the arena that it has used."""
    there = vars(world)  # empty once the world is released
    model, data = there.get("_model"), there.get("_data")
    if model is None or data is None:
        return 0
    return int(model.nbuffer + data.nbuffer + data.maxuse_arena)
