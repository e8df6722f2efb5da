"""The world: bodies on MuJoCo, edited at any time, compiled when someone looks or steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from roboyard.description.model import RobotDescription
from roboyard.errors import ModelError, RoboyardError, StaleHandleError
from roboyard.sim import objects, world_state
from roboyard.sim.actuation.drives import Drives
from roboyard.sim.actuation.velocity_motors import VelocityMotors
from roboyard.sim.appearance import render_shapes
from roboyard.sim.body import Body
from roboyard.sim.build.bodies import build, discard, is_anchored
from roboyard.sim.build.records import BuildOptions, Built
from roboyard.sim.build.solver_options import Solver
from roboyard.sim.engine import Engine
from roboyard.sim.physics_profile import PLAIN, PhysicsProfile
from roboyard.sim.queries import contacts, rays
from roboyard.sim.stepping.collision_filters import CollisionFilters
from roboyard.sim.stepping.constraints import Constraints
from roboyard.sim.stepping.surfaces import Surfaces
from roboyard.sim.stepping.time_steps import Stepping, solver_warning
from roboyard.sim.stepping.wrenches import Wrenches
from roboyard.transforms import Array, normalized

if TYPE_CHECKING:
    from roboyard.rendering import Camera, Image
    from roboyard.rendering.scene import DebugLines, RenderScene


class World(Engine):
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
        profile: PhysicsProfile = PLAIN,
    ) -> None:
        """Start an empty world.

        Args:
            gravity: (3,) m/s².
            timestep: s.
            solver: "newton" (robots), "cg" (piles) or "auto" (by size, see
            `roboyard.sim.build.solver_options`).
            visual_geoms: also give MuJoCo the visual shapes (group 2), for its own viewers and renderer;
                Roboyard's cameras draw them in any case.
            profile: the engine's rules; see `roboyard.sim.physics_profile`.
        """
        super().__init__(gravity=gravity, timestep=timestep, solver=solver, profile=profile)
        self.drives = Drives(self)
        self.motors = VelocityMotors(self)
        self.constraints = Constraints(self)
        self.stepping = Stepping(self)
        self.surfaces = Surfaces(self)
        self.wrenches = Wrenches(self)
        self.filters = CollisionFilters(self)
        self.visual_geoms = visual_geoms
        self.before_step: list[Callable[[], None]] = []
        """Called before each time step, in order: where controllers work."""
        self.after_step: list[Callable[[], None]] = []
        """Called when `step` has taken its steps: where viewers look at the world."""
        self._next_id = 0
        self._names: set[str] = set()
        self._copies: dict[str, int] = {}
        """By wanted name: up to which number names are known to be taken."""
        self.render_shapes = render_shapes.RenderShapes(self)

    def __repr__(self) -> str:
        return f"<World at {self.time:.3f} s with {len(self.body_by_id)} bodies>"

    def _repr_html_(self) -> str:
        from roboyard.sim.notebook import world_html

        return world_html(self.time, self.bodies, self.render)

    def _before_compile(self) -> None:
        self.filters.write()

    def _after_compile(self) -> None:
        for room in (self.surfaces, self.motors, self.constraints, self.stepping, self.render_shapes):
            room.invalidate()
        self.stepping.refresh()

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
            from roboyard.description import load_description

            description = load_description(source, packages=packages, missing_meshes=missing_meshes)
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
        keep_link_order: bool = False,
    ) -> Body:
        """Add any description; `add_urdf`, `add_box` and their siblings all end here.

        Links are numbered depth first, or with `keep_link_order` as the description lists them, root first.
        """
        unique = self._unique_name(name or description.name or "body")
        contype, conaffinity = self.filters.masks(description, self_collision)
        options = BuildOptions(
            fixed_base=fixed_base,
            scale=scale,
            visual_geoms=self.visual_geoms,
            drives=drives and self.profile.pid_drives,
            joint_damping=joint_damping,
            joint_friction=joint_friction and self.profile.joint_friction,
            keep_link_order=keep_link_order,
            hard=self.profile.hard_contacts,
            contype=contype,
            conaffinity=conaffinity,
        )
        prefix, xyz, quaternion = f"{unique}/", np.asarray(position, dtype=float), normalized(orientation)
        taken = self.pool.take(description, prefix, xyz, quaternion, options)
        built = taken
        if built is None:
            built = build(self.raw_spec, self.assets, description, prefix, xyz, quaternion, options)
        body = self.register(unique, built, description, fixed_base=fixed_base, scale=scale)
        if taken is None:
            self.mark_stale()
            self.pool.note(body, options)
        else:
            self.pool.activate(body)
            self.adopt(body)
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
        """Give a freshly built body its id and its place; whoever edited the spec marks the world stale."""
        body = Body(self, self._next_id, name, built, description, fixed_base=fixed_base, scale=scale)
        self._next_id += 1
        self.body_by_id[body.id] = body
        self._names.add(name)
        self.filters.assign_masks(body)
        self.render_shapes.add(body)
        return body

    def _unique_name(self, wanted: str) -> str:
        name, k = wanted, self._copies.get(wanted, 1)
        while name in self._names:
            k += 1
            name = f"{wanted}_{k}"
        self._copies[wanted] = max(1, k - 1)
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
        self.render_shapes.forget(body.id)
        del self.body_by_id[body.id]
        self._names.discard(body.name)
        self._copies.clear()
        if self.pool.take_back(body):
            self.disown(body)
        else:
            discard(built, self.raw_spec, self.assets)
            self.mark_stale()
        body.detach()

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
        if self.pool.inactive:
            self.pool.tick(n)
        if self._stale:
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
            self._inertia_changed = False
            mujoco.mj_setConst(self._model, mujoco.MjData(self._model))
            self.pool.update_inertia()
        model, data, stepping = self._model, self._data, self.stepping
        if stepping.is_plain:
            mujoco.mj_step(model, data, n)
        else:
            for _ in range(n):
                stepping.step(model, data)
        self._moved = self._velocity_moved = True
        if solver_warning.message is not None:
            solver_warning.message = None
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
        """The first surface along each of k rays; see `roboyard.sim.queries.rays.cast`."""
        return rays.cast(self, starts, ends, visual=visual)

    def save_state(self) -> world_state.WorldState:
        """Remember this moment."""
        return world_state.save(self)

    def restore_state(self, saved: world_state.WorldState) -> None:
        """Go back to a remembered moment, bit for bit."""
        world_state.restore(self, saved)

    def bounds_of(self, mujoco_ids: np.ndarray) -> Array:
        """(2, 3) box around all shapes of some MuJoCo bodies; m."""
        data = self.kinematics()
        model = self._model
        of_body = np.isin(model.geom_bodyid, mujoco_ids)
        plane = model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)
        mesh = model.geom_type == int(mujoco.mjtGeom.mjGEOM_MESH)
        rows = np.flatnonzero(of_body & ~plane & ~mesh)
        corners = [data.xpos[mujoco_ids]]
        for row in np.flatnonzero(of_body & mesh):  # MuJoCo's own boxes lie along principal axes: too large
            first, count = (int(a[model.geom_dataid[row]]) for a in (model.mesh_vertadr, model.mesh_vertnum))
            points = model.mesh_vert[first : first + count] @ data.geom_xmat[row].reshape(3, 3).T
            corners.append(points.min(axis=0)[None] + data.geom_xpos[row])
            corners.append(points.max(axis=0)[None] + data.geom_xpos[row])
        if len(rows):
            rotation = data.geom_xmat[rows].reshape(-1, 3, 3)
            box = model.geom_aabb[rows]
            centre = data.geom_xpos[rows] + np.einsum("nij,nj->ni", rotation, box[:, :3])
            half = np.einsum("nij,nj->ni", np.abs(rotation), box[:, 3:])
            corners += [centre - half, centre + half]
        points = np.concatenate(corners)
        return np.stack([points.min(axis=0), points.max(axis=0)])

    # ---------------------------------------------------------------------------------------------- pictures

    def render_scene(self) -> RenderScene:
        """Everything there is to draw, for `roboyard.rendering.render`."""
        return self.render_shapes.scene()

    def frames(self) -> tuple[Array, Array]:
        """(nbody, 3) positions and (nbody, 3, 3) rotations of all MuJoCo bodies, as cameras want them."""
        data = self.kinematics()
        return data.xpos, data.xmat.reshape(-1, 3, 3)

    def render(self, camera: Camera, *, lines: DebugLines | None = None, **options: Any) -> Image:
        """A picture: colours, depth and who is seen where; options as in `roboyard.rendering.render`."""
        from roboyard.rendering import render

        positions, rotations = self.frames()
        if lines is not None:
            options["lines"] = lines
        if self.visual_geoms:
            options.setdefault("mujoco", (self.model, self.data))
        return render(self.render_scene(), positions, rotations, camera, **options)
