"""The bodies of one client and the World they live in."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.bullet_rules.hull_margins import margins_of_hulls
from roboyard.pybullet.bullet_rules.models import BodyModel
from roboyard.pybullet.bullet_rules.motor_commands import MotorCommands
from roboyard.pybullet.bullet_rules.picture_light import SolidScene
from roboyard.pybullet.bullet_rules.spherical_motors import DEFAULT_GAIN, IDENTITY, set_spherical_target
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.body_records import DEFAULT_IMPULSE, MULTIBODY, BodyRecord
from roboyard.pybullet.state.constraint_records import ConstraintRecord
from roboyard.pybullet.state.engine_parameters import EngineParameters
from roboyard.pybullet.state.ids import Counter, IdPool, drop_from_order
from roboyard.pybullet.state.pair_filters import PairFilters
from roboyard.pybullet.state.textures import Textures
from roboyard.sim.link import Link
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.world import World

if TYPE_CHECKING:
    from roboyard.pybullet.state.query_shapes import QueryShapes


class PhysicsScene:
    """Bodies by id, shapes by id, and how time passes."""

    def __init__(self, parameters: EngineParameters, first_texture: int = 0) -> None:
        self._parameters = parameters
        self._applied_revision = -1
        self.world = World(
            gravity=parameters.gravity, timestep=parameters.time_step, profile=BULLET, visual_geoms=False
        )
        self.bodies: dict[int, BodyRecord] = {}
        self.order: list[int] = []
        """Ids as getBodyUniqueId lists them."""
        self._ids = IdPool()
        self._records_of_world: dict[int, BodyRecord] = {}
        self.collision_shapes: dict[int, Any] = {}
        self.visual_shapes: dict[int, Any] = {}
        self.collision_ids, self.visual_ids = IdPool(), IdPool()
        self.constraints: dict[int, ConstraintRecord] = {}
        self.constraint_ids = Counter(1)
        self.states: dict[int, Any] = {}
        self.state_ids = IdPool()
        self.solid = SolidScene()
        self.textures = Textures(first_texture)
        self.efforts: dict[tuple[int, int], Any] = {}
        """Spring-damper torques by body and joint, worked out anew before each step."""
        self.keeps_given_torques = False
        self.given_torques: Any = None
        """(nv,) what scripts applied to joints in the last step, where a log wants to know."""
        self._without_motors: list[BodyRecord] = []
        self.waiting: set[MotorCommands] = set()
        """Bodies with motor commands that have not reached the World yet."""
        self.filters = PairFilters(self.world, self.bodies)
        self._query_shapes: QueryShapes | None = None
        self._hull_margins: Any = None
        self._spare: Any = None
        self._spare_revision = -1
        self.frames_are_old = True
        """Whether positions were written since MuJoCo last worked out the links' frames (steps leave old
        frames)."""
        self.frames_revision = self.motor_revision = -1
        """The World's revision when frames were last known, and when it last stepped."""
        self._motor_forces: Any = None
        self._wrenches_known = False

    # ------------------------------------------------------------------------------------------------ bodies

    def add(
        self,
        model: BodyModel,
        position: Any,
        orientation: Any,
        *,
        self_collision: bool = False,
        file: str = "",
        kind: int = MULTIBODY,
    ) -> BodyRecord:
        """Build a body in the World and give it an id; position and orientation are those of the base link
        frame.
        """
        body = self.world.add_description(
            model.description,
            position,
            orientation,
            fixed_base=model.fixed_base,
            self_collision=self_collision,
            drives=False,
            keep_link_order=True,
        )
        number = self._ids.take()
        record = BodyRecord(number, model, body, file=file, kind=kind)
        self.bodies[number] = record
        self.order.append(number)
        self._records_of_world[body.id] = record
        for link, state in zip(body.links, record.links, strict=True):
            link.set_friction(
                sliding=state.friction, spinning=state.spinning_friction, rolling=state.rolling_friction
            )
        self.set_damping(record, record.linear_damping, record.angular_damping)
        self._without_motors.append(record)
        self.filters.add_body(record)
        self.textures.add_body(record)
        return record

    def set_damping(self, record: BodyRecord, linear: float, angular: float) -> None:
        """Drag on every link of a body: force -m v (k + k |v|), torque -I w (k + k |w|)."""
        record.linear_damping, record.angular_damping = linear, angular
        if record.kind != MULTIBODY:
            linear = angular = 0.0
        for link, state in zip(record.body.links, record.links, strict=True):
            if state.mass > 0.0:
                self.world.surfaces.set_damping(
                    link, linear, angular, linear_quadratic=linear, angular_quadratic=angular
                )

    def free_base(self, record: BodyRecord) -> None:
        """Let a fixed base move from now on."""
        record.body.free_base()
        record.model.fixed_base = False
        self.set_damping(record, record.linear_damping, record.angular_damping)

    def set_weightless(self, record: BodyRecord, link: int, weightless: bool) -> None:
        """Whether gravity and drag leave a link of a body alone."""
        handle = record.body.links[link + 1]
        element = handle._built.element
        if bool(element.gravcomp) != weightless:
            element.gravcomp = float(weightless)
            self.world.mark_stale()
        linear, angular = (0.0, 0.0) if weightless else (record.linear_damping, record.angular_damping)
        if record.kind == MULTIBODY:
            self.world.surfaces.set_damping(
                handle, linear, angular, linear_quadratic=linear, angular_quadratic=angular
            )

    def remove(self, number: int) -> None:
        """Take a body away; an unknown id is no error."""
        record = self.bodies.pop(number, None)
        if record is None:
            return
        if record.motor_commands is not None:
            self.waiting.discard(record.motor_commands)
        for key in [key for key, held in self.constraints.items() if held.concerns(number)]:
            del self.constraints[key]
        self.textures.remove_body(record, self.world)
        self.world.remove(record.body)
        del self._records_of_world[record.body.id]
        drop_from_order(self.order, number)
        self._ids.free(number)
        if record in self._without_motors:
            self._without_motors.remove(record)
        self.efforts = {key: effort for key, effort in self.efforts.items() if key[0] != number}
        self.filters.remove_body(number)

    def of_world(self, world_body_id: int) -> BodyRecord:
        """The record of a World body."""
        return self._records_of_world[world_body_id]

    def ready(self, number: int, message: str) -> BodyRecord:
        """The record of a body, its places in MuJoCo's arrays up to date.

        Raises:
            error: with this message, for an unknown body.
        """
        record = self.bodies.get(number)
        if record is None:
            raise self.unknown_body(number, message)
        world = self.world
        if world.is_stale or record.revision != world.revision:
            world.ensure_compiled()
            record.refresh(world)
        return record

    def unknown_body(self, number: object, message: str) -> Exception:
        if not hasattr(number, "__index__"):
            return TypeError(f"a body id must be an integer, not {type(number).__name__}")
        there = ", ".join(map(str, self.order[:12])) or "none"
        return failure(message, f"there is no body {number}; bodies: {there}")

    def link(self, body: int, link: int) -> Link | None:
        """The World's link, or None."""
        record = self.bodies.get(body)
        return None if record is None else record.link(link)

    # ---------------------------------------------------------------------------------------------- queries

    def spare_data(self) -> Any:
        """MjData of the World's model for working something out aside."""
        import mujoco

        model = self.world.live_model
        if self._spare is None or self._spare_revision != self.world.revision:
            self._spare, self._spare_revision = mujoco.MjData(model), self.world.revision
        return self._spare

    def hull_margins(self) -> Any:
        """(ngeom,) by how much Bullet's shape is larger than each of MuJoCo's: hulls have a margin; m."""
        world = self.world
        if self._hull_margins is None or self._hull_margins[0] != world.revision or world.is_stale:
            world.ensure_compiled()
            cylinders: list[int] = []
            triangles: list[int] = []
            for number, record in self.bodies.items():
                rows = self.ready(number, "").rows
                if not record.model.implicit_cylinder:
                    cylinders += rows
                for row, link in zip(rows, record.model.links, strict=True):
                    if any(shape.concave for shape in link.collisions):
                        triangles.append(row)
            self._hull_margins = world.revision, margins_of_hulls(world.live_model, cylinders, triangles)
        return self._hull_margins[1]

    # -------------------------------------------------------------------------------------------------- time

    def apply_parameters(self) -> None:
        """Take over gravity and the time step."""
        p = self._parameters
        if self._applied_revision == p.revision:
            return
        self._applied_revision = p.revision
        self.world.gravity = p.gravity
        self.world.timestep = p.time_step / max(1, p.sub_steps)
        profile = self.world.profile
        slow = p.restitution_velocity_threshold
        if profile.slow != slow:
            self.world.profile = replace(profile, slow=slow)

    def give_motors(self) -> None:
        """Give new bodies the velocity motors that Bullet's joints have from the start."""
        for record in self._without_motors:
            for joint in record.body.joints:
                kind = record.joint_type(joint.index)
                impulse = DEFAULT_IMPULSE.get(kind)
                if kind == 2:
                    set_spherical_target(
                        self.world, joint, IDENTITY, DEFAULT_GAIN, [DEFAULT_IMPULSE[kind]] * 3
                    )
                elif impulse is not None:
                    self.world.motors.set(joint, velocity=0.0, max_impulse=impulse)
        self._without_motors.clear()

    @property
    def time_step(self) -> float:
        """Time that one stepSimulation advances; s"""
        return self._parameters.time_step

    def give_motors_to(self, record: BodyRecord) -> None:
        """Make sure that a body has its first motors before one of them is told something else."""
        if record in self._without_motors:
            self.give_motors()

    def motor_forces(self) -> Any:
        """(nv,) what all motors applied in the last step; N m or N."""
        if self._motor_forces is None:
            self._motor_forces = self.world.motors.forces()
        return self._motor_forces

    def joint_wrenches(self) -> Any:
        """(nbody, 6) torque and force that each body's joints carried in the last step; None before any step.

        In world axes, about the centre of mass of the body's tree.
        """
        if self.motor_revision != self.world.revision:
            return None
        if not self._wrenches_known:
            import mujoco

            mujoco.mj_rnePostConstraint(self.world.live_model, self.world.live_data)
            self._wrenches_known = True
        return self.world.live_data.cfrc_int

    def flush_motors(self) -> None:
        """Bring motor commands that wait for the next step into the World."""
        for drives in self.waiting:
            drives.flush()
        self.waiting.clear()

    def keep_applied(self, record: BodyRecord, joint: int, *, off: bool) -> None:
        """Before a motor changes: a motor that is switched off goes on reporting what it applied last."""
        if off and record.motored[joint]:
            record.applied[joint] = self.applied(record, joint)
        record.motored[joint] = not off
        (record.motors_off.add if off else record.motors_off.discard)(joint)

    def applied(self, record: BodyRecord, joint: int) -> Any:
        """What a joint's motor applied in the last step in which it was on: a number, or three."""
        if not record.motored[joint] or self.motor_revision != self.world.revision:
            return record.applied[joint]
        forces = self.motor_forces()[record.velocities_of(joint)].tolist()
        return forces[0] if len(forces) == 1 else tuple(forces)

    def add_spherical_torque(self, record: BodyRecord, joint: int, torque: Any) -> None:
        """Torque (3,) N m on a spherical joint for one step, in the child link's axes."""
        self.world.ensure_compiled()
        self.world.live_data.qfrc_applied[record.velocities_of(joint)] += torque
        self.world.wrenches.pending = True

    def step(self) -> None:
        """One step of the client's clock, in as many parts as it has sub-steps."""
        self.apply_parameters()
        world = self.world
        if self.waiting:
            self.flush_motors()
        if self._without_motors:
            world.ensure_compiled()
            self.give_motors()
        parts = max(1, self._parameters.sub_steps)
        pushes = self._pushes() if parts > 1 else None
        for part in range(parts):
            if part and pushes is not None:
                world.live_data.xfrc_applied[:], world.live_data.qfrc_applied[:] = pushes
                world.wrenches.pending = True
            for effort in self.efforts.values():
                effort()
            if self.keeps_given_torques:
                world.ensure_compiled()
                self.given_torques = world.live_data.qfrc_applied.copy()
            world.step()
        self.frames_are_old = False
        self.frames_revision = self.motor_revision = world.revision
        self._motor_forces = None
        self._wrenches_known = False

    def _pushes(self) -> tuple[Any, Any] | None:
        """Copies of what pushes on links and joints in the coming step; it lasts through all sub-steps."""
        world = self.world
        if not world.wrenches.pending:
            return None
        return world.live_data.xfrc_applied.copy(), world.live_data.qfrc_applied.copy()

    @property
    def query_shapes(self) -> QueryShapes:
        """Where shapes are put that are part of no body, made on first use."""
        if self._query_shapes is None:
            from roboyard.pybullet.state.query_shapes import QueryShapes

            self._query_shapes = QueryShapes()
        return self._query_shapes

    def release(self) -> None:
        """Free everything now: the parts refer to one another, and MuJoCo's arrays are large."""
        vars(self.world).clear()
        if self._query_shapes is not None:
            self._query_shapes.release()
        vars(self).clear()

    def frames(self, *, fresh: bool) -> Any:
        """MjData for reading link frames: as the last step left them, or worked out from the present
        positions.
        """
        world = self.world
        if fresh or self.frames_are_old or world.is_stale or self.frames_revision != world.revision:
            data = world.kinematics()
            self.frames_are_old = False
            self.frames_revision = world.revision
            return data
        return world.live_data

    def mark_moved(self) -> None:
        """Positions or velocities were written."""
        self.world.mark_moved()
        self.frames_are_old = True
