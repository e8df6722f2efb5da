"""The bodies of one client and their World."""

from __future__ import annotations

from collections.abc import KeysView
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import Inertial
from roboyard.pybullet.bullet_rules.models import IMMOVABLE_MASS, BodyModel, never_turns
from roboyard.pybullet.bullet_rules.motor_commands import MotorCommands
from roboyard.pybullet.face.constants import JOINT_REVOLUTE
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.bodies.body_records import MULTIBODY, BodyRecord
from roboyard.pybullet.state.constraint_records import ConstraintRecord, ConstraintRequest
from roboyard.pybullet.state.contacts import LastStep
from roboyard.pybullet.state.engine_parameters import (
    TIME_STEP,
    EngineParameters,
)
from roboyard.pybullet.state.ids import IdPool, drop_from_order
from roboyard.pybullet.state.pair_filters import NO_SELF_COLLISIONS, PairFilters, SelfCollisions
from roboyard.pybullet.state.scene_shapes import SceneShapes
from roboyard.pybullet.state.textures import Textures
from roboyard.sim.link import Link
from roboyard.sim.mujoco_library import stop_timers
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.world import World
from roboyard.transforms import conjugate, rotate

if TYPE_CHECKING:
    from roboyard.pybullet.state.bodies.body_records import SceneBoxes
    from roboyard.sim.body import Body
    from roboyard.sim.pool.lone_bodies import LoneBody

HELD_INERTIA = 1e18
"""Inertia (kg m² or kg) of the motor of a joint that nothing moves."""

FEW_POSES, POSES_OF_A_BODY = 500, 16
"""Poses that can be set without MuJoCo's arrays while one compile takes, and more of them for each body."""


