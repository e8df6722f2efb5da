"""The spec of a world: its elements, the edits that the next compile takes, and its settings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.sim.build.mesh_assets import MeshAssets
from roboyard.sim.build.solver_options import (
    Solver,
    apply_options,
    chosen_solver,
    new_spec,
)
from roboyard.sim.engine_hooks import BodyT, EngineHooks
from roboyard.sim.physics_profile import PhysicsProfile
from roboyard.sim.pool.body_pool import BodyPool
from roboyard.transforms import Array


class WorldSpec(EngineHooks[BodyT]):
    """The spec, and the model and data of its last compile."""

    pool: BodyPool
    """Inactive bodies in the spec."""

    def __init__(
        self, *, gravity: Sequence[float], timestep: float, solver: Solver, profile: PhysicsProfile
    ) -> None:
        if not 0 < timestep < np.inf:
            raise RoboyardError(f"timestep must be positive and finite, got {timestep}")
        self._made_spec: tuple[Any, MeshAssets] | None = None
        """The spec and its meshes, once there is anything in it."""
        self._planned: list[BodyT] = []
        """Bodies that are not in the spec yet, in the order they were added."""
        self._is_edited = False
        """Whether the spec has changed since the last compile, or has more than planned bodies before it."""
        self.element_edits = 0
        """Number of edits of elements so far, but for those of friction."""
        self.body_by_id: dict[int, BodyT] = {}
        self.profile = profile
        self.prepared: dict[str, dict[int, Any]] = {}
        """Data of other layers about rows of MuJoCo's arrays, by kind; dropped when these change."""
        self.revision = 0
        """Grows whenever rows of MuJoCo's arrays change."""
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
        self.late_numbers: dict[Callable[[Array], None], Array] = {}
        """Methods such as `Link.keep_mass` to the numbers that they write into the spec, which lacks them."""
        self.kept_rays: dict[bool, Any] = {}
        """MuJoCo's arrays for rays, by whether they meet visual shapes; dropped when the arrays change."""
        self.kept_poses: tuple[Any, Any, Any, Any, Any] | None = None
        """MuJoCo's arrays of poses in parent frames and of active equalities, model and data; dropped when
        they change."""
        self._dofs = self._free_dofs = 0
        """Degrees of freedom of all active bodies in MuJoCo's arrays, and those of their free bases."""
        self._has_joints = False
        self.shows_triangles = False
        """Whether concave meshes get a geom with all their triangles."""

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

    def note_edit(self, *, is_rewritten: bool = False) -> None:
        """Note that elements of the spec change, or may: the next world cannot take it over.

        Args:
            is_rewritten: whether friction coefficients, the dimensions of contacts and inertias of motors
                alone do, which the pool writes for each body.
        """
        self._is_edited = True
        self.element_edits += not is_rewritten

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
