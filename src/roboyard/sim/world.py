"""The world: bodies on MuJoCo, edited at any time, compiled lazily at the next step or query."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from roboyard._arrays import ArrayLike
from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard.description.model import RGBA, RobotDescription
from roboyard.errors import RoboyardError, unknown_name
from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim import objects
from roboyard.sim.body import Body
from roboyard.sim.build.bodies import is_anchored
from roboyard.sim.build.solver_options import Solver
from roboyard.sim.link import LinkBody
from roboyard.sim.physics_profile import PLAIN, PhysicsProfile
from roboyard.sim.simulation import Simulation
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.rendering import Camera, Image
    from roboyard.rendering.scene import DebugLines, RenderScene
    from roboyard.sim.queries.contacts import Contact, ContactArrays
    from roboyard.sim.queries.rays import RayHit, RayHits
    from roboyard.sim.soft.materials import NeoHookean, Springs
    from roboyard.sim.soft.soft_body import SoftBody
    from roboyard.sim.world_state import WorldState

contact_queries = lazy_module("roboyard.sim.queries.contacts")
ray_queries = lazy_module("roboyard.sim.queries.rays")
world_state = lazy_module("roboyard.sim.world_state")


class World(Simulation):
    """A world of bodies under gravity. Worlds are independent of one another and deterministic.

    Bodies may be added and removed at any time; such edits compile at the next step or query, and all
    remaining bodies keep their state. Quaternions are (x, y, z, w); all units are SI.
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
        """Create an empty world.

        Args:
            gravity: (3,) in the world frame (m/s²).
            timestep: time step (s).
            solver: "newton" (robots), "cg" (piles) or "auto" (by size; see
                `roboyard.sim.build.solver_options`).
            visual_geoms: also give MuJoCo the visual shapes (group 2), for its own viewers and renderer;
                Roboyard's cameras render them in any case.
            profile: the rules of the engine; see `roboyard.sim.physics_profile`.

        Raises:
            RoboyardError: the time step is not positive or the gravity not finite.
        """
        super().__init__(
            gravity=gravity, timestep=timestep, solver=solver, visual_geoms=visual_geoms, profile=profile
        )

    @staticmethod
    def of(body: LinkBody) -> World:
        """Return the world of a body.

        Raises:
            StaleHandleError: the body was removed.
        """
        world = body.world
        assert isinstance(world, World)
        return world

    def __repr__(self) -> str:
        return f"<World at {self.time:.3f} s with {len(self.body_by_id)} bodies>"

    def _repr_html_(self) -> str:
        from roboyard.sim.notebook import world_html

        return world_html(self.time, self.bodies, self.render)

    # --------------------------------------------------------------------------------------------- bodies

    def body(self, name: str) -> Body:
        """Return the body of a name.

        Raises:
            RoboyardError: there is none; the message lists the nearest names.
        """
        for body in self.body_by_id.values():
            if body.name == name:
                return body
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
        xacro_args: Mapping[str, str] | None = None,
    ) -> Body:
        """Add a robot.

        Args:
            source: URDF or xacro file, or a description.
            position: (3,) of the root link's frame in the world frame (m).
            orientation: (4,) quaternion x, y, z, w of the root link's frame.
            fixed_base: fix the root link to the world. None: only where the description does so, by a root
                link named "world" or of mass 0.
            scale: uniform factor on all lengths; masses grow with its cube.
            self_collision: let links of this robot touch one another (parents and children never do).
            name: its name in the world; by default the robot's own, made unique.
            packages: folders of `package://` names.
            missing_meshes: "note" skips shapes whose mesh file is missing.
            xacro_args: values of `<xacro:arg>` by name, for a xacro file.

        Raises:
            DescriptionError: the file cannot be used; the message names the element and the remedy.
        """
        if isinstance(source, RobotDescription):
            description = source
        else:
            from roboyard.description import load_description

            description = load_description(
                source, packages=packages, missing_meshes=missing_meshes, xacro_args=xacro_args
            )
        if not scale > 0:
            raise RoboyardError(f"scale must be positive, got {scale}")
        return self.add_description(
            description,
            position,
            orientation,
            fixed_base=is_anchored(description) if fixed_base is None else fixed_base,
            scale=scale,
            self_collision=self_collision,
            name=name,
        )

    def add_plane(
        self,
        normal: ArrayLike = (0, 0, 1),
        position: ArrayLike = (0, 0, 0),
        *,
        rgba: RGBA = (0.9, 0.9, 0.92, 1.0),
        friction: float | None = None,
        name: str = "plane",
    ) -> Body:
        """Add an infinite floor or wall with this normal (3,) through a point (3,) (m); it never moves."""
        description = objects.plane(normal, rgba=rgba, friction=friction, name=name)
        return self._add_object(description, position)

    def add_box(
        self,
        size: ArrayLike,
        position: ArrayLike = (0, 0, 0),
        orientation: ArrayLike = (0, 0, 0, 1),
        *,
        mass: float = 1.0,
        rgba: RGBA = objects.GREY,
        friction: float | None = None,
        name: str = "box",
    ) -> Body:
        """Add a box of full extents `size` (3,) (m); mass 0 fixes it to the world."""
        description = objects.box(size, mass=mass, rgba=rgba, friction=friction, name=name)
        return self._add_object(description, position, orientation)

    def add_sphere(
        self,
        radius: float,
        position: ArrayLike = (0, 0, 0),
        *,
        mass: float = 1.0,
        rgba: RGBA = objects.GREY,
        friction: float | None = None,
        name: str = "sphere",
    ) -> Body:
        """Add a solid sphere of a radius (m) at a position (3,) (m); mass 0 fixes it to the world."""
        description = objects.sphere(radius, mass=mass, rgba=rgba, friction=friction, name=name)
        return self._add_object(description, position)

    def add_cylinder(
        self,
        radius: float,
        length: float,
        position: ArrayLike = (0, 0, 0),
        orientation: ArrayLike = (0, 0, 0, 1),
        *,
        mass: float = 1.0,
        rgba: RGBA = objects.GREY,
        friction: float | None = None,
        name: str = "cylinder",
    ) -> Body:
        """Add a solid cylinder along its z axis; mass 0 fixes it to the world.

        `radius` and `length` are in m, `position` (3,) in m, `orientation` (4,) x, y, z, w.
        """
        description = objects.cylinder(radius, length, mass=mass, rgba=rgba, friction=friction, name=name)
        return self._add_object(description, position, orientation)

    def add_capsule(
        self,
        radius: float,
        length: float,
        position: ArrayLike = (0, 0, 0),
        orientation: ArrayLike = (0, 0, 0, 1),
        *,
        mass: float = 1.0,
        rgba: RGBA = objects.GREY,
        friction: float | None = None,
        name: str = "capsule",
    ) -> Body:
        """Add a solid capsule along its z axis; mass 0 fixes it to the world.

        `radius` and `length` (without the caps) are in m, `position` (3,) in m, `orientation` (4,) x, y, z,
        w.
        """
        description = objects.capsule(radius, length, mass=mass, rgba=rgba, friction=friction, name=name)
        return self._add_object(description, position, orientation)

    def add_mesh(
        self,
        mesh: str | Path | TriangleMesh,
        position: ArrayLike = (0, 0, 0),
        orientation: ArrayLike = (0, 0, 0, 1),
        *,
        scale: ArrayLike = (1, 1, 1),
        mass: float = 1.0,
        concave: bool = False,
        rgba: RGBA | None = None,
        friction: float | None = None,
        name: str = "mesh",
    ) -> Body:
        """Add a mesh, solid as its convex hull; mass 0 fixes it to the world.

        With mass 0 and `concave`, bodies touch its triangles, of which there may be any number. `position`
        (3,) is in m, `orientation` (4,) x, y, z, w, `scale` one factor or (3,).

        Raises:
            RoboyardError: a mesh with a mass is concave.
        """
        description = objects.mesh(
            mesh, scale=scale, mass=mass, concave=concave, rgba=rgba, friction=friction, name=name
        )
        return self._add_object(description, position, orientation)

    def add_heightfield(
        self,
        heights: ArrayLike,
        cell: ArrayLike,
        position: ArrayLike = (0, 0, 0),
        *,
        rgba: RGBA = (0.6, 0.65, 0.55, 1.0),
        friction: float | None = None,
        name: str = "terrain",
    ) -> Body:
        """Add terrain that never moves.

        Args:
            heights: (nx, ny) height at each grid point, first index along x (m).
            cell: spacing of the points along x and y (m).
            position: (3,) centre of the grid at height 0 (m).
            rgba: colour, each 0 to 1.
            friction: sliding friction coefficient.
            name: its name in the world.

        Raises:
            RoboyardError: fewer than 2 by 2 heights, or some that are not finite.
        """
        description = objects.heightfield(heights, cell, rgba=rgba, friction=friction, name=name)
        return self._add_object(description, position)

    def add_soft_body(
        self,
        nodes: ArrayLike,
        elements: ArrayLike,
        position: ArrayLike = (0, 0, 0),
        orientation: ArrayLike = (0, 0, 0, 1),
        *,
        mass: float = 1.0,
        material: Springs | NeoHookean | Sequence[Springs | NeoHookean],
        radius: float = 0.01,
        friction: float = 0.5,
        self_collision: bool = False,
        repulsion: float | None = None,
        skin: TriangleMesh | None = None,
        rgba: RGBA | None = None,
        name: str = "soft",
    ) -> SoftBody:
        """Add cloth, or a soft solid.

        A time step is divided into as many parts as the stiffness of all soft bodies requires, at most 64.

        Args:
            nodes: (n, 3) nodes at rest (m).
            elements: (m, 3) triangles or (m, 4) tetrahedra of nodes.
            position: (3,) of the nodes' origin in the world frame (m).
            orientation: (4,) quaternion x, y, z, w.
            mass: kg, the same for each node.
            material: springs, a solid, or both.
            radius: distance from the nodes at which surfaces are (m).
            friction: sliding friction coefficient.
            self_collision: whether its parts touch each other.
            repulsion: stiffness (N/m) of springs that then keep them apart, in far less time than contacts,
                which they have with None. Source: Bullet 3.2, `btSoftBody::applyRepulsionForce`.
            skin: mesh that cameras see and that follows the nodes, in their frame; None for the elements.
            rgba: colour, each 0 to 1; None for the skin's own.
            name: its name in the world.

        Raises:
            RoboyardError: nodes, elements or parameters cannot be used; the message says which.
        """
        from roboyard.sim.soft.adding import add_soft_body

        return add_soft_body(
            self, nodes, elements, position, orientation, mass=mass, material=material, radius=radius,
            friction=friction, self_collision=self_collision, repulsion=repulsion, skin=skin,
            rgba=rgba, name=name,
        )  # fmt: skip

    def _add_object(
        self,
        description: RobotDescription,
        position: ArrayLike,
        orientation: ArrayLike = (0, 0, 0, 1),
    ) -> Body:
        fixed = description.links[0].inertial is None
        return self.add_description(description, position, orientation, fixed_base=fixed)

    def add_mjcf(
        self, source: str | Path, position: ArrayLike = (0, 0, 0), *, search_paths: Sequence[Path] = ()
    ) -> tuple[Body, ...]:
        """Add an MJCF file at an offset (3,) (m).

        It may include files and name meshes and textures in its own folders and in `search_paths` only.

        Returns:
            One body for the file's fixed shapes (if it has any), then one for each top-level body.

        Raises:
            DescriptionError: the file cannot be used; the message names the element and the remedy.
        """
        from roboyard.sim.mjcf import add_mjcf

        return add_mjcf(self, source, position, search_paths=search_paths)

    # ------------------------------------------------------------------------------------------------ queries

    def contacts(self, body: Body | None = None, other: Body | None = None) -> list[Contact]:
        """Return the contacts of the last step; with `body` only its own, with `body` as a."""
        return contact_queries().find_contacts(self, body, other)

    def contact_arrays(self) -> ContactArrays:
        """Return all contacts of the last step as arrays."""
        return contact_queries().contact_arrays(self)

    def detect_contacts(self) -> None:
        """Detect the contacts of the present positions without a step; they have no force."""
        self.ensure_compiled()
        if self.windows.shows_slots:
            self.windows.update()
        self.link_frames(keeps_last=True)
        try:
            self.stepping.detect(self._model, self._data)
        except mujoco.FatalError as error:
            self.recover(error, self.simulation_state())
            self.link_frames(keeps_last=True)
            self.stepping.detect(self._model, self._data)

    def ray(self, start: ArrayLike, end: ArrayLike, *, visual: bool = False) -> RayHit | None:
        """Return the first surface between two points (3,) in the world frame (m), or None."""
        return ray_queries().cast_one(self, start, end, visual=visual)

    def rays(self, starts: ArrayLike, ends: ArrayLike, *, visual: bool = False) -> RayHits:
        """Return the first surface along each of k rays, (k, 3) (m); see `roboyard.sim.queries.rays.cast`."""
        return ray_queries().cast(self, starts, ends, visual=visual)

    def save_state(self) -> WorldState:
        """Return the state of the world."""
        return world_state().save(self, self.stepping.manifolds.save())

    def restore_state(self, saved: WorldState, *, keeps_points: bool = False, by_place: bool = False) -> None:
        """Restore a saved state, bit for bit.

        Args:
            saved: the state.
            keeps_points: whether contacts go on with the points that they keep now, where none were saved.
            by_place: whether bodies may have been replaced by others with as many links and joints; contacts
                then go on with the points that they keep now.
        """
        world_state().restore(self, saved, by_place=by_place)
        is_same = not by_place or saved.signature == tuple(self.body_by_id)
        if is_same and (not keeps_points or saved.has_points):
            self.stepping.manifolds.restore(saved.contacts)

    # ---------------------------------------------------------------------------------------------- pictures

    def render_scene(self) -> RenderScene:
        """Return everything to draw, for `roboyard.rendering.render`."""
        return self.render_shapes.scene()

    def frames(self) -> tuple[Array, Array]:
        """Return (nbody, 3) positions (m) and (nbody, 3, 3) rotations of all MuJoCo bodies, for cameras."""
        data = self.kinematics()
        return data.xpos, data.xmat.reshape(-1, 3, 3)

    def render(self, camera: Camera, *, lines: DebugLines | None = None, **options: Any) -> Image:
        """Render a picture with colours, depth and segmentation.

        Args:
            camera: the camera.
            lines: debug lines to draw.
            options: those of `roboyard.rendering.render`.
        """
        from roboyard.rendering import render

        positions, rotations = self.frames()
        if lines is not None:
            options["lines"] = lines
        if self.visual_geoms:
            options.setdefault("mujoco", (self.model, self.data))
        return render(self.render_scene(), positions, rotations, camera, **options)
