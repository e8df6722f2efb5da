"""The world: bodies on MuJoCo, edited at any time, compiled when someone looks or steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from roboyard.errors import ModelError, RoboyardError, StaleHandleError
from roboyard.poses import Array, normalized
from roboyard.sim import appearance, contacts, objects, rays, state
from roboyard.sim.assets import MeshAssets
from roboyard.sim.body import Body
from roboyard.sim.build import build, discard, is_anchored
from roboyard.sim.constraints import Constraints
from roboyard.sim.drives import Drives
from roboyard.sim.filters import CollisionFilters
from roboyard.sim.motors import Motors
from roboyard.sim.options import HARD_SOLIMP, PILE_SOLIMP, Solver, apply_options, chosen_solver
from roboyard.sim.profile import PLAIN, Profile
from roboyard.sim.records import BuildOptions, Built
from roboyard.sim.stepping import Stepping, alarm
from roboyard.sim.surfaces import Surfaces
from roboyard.sim.wrenches import Wrenches
from roboyard.urdf.model import RobotDescription

if TYPE_CHECKING:
    from roboyard.cameras import Camera, Image
    from roboyard.cameras.scene import DebugLines, RenderScene

MEMORY_PER_GEOM = 256 * 1024
"""Bytes of MuJoCo's arena (contacts, constraints) a collision shape; untouched memory costs nothing."""
MEMORY_LEAST, MEMORY_MOST = 64 * 2**20, 2 * 2**30


