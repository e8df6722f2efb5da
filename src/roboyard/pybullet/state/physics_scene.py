"""The world of one client: its constraints, saved states, motors and time steps."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.bullet_rules.picture_light import SolidScene
from roboyard.pybullet.bullet_rules.spherical_motors import DEFAULT_GAIN, IDENTITY, set_spherical_target
from roboyard.pybullet.state.bodies.body_records import DEFAULT_IMPULSE, BodyRecord
from roboyard.pybullet.state.constraint_records import ConstraintRecord
from roboyard.pybullet.state.contacts import Contact, LastStep
from roboyard.pybullet.state.engine_parameters import (
    CONTACT_ERP,
    DANTZIG,
    ERP,
    PAIRS_BY_ENTRY,
    RESIDUAL,
    SOLVER,
    EngineParameters,
)
from roboyard.pybullet.state.ids import Counter, IdPool
from roboyard.pybullet.state.scene_bodies import SceneBodies
from roboyard.sim.physics_profile import BULLET

if TYPE_CHECKING:
    from roboyard.pybullet.state.reactions.joint_reactions import JointWrenches, WrenchFinder


class PhysicsScene(SceneBodies):
    """Bodies, constraints and states by id, and stepping."""

    def __init__(self, parameters: EngineParameters, first_texture: int = 0) -> None:
        """Create an empty world.

        Args:
            parameters: settings of the client, applied before each step.
            first_texture: id of the first texture.
        """
        super().__init__(parameters, first_texture)
        self._applied_revision = -1
        self.constraint_ids = Counter(1)
        self.world.constraints.before_entering = self.build_requested
        self.world.constraints.before_reuse = self._keep_wrenches
        self.states: dict[int, Any] = {}
        self.state_contacts: dict[int, tuple[Contact, ...]] = {}
        """Contacts of saved states, where they have any."""
        self.state_ids = IdPool()
        self.solid = SolidScene()
        self.records_user_torques = False
        self.user_torques: Any = None
        """(nv,) joint torques (N m) or forces (N) of scripts in the last step, if a log records them."""
        self._scratch: Any = None
        self.scratch_arrays: tuple[Any, ...] = ()
        """Positions, velocities and accelerations of `scratch_data`."""
        self._scratch_revision = -1
        self.last_step = LastStep(self)
        self.world.before_edit = self.last_step.keep
        self._motor_forces: Any = None
        self.parts = 1
        """Parts of the last step. Impulses of the last part are reported over the time of the whole step."""
        self._wrenches: JointWrenches | None = None
        self._wrench_finder: WrenchFinder | None = None

    @property
    def constraints(self) -> dict[int, ConstraintRecord]:
        """Constraints by id, in the order they were created."""
        if self.requested:
            self.build_requested()
        return self._constraints

    def build_requested(self) -> None:
        """Build the constraints that were only requested."""
        if not self.requested:
            return
        from roboyard.pybullet.state.constraint_building import requested_constraint

        requested = dict(self.requested)
        self.requested.clear()
        for number, request in requested.items():
            self._constraints[number] = requested_constraint(self, number, request)

    # ---------------------------------------------------------------------------------------------- queries

    def scratch_data(self) -> Any:
        """Return MjData of the World's model for computations that do not change the World."""
        from roboyard._mujoco import mujoco

        model = self.world.live_model
        if self._scratch is None or self._scratch_revision != self.world.revision:
            data = mujoco.MjData(model)
            self._scratch, self._scratch_revision = data, self.world.revision
            self.scratch_arrays = data.qpos, data.qvel, data.qacc
        return self._scratch

    def apply_parameters(self) -> None:
        """Apply gravity and the time step to the World."""
        p = self.parameters
        if self._applied_revision == p.revision:
            return
        if self.requested:  # their bounds depend on the time step
            self.build_requested()
        self._applied_revision = p.revision
        self.world.gravity = p.gravity
        timestep = p.time_step / max(1, p.sub_steps)
        if p.time_step > 0 and timestep != self.world.timestep:
            self.world.timestep = timestep
            if self._constraints:
                from roboyard.pybullet.state.constraint_building import bound_again

                bound_again(self, self._constraints.values())
        solver, profile = self.world.stepping.in_turn, self.world.profile
        if profile.motor_rounds:
            rounds = 0 if p.others.get(SOLVER) == DANTZIG else max(p.iterations, 1)
            solver.set_rounds(rounds, p.others.get(RESIDUAL, profile.motor_residual))
            solver.sort_pairs(bool(p.others.get(PAIRS_BY_ENTRY)))
            solver.limit_friction(singly=not p.cone_friction)
        slow = p.restitution_velocity_threshold
        erp, contact_erp = p.others.get(ERP, BULLET.erp), p.others.get(CONTACT_ERP, BULLET.contact_erp)
        if (profile.slow, profile.erp, profile.contact_erp) != (slow, erp, contact_erp):
            self.world.profile = replace(profile, slow=slow, erp=erp, contact_erp=contact_erp)

    def add_default_motors(self) -> None:
        """Add Bullet's default velocity motors to new bodies."""
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
        """Time that one stepSimulation advances (s)."""
        return self.parameters.time_step

    def ensure_default_motors(self, record: BodyRecord) -> None:
        """Add a body's default motors before one of them is changed."""
        if record in self._without_motors:
            self.add_default_motors()

    def motor_forces(self) -> Any:
        """Return the (nv,) torques (N m) or forces (N) of all motors in the last step.

        They are impulses of the last part of the step over the whole step, as in PyBullet.
        """
        if self._motor_forces is None:
            forces = self.world.stepping.forces.motor_forces()
            self._motor_forces = forces / self.parts if self.parts > 1 else forces
        return self._motor_forces

    def joint_wrenches(self) -> JointWrenches | None:
        """Return the forces and torques in joints in the last step; None before."""
        if self.motor_revision != self.world.revision:
            return None
        if self._wrenches is None:
            finder = self._wrench_finder
            if finder is None or not finder.is_current:
                from roboyard.pybullet.state.reactions.joint_reactions import WrenchFinder

                finder = self._wrench_finder = WrenchFinder(self.world)
            self._wrenches = finder.find()
        return self._wrenches

    def _keep_wrenches(self) -> None:
        """Compute reactions of the last step while MuJoCo's arrays have its constraints."""
        if self.has_sensors:
            self.joint_wrenches()

    def flush_motors(self) -> None:
        """Apply pending motor commands to the World."""
        for drives in self.pending_commands:
            drives.flush()
        self.pending_commands.clear()

    def switch_motor(self, record: BodyRecord, joint: int, *, off: bool) -> None:
        """Switch a motor on or off in the record; when off, it keeps reporting its last torque."""
        if off and record.motored[joint]:
            record.applied[joint] = self.applied(record, joint)
        record.motored[joint] = not off
        (record.motors_off.add if off else record.motors_off.discard)(joint)

    def applied(self, record: BodyRecord, joint: int) -> Any:
        """Return the last torque (N m) or force (N) of a motor: one number, or three."""
        stepped = self.motor_revision
        if not record.motored[joint] or not stepped == self.world.revision == record.revision:
            return record.applied[joint]
        forces = self.motor_forces()[record.velocities_of(joint)].tolist()
        return forces[0] if len(forces) == 1 else tuple(forces)

    def add_spherical_torque(self, record: BodyRecord, joint: int, torque: Any) -> None:
        """Apply a (3,) torque (N m, child link axes) to a spherical joint for one step."""
        self.world.ensure_compiled()
        self.world.live_data.qfrc_applied[record.velocities_of(joint)] += torque
        self.world.wrenches.pending = True

    def step(self) -> None:
        """Advance by one time step, divided into the client's substeps; as in PyBullet by none that is not
        positive.
        """
        parameters, world = self.parameters, self.world
        if parameters.time_step <= 0:
            return
        if self.new_bodies:
            self.note_boxes()
        if self.requested:
            self.build_requested()
        if self._applied_revision != parameters.revision:
            self.apply_parameters()
        if self.pending_commands:
            self.flush_motors()
        if self._without_motors:
            world.ensure_compiled()
            self.add_default_motors()
        parts = self.parts = parameters.sub_steps if parameters.sub_steps > 1 else 1
        if parts > 1 or self.spring_dampers or self.records_user_torques:
            self._step_in_parts(parts)
        else:
            world.step()
        self._note_step()

    def end_step(self, answer: int) -> None:
        """Do what `step` does after the compiled loop of `World.direct_step`, which returned this answer."""
        self.world.end_directly(answer)
        self._note_step()

    def _note_step(self) -> None:
        self.frames_are_old = self.boxes_are_old = False
        self.step_count += 1.0
        self.single_reads = 0
        self.frames_revision = self.motor_revision = self.world.revision
        self.last_step.drop()
        self._motor_forces = None
        self._wrenches = None

    @property
    def knows_parameters(self) -> bool:
        """Whether the next step has the settings of the last one, and there is a time to advance by."""
        parameters = self.parameters
        return self._applied_revision == parameters.revision and parameters.time_step > 0

    def _step_in_parts(self, parts: int) -> None:
        """Advance by one time step, with what scripts have acting in each of its parts."""
        world = self.world
        world.make_ready(parts)
        applied = self._applied_forces() if parts > 1 else None
        speeds = self._damped_speeds() if parts > 1 else None
        for part in range(parts):
            if part and applied is not None:
                world.live_data.xfrc_applied[:], world.live_data.qfrc_applied[:] = applied
                world.wrenches.find()
            if part and speeds is not None:
                data = world.live_data
                data.qfrc_applied[:] += world.live_model.dof_damping * (data.qvel - speeds)
                world.wrenches.pending = True
            for effort in self.spring_dampers.values():
                effort()
            if self.records_user_torques:
                world.ensure_compiled()
                self.user_torques = world.live_data.qfrc_applied.copy()
            world.step_ready()

    def _damped_speeds(self) -> Any:
        """Return the (nv,) velocities that joint damping is of in the whole step; None without any."""
        return self.world.live_data.qvel.copy() if self.world.live_model.dof_damping.any() else None

    def _applied_forces(self) -> tuple[Any, Any] | None:
        """Return copies of the forces on links and joints, for the later substeps of a step."""
        world = self.world
        if not world.wrenches.pending:
            return None
        return world.live_data.xfrc_applied.copy(), world.live_data.qfrc_applied.copy()

    def release(self) -> None:
        """Free everything: the parts reference each other, and MuJoCo's arrays are large."""
        self.world.release()
        self.shapes.release()
        vars(self).clear()