class SceneBodies:
    """Bodies and shapes by id."""

    last_step: LastStep
    """Contacts, efforts and reactions of the last step, once the world has changed since."""

    def __init__(self, parameters: EngineParameters, first_texture: int) -> None:
        """Create an empty world.

        Args:
            parameters: settings of the client, applied before each step.
            first_texture: id of the first texture.
        """
        stop_timers()
        self.parameters = parameters
        """Settings of the client."""
        self.world = World(
            gravity=parameters.gravity,
            timestep=parameters.time_step if parameters.time_step > 0 else TIME_STEP,
            profile=BULLET,
            visual_geoms=False,
        )
        self.world.keeps_frames = self.world.is_kept = True
        self.bodies: dict[int, BodyRecord] = {}
        self.order: list[int] = []
        """Body ids in the order of getBodyUniqueId."""
        self._ids = IdPool()
        self._records_by_world_id: dict[int, BodyRecord] = {}
        self.collision_shapes: dict[int, Any] = {}
        self.visual_shapes: dict[int, Any] = {}
        self.collision_ids, self.visual_ids = IdPool(), IdPool()
        self._constraints: dict[int, ConstraintRecord] = {}
        self.requested: dict[int, ConstraintRequest] = {}
        """Constraints of machine code that are not built yet, by id; one that is removed before never is."""
        self.constraint_order: list[int] = []
        """Ids of all constraints, in the order of getConstraintUniqueId."""
        self.textures = Textures(first_texture)
        self.spring_dampers: dict[tuple[int, int], Any] = {}
        """PD_CONTROL torques by body and joint, computed before each step."""
        self._without_motors: list[BodyRecord] = []
        self.pending_commands: set[MotorCommands] = set()
        """Motor commands of bodies that are not applied to the World yet."""
        self.with_sensors: set[int] = set()
        """Bodies with force-torque sensors."""
        self.filters = PairFilters(self.world, self.bodies)
        self.shapes = SceneShapes(self.world, self._records_by_world_id, self.filters)
        self.new_bodies: dict[int, BodyRecord] = {}
        """Bodies by number whose boxes are still those in which Bullet added their links."""
        self.link_boxes: tuple[int, SceneBoxes] | None = None
        """Revision of the World, and boxes around the links of all bodies."""
        self.frames_are_old = True
        """Whether the links of all bodies are shown where they are now (steps keep old frames)."""
        self.boxes_are_old = False
        """Whether bodies were placed since the last step."""
        self.step_count = np.zeros(1)
        """Number of steps, with which `BodyRecord.shown` is compared."""
        self._awaiting = 0, 0
        """Number of bodies, and how many poses were set or read since, while a compile is awaited."""
        self.single_reads = 0
        """Reads of single links since the frames of all were computed."""
        self.frames_revision = self.motor_revision = -1
        """Revision of the World when frames were last computed, and when it last stepped."""

    def add(
        self,
        model: BodyModel,
        position: Any,
        orientation: Any,
        *,
        self_collisions: SelfCollisions = NO_SELF_COLLISIONS,
        file: str = "",
        kind: int = MULTIBODY,
    ) -> BodyRecord:
        """Add a body to the World and return its record.

        Args:
            model: masses, links and joints as Bullet has them.
            position: position of the base link frame (m).
            orientation: orientation of the base link frame (x, y, z, w).
            self_collisions: which links of the body collide with each other.
            file: file that it was loaded from.
            kind: MULTIBODY or RIGID_BODY.
        """
        before = self.world.revision
        if len(model.links) > 1 or self.has_sensors:
            self.last_step.keep()  # else the arrays of the last step stay as they are
        body = self.world.add_description(
            model.description,
            position,
            orientation,
            fixed_base=model.fixed_base,
            self_collision=self_collisions.are_on,
            drives=False,
            keep_link_order=True,
        )
        self._follow(before)
        record = self.enter(model, body, file=file, kind=kind)
        record.first_pose = *position, *orientation
        self.new_bodies[record.number] = record
        for link, state in zip(body.links, record.links, strict=True):
            link.set_friction(
                sliding=state.friction, spinning=state.spinning_friction, rolling=state.rolling_friction
            )
            if state.is_anchored:
                self.world.surfaces.set_anchor(link, is_anchored=True)
            if state.contact_stiffness >= 0.0:
                self.world.surfaces.set_compliance(
                    link, state.contact_stiffness, max(state.contact_damping, 0.0)
                )
        self.set_damping(record, record.linear_damping, record.angular_damping)
        self.hold_massless_joints(record)
        self._without_motors.append(record)
        self.filters.add_body(record, self_collisions)
        self.textures.add_body(record)
        return record

    def _follow(self, before: int) -> None:
        """Note that arrays of the last step, at that revision of the World, still hold it."""
        world = self.world
        if self.motor_revision == before and not world.is_stale:
            self.motor_revision = world.revision

    def enter(self, model: BodyModel, body: Body, *, file: str, kind: int = MULTIBODY) -> BodyRecord:
        """Return the record, with a new id, of a body that is in the World; see `add` for the arguments."""
        number = self._ids.take()
        record = BodyRecord(number, model, body, file=file, kind=kind)
        self.bodies[number] = record
        self.order.append(number)
        self._records_by_world_id[body.id] = record
        for index, link in enumerate(model.links[1:]):
            joint = link.joint
            if joint is not None and joint.axis_length != 1.0 and joint.type in ("revolute", "continuous"):
                self.world.long_axes[body.id, index] = joint.axis_length
        return record

    def set_damping(self, record: BodyRecord, linear: float, angular: float) -> None:
        """Set the damping of every link: force -m v (k + k |v|) (N), torque -I w (k + k |w|) (N m)."""
        record.linear_damping, record.angular_damping = linear, angular
        if record.kind != MULTIBODY:
            linear = angular = 0.0
        elif len(record.links) == 1 and never_turns(record.links[0].moments):
            angular = 0.0
        for link, state in zip(record.body.links, record.links, strict=True):
            if state.mass > 0.0:
                self.world.surfaces.set_damping(
                    link, linear, angular, linear_quadratic=linear, angular_quadratic=angular
                )

    def hold_massless_joints(self, record: BodyRecord) -> None:
        """Hold joints beyond which nothing has mass, as in Bullet: neither forces nor motors move them.

        The same holds for a hinge that carries one link only, without inertia about the axis and with its
        centre of mass on it.
        """
        links = record.links[1:]
        if record.kind != MULTIBODY or not (
            record.held or any(state.mass == 0.0 or never_turns(state.moments) for state in links)
        ):
            return
        masses = [state.mass for state in links]
        for index in range(len(masses) - 1, -1, -1):
            parent = record.model.links[index + 1].parent
            if parent >= 0:
                masses[parent] += masses[index]
            joint = record.body.joints[index]
            is_held = masses[index] == 0.0 or (
                masses[index] == links[index].mass and _is_on_axis(record, index)
            )
            if is_held and index not in record.held:
                record.held[index] = joint.armature
                joint.armature = HELD_INERTIA
            elif not is_held and index in record.held:
                joint.armature = record.held.pop(index)

    def free_base(self, record: BodyRecord) -> None:
        """Make a fixed base movable."""
        record.body.free_base()
        record.model.fixed_base = False
        self.set_damping(record, record.linear_damping, record.angular_damping)

    def carry_base(self, record: BodyRecord) -> None:
        """Let a fixed base have a velocity, which nothing changes; it touches no other fixed base."""
        record.body.free_base()
        self.filters.take_for_static(record.number)
        self.disable_gravity(record, -1, True)
        heavy = (IMMOVABLE_MASS, 0.0, 0.0, IMMOVABLE_MASS, 0.0, IMMOVABLE_MASS)
        record.body.links[0].set_inertial(
            Inertial(mass=IMMOVABLE_MASS, origin=record.links[0].frame, inertia=heavy)
        )

    def disable_gravity(self, record: BodyRecord, link: int, disabled: bool) -> None:
        """Disable (or enable) gravity and damping of a link."""
        handle = record.body.links[link + 1]
        handle.set_gravity_share(float(not disabled))
        linear, angular = (0.0, 0.0) if disabled else (record.linear_damping, record.angular_damping)
        if record.kind == MULTIBODY:
            self.world.surfaces.set_damping(
                handle, linear, angular, linear_quadratic=linear, angular_quadratic=angular
            )

    def remove(self, number: int) -> None:
        """Remove a body; an unknown id is ignored."""
        if number not in self.bodies:
            return
        record, before = self.bodies[number], self.world.revision
        if record.joint_count or len(record.links) > 1 or self.last_step.involves(record):
            self.last_step.keep()
        del self.bodies[number]
        self.last_step.remove_body(number)
        if record.motor_commands is not None:
            self.pending_commands.discard(record.motor_commands)
        lost = {key for key, held in self._constraints.items() if held.involves(number)}
        lost.update(key for key, request in self.requested.items() if number in (request[0], request[2]))
        for key in [key for key in reversed(self.constraint_order) if key in lost]:
            del (self.requested if key in self.requested else self._constraints)[key]
            drop_from_order(self.constraint_order, key)
        self.textures.remove_body(record, self.world)
        self.new_bodies.pop(number, None)
        self.world.remove(record.body)
        self._follow(before)
        del self._records_by_world_id[record.body.id]
        drop_from_order(self.order, number)
        self._ids.free(number)
        self.with_sensors.discard(number)
        if record in self._without_motors:
            self._without_motors.remove(record)
        self.spring_dampers = {key: effort for key, effort in self.spring_dampers.items() if key[0] != number}
        self.filters.remove_body(number)

    def note_boxes(self, number: int | None = None) -> None:
        """Note that the boxes of a new body, or of all, are from now on those around its shapes."""
        if number is None:
            self.new_bodies.clear()
        elif self.new_bodies.pop(number, None) is None:
            return
        self.link_boxes = None
        self.world.prepared.get("overlaps", {}).clear()

    def world_ids(self) -> KeysView[int]:
        """Return the World's ids of all bodies that scripts have."""
        return self._records_by_world_id.keys()

    def records(self) -> dict[int, BodyRecord]:
        """Return the records of all bodies by their ids in the World, as they are now."""
        return self._records_by_world_id.copy()

    def record_of(self, world_body_id: int) -> BodyRecord:
        """Return the record of a World body id."""
        return self._records_by_world_id[world_body_id]

    def ready(self, number: int, message: str) -> BodyRecord:
        """Return the record of a body, with current indices in MuJoCo's arrays.

        Raises:
            error: with `message`; the body does not exist.
        """
        record = self.bodies.get(number)
        if record is None:
            raise self.unknown_body(number, message)
        world = self.world
        if world.is_stale or record.revision != world.revision:
            world.ensure_compiled()
            record.refresh(world)
        return record

    def readable(self, number: int, message: str) -> BodyRecord:
        """Return the record of a body, whose joints and base alone are read or set.

        It needs no compile: a new body may be alone, and others have their rows until the next compile.

        Raises:
            error: with `message`; the body does not exist.
        """
        record, world = self.bodies.get(number), self.world
        if record is None or not world.is_stale or record.sensors or record.soft is not None:
            return self.ready(number, message)
        has_rows = record.revision == world.revision and record.body.mujoco_ids[0] > 0
        return record if has_rows or self.alone(record) is not None else self.ready(number, message)

    def compile_for_poses(self) -> None:
        """Compile what is awaited once that takes less time than it did to set or read poses without it."""
        bodies, count = self._awaiting
        self._awaiting = len(self.bodies), count + 1 if bodies == len(self.bodies) else 0
        if count > FEW_POSES + POSES_OF_A_BODY * bodies:
            self._awaiting = 0, 0
            self.world.ensure_compiled()

    def alone(self, record: BodyRecord) -> LoneBody | None:
        """Return a new body, with current indices in arrays of it alone; None where it is in the World."""
        if not self.world.is_stale or record.sensors or record.soft is not None:
            return None
        lone = self.world.lone_body(record.body)
        if lone is not None:
            record.refresh_alone(lone)
        return lone

    def has_awaited_frames(self, record: BodyRecord) -> bool:
        """Compute the link frames of a body that a compile is awaited for but does not move.

        Returns:
            Whether the World's arrays have them now.
        """
        world = self.world
        if not world.is_stale or record.revision != world.revision or record.body.mujoco_ids[0] <= 0:
            return False
        if record.soft is not None or world.awaited_frames() is None:
            return False
        self.single_reads, self.frames_are_old, self.frames_revision = 0, False, world.revision
        return True

    def unknown_body(self, number: object, message: str) -> Exception:
        """Return the error for a body id that does not exist."""
        if not hasattr(number, "__index__"):
            return TypeError(f"a body id must be an integer, not {type(number).__name__}")
        there = ", ".join(map(str, self.order[:12])) or "none"
        return failure(message, f"there is no body {number}; bodies: {there}")

    def link(self, body: int, link: int) -> Link | None:
        """Return the World's link, or None."""
        record = self.bodies.get(body)
        return None if record is None else record.link(link)

    @property
    def has_sensors(self) -> bool:
        """Whether any joint has a force-torque sensor."""
        return bool(self.with_sensors)

    def frames(self, *, fresh: bool) -> Any:
        """Return MjData with link frames: of the last step or, with `fresh`, current ones.

        With `fresh`, those of the last step are in `kept_frames`, where bodies still show these.
        """
        world = self.world
        if self.frames_are_old or world.is_stale or self.frames_revision != world.revision:
            data = world.link_frames(keeps_last=False)
            self.single_reads = 0
            world.kept_frames = None
            self.frames_are_old = False
            self.frames_revision = world.revision
            return data
        if fresh and world.is_moved:
            self.single_reads = 0
            return world.link_frames(keeps_last=True)
        return world.live_data

    def is_shown(self, record: BodyRecord) -> bool:
        """Return whether the links of a body are shown where they are now."""
        return self.frames_are_old or record.shown.item(0) == self.step_count.item(0)

    def mark_moved(self) -> None:
        """Note that positions or velocities were written, of bodies that are not known."""
        self.world.mark_moved()
        self.frames_are_old = True

    def mark_placed(self, record: BodyRecord) -> None:
        """Note that a script placed a body: its links are from now on shown where they are."""
        record.shown[:] = self.step_count
        self.boxes_are_old = True


def _is_on_axis(record: BodyRecord, joint: int) -> bool:
    """Return whether a hinge's link has no inertia about its axis."""
    state, info = record.links[joint + 1], record.infos[joint]
    if info[2] != JOINT_REVOLUTE:
        return False
    axis = np.asarray(info[13])
    arm = rotate(conjugate(state.frame.quaternion), state.frame.position)
    about = axis**2 @ np.asarray(state.moments) + state.mass * np.sum(np.cross(axis, arm) ** 2)
    return never_turns((about, about, about))