class World:
    """A world of bodies under gravity. Worlds are independent of one another and deterministic.

    Bodies may be added and removed at any time; such edits compile at the next step or query, and all that
    stays keeps its state. Quaternions are (x, y, z, w), everything SI.
    """

    def __init__(
        self,
        *,
        gravity: Sequence[float] = (0.0, 0.0, -9.81),
        timestep: float = 1 / 240,
        solver: Solver = "auto",
        visual_geoms: bool = True,
        profile: Profile = PLAIN,
    ) -> None:
        """Start an empty world.

        Args:
            gravity: (3,) m/s².
            timestep: s.
            solver: "newton" (robots), "cg" (piles) or "auto" (by size, see `roboyard.sim.options`).
            visual_geoms: also give MuJoCo the visual shapes (group 2), for its own viewers and renderer;
                Roboyard's cameras draw them in any case.
            profile: the engine's rules; see `roboyard.sim.profile`.
        """
        if not timestep > 0:
            raise RoboyardError(f"a time step is positive; got {timestep}")
        self.spec = mujoco.MjSpec()
        self.spec.compiler.degree = False
        self.spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
        self.spec.compiler.boundmass = 0.0
        self.assets = MeshAssets(self.spec)
        self.body_by_id: dict[int, Body] = {}
        self.profile = profile
        self.drives = Drives(self)
        self.motors = Motors(self)
        self.constraints = Constraints(self)
        self.stepping = Stepping(self)
        self.surfaces = Surfaces(self)
        self.wrenches = Wrenches(self)
        self.filters = CollisionFilters(self)
        self.visual_geoms = visual_geoms
        self.revision = 0
        """Grows whenever a compile moves things around in MuJoCo's arrays."""
        self.hard_contacts = profile.hard_contacts
        """Whether contacts are solved on the velocity level now (a pile's never are)."""
        self.before_step: list[Callable[[], None]] = []
        """Called before each time step, in order: where controllers work."""
        self._gravity = _vector3(gravity)
        self._timestep = float(timestep)
        self._solver: Solver = solver
        self._next_id = 0
        self._names: set[str] = set()
        self._model: Any = None
        self._data: Any = None
        self._stale = True
        self._moved = True
        self._velocity_moved = True
        self._geom_owners: np.ndarray | None = None
        self._scene: RenderScene | None = None
        self.looks = appearance.Looks(self)

    def __repr__(self) -> str:
        return f"<World at {self.time:.3f} s with {len(self.body_by_id)} bodies>"

    # ------------------------------------------------------------------------------------------- the engine

    @property
    def is_stale(self) -> bool:
        """Whether an edit waits for the next compile."""
        return self._stale

    @property
    def model(self) -> Any:
        """The compiled `mujoco.MjModel`; a new object after each structural edit."""
        if self._stale:
            self.ensure_compiled()
        return self._model

    @property
    def data(self) -> Any:
        """The `mujoco.MjData` of `model`; after writing into it call `mark_moved`."""
        if self._stale:
            self.ensure_compiled()
        return self._data

    def mark_stale(self) -> None:
        """An edit of the spec: compile before the next use."""
        self._stale = True

    def mark_moved(self) -> None:
        """Positions or velocities were written: derived quantities are computed anew when asked for."""
        self._moved = self._velocity_moved = True

    def ensure_compiled(self) -> None:
        """Compile now if an edit waits; state of all that stays is kept.

        Raises:
            ModelError: MuJoCo refuses the model.
        """
        if not self._stale:
            return
        dofs = sum(body.built.dofs for body in self.body_by_id.values())
        apply_options(
            self.spec,
            timestep=self._timestep,
            gravity=self._gravity,
            dofs=dofs,
            solver=self._solver,
            profile=self.profile,
        )
        shapes = sum(len(r.geoms) for body in self.body_by_id.values() for r in body.built.links)
        self.spec.memory = int(np.clip(shapes * MEMORY_PER_GEOM, MEMORY_LEAST, MEMORY_MOST))
        self.filters.write()
        try:
            if self._model is None:
                self._model = self.spec.compile()
                self._data = mujoco.MjData(self._model)
            else:
                self._model, self._data = self.spec.recompile(self._model, self._data)
        except ValueError as error:
            raise ModelError(f"MuJoCo refuses the world: {' '.join(str(error).split())}") from error
        self._stale = False
        self.revision += 1
        self.hard_contacts = self.profile.hard_contacts and chosen_solver(self._solver, dofs) == "newton"
        if self.profile.hard_contacts:
            self._model.geom_margin[:] = self.profile.contact_margin if self.hard_contacts else 0.0
            self._model.geom_solimp[:] = HARD_SOLIMP if self.hard_contacts else PILE_SOLIMP
        for body in self.body_by_id.values():
            body.refresh(self._model)
        self._geom_owners = None
        self.surfaces.invalidate()
        self.motors.invalidate()
        self.constraints.invalidate()
        self.stepping.invalidate()
        self.stepping.refresh()
        self.looks.invalidate()
        self.mark_moved()

    def kinematics(self) -> Any:
        """MjData whose positions (xpos, xipos, geom_xpos, ...) fit the present qpos."""
        if self._stale:
            self.ensure_compiled()
        if self._moved:
            mujoco.mj_kinematics(self._model, self._data)
            mujoco.mj_comPos(self._model, self._data)
            self._moved = False
        return self._data

    def velocities(self) -> Any:
        """MjData whose positions and body velocities (cvel) fit the present qpos and qvel."""
        data = self.kinematics()
        if self._velocity_moved:
            mujoco.mj_fwdVelocity(self._model, data)
            self._velocity_moved = False
        return data

    def object_velocity(self, row: int, *, at_inertial: bool) -> tuple[Array, Array]:
        """Linear and angular velocity in world axes, at a MuJoCo body's frame or centre of mass."""
        data = self.velocities()
        kind = mujoco.mjtObj.mjOBJ_BODY if at_inertial else mujoco.mjtObj.mjOBJ_XBODY
        out = np.empty(6)
        mujoco.mj_objectVelocity(self._model, data, kind, row, out, 0)
        return out[3:], out[:3]

    @property
    def geom_owners(self) -> np.ndarray:
        """(ngeom, 2) int32: body id and link index of each MuJoCo geom."""
        self.ensure_compiled()
        if self._geom_owners is None:
            by_row = np.full((self._model.nbody, 2), -1, dtype=np.int32)
            for body in self.body_by_id.values():
                by_row[body.mujoco_ids, 0] = body.id
                by_row[body.mujoco_ids, 1] = np.arange(len(body.links))
            self._geom_owners = by_row[self._model.geom_bodyid]
            for body in self.body_by_id.values():
                if body.built.is_ground:
                    self._geom_owners[[geom.id for geom in body.built.links[0].geoms]] = (body.id, 0)
        return self._geom_owners

    # --------------------------------------------------------------------------------------------- settings

    @property
    def gravity(self) -> Array:
        """(3,) m/s²"""
        return np.array(self._gravity)

    @gravity.setter
    def gravity(self, value: Sequence[float]) -> None:
        self._gravity = _vector3(value)
        if not self._stale:
            self._model.opt.gravity[:] = self._gravity

    @property
    def timestep(self) -> float:
        """S"""
        return self._timestep

    @timestep.setter
    def timestep(self, value: float) -> None:
        if not value > 0:
            raise RoboyardError(f"a time step is positive; got {value}")
        self._timestep = float(value)
        if not self._stale:
            self._model.opt.timestep = self._timestep

    @property
    def solver(self) -> str:
        """What solves the contacts now: "newton" or "cg"."""
        return chosen_solver(self._solver, sum(b.built.dofs for b in self.body_by_id.values()))

    @solver.setter
    def solver(self, value: Solver) -> None:
        self._solver = value
        self.mark_stale()

    @property
    def time(self) -> float:
        """S since the world began."""
        return 0.0 if self._data is None else float(self._data.time)

    # --------------------------------------------------------------------------------------------- bodies

    @property
    def bodies(self) -> tuple[Body, ...]:
        """All bodies, in the order they were added."""
        return tuple(self.body_by_id.values())

    def body(self, name: str) -> Body:
        """The body of this name.

        Raises:
            RoboyardError: there is none.
        """
        for body in self.body_by_id.values():
            if body.name == name:
                return body
        from roboyard.errors import unknown_name

        raise RoboyardError(unknown_name("body", name, [b.name for b in self.body_by_id.values()]))

    def add_urdf(
        self,
        source: str | Path | RobotDescription,
        position: ArrayLike = (0, 0, 0),
        orientation: ArrayLike = (0, 0, 0, 1),
        *,
        fixed_base: bool | None = None,
        scale: float = 1.0,
        self_collision: bool = False,
        name: str | None = None,
        packages: Mapping[str, Path] | None = None,
        missing_meshes: Literal["error", "note"] = "error",
    ) -> Body:
        """Add a robot.

        Args:
            source: URDF file or a description.
            position: (3,) of the root link's frame; m.
            orientation: (4,) x, y, z, w.
            fixed_base: bolt the root link to the world. None: only where the description says so, by a root
                link named "world" or one whose mass is given as 0.
            scale: uniform factor on all lengths; masses grow with its cube.
            self_collision: let links of this robot touch one another (parents and children never do).
            name: how the world calls it; the robot's own name (made unique) by default.
            packages: folders of `package://` names.
            missing_meshes: "note" leaves shapes out whose mesh file is not there.

        Raises:
            DescriptionError: the file cannot be used; the message names the element and the remedy.
        """
        if isinstance(source, RobotDescription):
            description = source
        else:
            from roboyard.urdf import load_urdf

            description = load_urdf(source, packages=packages, missing_meshes=missing_meshes)
        if not scale > 0:
            raise RoboyardError(f"a scale is positive; got {scale}")
        return self.add_description(
            description,
            position,
            orientation,
            fixed_base=is_anchored(description) if fixed_base is None else fixed_base,
            scale=scale,
            self_collision=self_collision,
            name=name,
        )

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
    ) -> Body:
        """Add any description; `add_urdf`, `add_box` and their siblings all end here."""
        unique = self._unique_name(name or description.name or "body")
        contype, conaffinity = self.filters.masks(description, self_collision)
        options = BuildOptions(
            fixed_base=fixed_base,
            scale=scale,
            visual_geoms=self.visual_geoms,
            drives=drives and self.profile.pid_drives,
            joint_damping=joint_damping,
            joint_friction=joint_friction and self.profile.joint_friction,
            hard=self.profile.hard_contacts,
            contype=contype,
            conaffinity=conaffinity,
        )
        built = build(
            self.spec,
            self.assets,
            description,
            f"{unique}/",
            np.asarray(position, dtype=float),
            normalized(orientation),
            options,
        )
        body = self.register(unique, built, description, fixed_base=fixed_base, scale=scale)
        for link in body.links:
            contact = link._built.link.contact if link._built.link is not None else None
            if contact is not None and contact.restitution:
                link.restitution = float(np.clip(contact.restitution, 0.0, 1.0))
        return body

    def register(
        self,
        name: str,
        built: Built,
        description: RobotDescription | None,
        *,
        fixed_base: bool,
        scale: float = 1.0,
    ) -> Body:
        """Give a freshly built body its id and its place."""
        body = Body(self, self._next_id, name, built, description, fixed_base=fixed_base, scale=scale)
        self._next_id += 1
        self.body_by_id[body.id] = body
        self._names.add(name)
        self.filters.claim(body)
        self.looks.add(body)
        self.mark_stale()
        return body

    def _unique_name(self, wanted: str) -> str:
        name, k = wanted, 1
        while name in self._names:
            k += 1
            name = f"{wanted}_{k}"
        return name

    def remove(self, body: Body) -> None:
        """Take a body out; all others keep their state."""
        if body.is_removed or self.body_by_id.get(body.id) is not body:
            raise StaleHandleError(f"body {body.name!r} is not in this world")
        built = body.built
        self.constraints.forget(body.id)
        self.filters.forget(body)
        self.surfaces.forget(body.id)
        self.motors.forget(body.id)
        self.stepping.forget(body.id)
        self.looks.forget(body.id)
        discard(built, self.spec, self.assets)
        del self.body_by_id[body.id]
        self._names.discard(body.name)
        body.detach()
        self.mark_stale()

    add_plane = objects.add_plane
    add_box = objects.add_box
    add_sphere = objects.add_sphere
    add_cylinder = objects.add_cylinder
    add_capsule = objects.add_capsule
    add_mesh = objects.add_mesh
    add_heightfield = objects.add_heightfield

    def add_mjcf(self, source: str | Path, position: ArrayLike = (0, 0, 0)) -> tuple[Body, ...]:
        """Add everything in an MJCF file: each body at its top, and its fixed shapes as one more body."""
        from roboyard.sim.mjcf import add_mjcf

        return add_mjcf(self, source, position)

    # --------------------------------------------------------------------------------------------- stepping

    def step(self, n: int = 1) -> None:
        """Advance by n time steps.

        Raises:
            ModelError: the simulation exploded (positions or velocities are no longer finite).
        """
        if self._stale:
            self.ensure_compiled()
        model, data, stepping = self._model, self._data, self.stepping
        if stepping.is_plain:
            mujoco.mj_step(model, data, n)
        else:
            for _ in range(n):
                stepping.step(model, data)
        self._moved = self._velocity_moved = True
        if alarm.message is not None:
            alarm.message = None
            raise ModelError(self._explosion())

    def _explosion(self) -> str:
        bad = np.flatnonzero(~(np.abs(self._data.qvel) < 1e9))
        rows = self._model.dof_bodyid[bad[:1]]
        names = [b.name for b in self.body_by_id.values() if np.isin(rows, b.mujoco_ids).any()]
        who = f"body {names[0]!r}" if names else "the world"
        return (
            f"the simulation exploded at {self.time:.4f} s: {who} has no finite state any more; "
            "check masses, inertias and drive gains, or take a smaller time step"
        )

    # ------------------------------------------------------------------------------------------- what happens

    def contacts(self, body: Body | None = None, other: Body | None = None) -> list[contacts.Contact]:
        """Contacts of the last step; with `body` given only its own, with it as a."""
        return contacts.contacts(self, body, other)

    def contact_arrays(self) -> contacts.ContactArrays:
        """All contacts of the last step as arrays."""
        return contacts.contact_arrays(self)

    def detect_contacts(self) -> None:
        """Find the contacts of the present positions without stepping; they carry no force."""
        self.kinematics()
        mujoco.mj_collision(self._model, self._data)

    def ray(self, start: ArrayLike, end: ArrayLike, *, visual: bool = False) -> rays.RayHit | None:
        """The first surface between two points, or None."""
        return rays.cast_one(self, start, end, visual=visual)

    def rays(self, starts: ArrayLike, ends: ArrayLike, *, visual: bool = False) -> rays.RayHits:
        """The first surface along each of k rays; see `roboyard.sim.rays.cast`."""
        return rays.cast(self, starts, ends, visual=visual)

    def save_state(self) -> state.WorldState:
        """Remember this moment."""
        return state.save(self)

    def restore_state(self, saved: state.WorldState) -> None:
        """Go back to a remembered moment, bit for bit."""
        state.restore(self, saved)

    def bounds_of(self, mujoco_ids: np.ndarray) -> Array:
        """(2, 3) box around all shapes of some MuJoCo bodies; m."""
        data = self.kinematics()
        model = self._model
        of_body = np.isin(model.geom_bodyid, mujoco_ids)
        plane = model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)
        rows = np.flatnonzero(of_body & ~plane)
        corners = [data.xpos[mujoco_ids]]
        if len(rows):
            rotation = data.geom_xmat[rows].reshape(-1, 3, 3)
            box = model.geom_aabb[rows]
            centre = data.geom_xpos[rows] + np.einsum("nij,nj->ni", rotation, box[:, :3])
            half = np.einsum("nij,nj->ni", np.abs(rotation), box[:, 3:])
            corners = [centre - half, centre + half]
        points = np.concatenate(corners)
        return np.stack([points.min(axis=0), points.max(axis=0)])

    # ---------------------------------------------------------------------------------------------- pictures

    def render_scene(self) -> RenderScene:
        """Everything there is to draw, for `roboyard.cameras.render`."""
        return self.looks.scene()

    def frames(self) -> tuple[Array, Array]:
        """(nbody, 3) positions and (nbody, 3, 3) rotations of all MuJoCo bodies, as cameras want them."""
        data = self.kinematics()
        return data.xpos, data.xmat.reshape(-1, 3, 3)

    def render(self, camera: Camera, *, lines: DebugLines | None = None, **options: Any) -> Image:
        """A picture: colours, depth and who is seen where; options as in `roboyard.cameras.render`."""
        from roboyard.cameras import render

        positions, rotations = self.frames()
        if lines is not None:
            options["lines"] = lines
        return render(self.render_scene(), positions, rotations, camera, **options)


def _vector3(value: Sequence[float]) -> tuple[float, float, float]:
    numbers = [float(v) for v in value]
    if len(numbers) != 3 or not np.isfinite(numbers).all():
        raise RoboyardError(f"gravity has three finite numbers; got {tuple(value)}")
    return numbers[0], numbers[1], numbers[2]
