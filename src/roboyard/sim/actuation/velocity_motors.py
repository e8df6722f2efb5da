"""Motors as constraints on the velocity after a step, with a bound on their force.

A motor requests the velocity v' = kp (q* - q) / dt + v + kd (v* - v) and reaches it, together with all
contacts and limits, as long as the necessary force is within its bound. In MuJoCo such a row is a joint's dry
friction with a reference velocity; the reference is written between the two halves of a step.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._lazy import lazy_module
from roboyard.errors import RoboyardError
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.joint import VELOCITY_SIZE, Joint
from roboyard.sim.link import LinkBody
from roboyard.transforms import Array, to_wxyz

kernels = lazy_module("roboyard.sim.stepping.kernels")

MODE, KP, VELOCITY, KD, LARGEST = range(5)
IMPEDANCE = (0.9999, 0.9999, 0.001, 0.5, 2.0)
SOFTNESS = 0.03
"""Factor on the compliance that this impedance leaves to a motor."""
_PACK, _PACK_TARGET = struct.Struct("5d").pack_into, struct.Struct("4d").pack_into
MOTORED = ("revolute", "continuous", "prismatic", "spherical")


def _nowhere() -> None:
    """Return None."""


class VelocityMotors:
    """The motors of one world: at most one a joint, in place of the joint's dry friction while it acts."""

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self._by_body: dict[int, BodyMotors] = {}
        self._motors = np.zeros((0, 5))
        self._targets = np.zeros((0, 4))
        self._bounds = np.zeros((0, 2))
        self.arrays = self._motors, self._targets
        """Motors (nv, 5) and targets (nv, 4) by dof, as `prepare` has arranged them."""
        self._joints: Any = ()
        """Arguments of the kernel that describe the joints."""
        self.forces_elsewhere: Callable[[], Array | None] = _nowhere
        """Returns the (nv,) efforts in the last step where MuJoCo does not have them."""
        self._bound_timestep = 0.0
        self._rate = np.zeros(1)
        """1 / time step (1/s) with which force bounds were last written."""
        self._gathered = False
        self.has_spherical = False
        """Whether any joint of the world is spherical."""

    @property
    def is_active(self) -> bool:
        """Whether any body has motors."""
        return bool(self._by_body)

    def set(
        self,
        joint: Joint,
        *,
        position: ArrayLike | None = None,
        velocity: Any = 0.0,
        kp: Any = 0.1,
        kd: Any = 1.0,
        max_force: Any = 0.0,
        max_impulse: Any = 0.0,
        max_velocity: float = 0.0,
        by_angles: bool = False,
    ) -> None:
        """Give a joint a motor, or change its target.

        Args:
            joint: of one degree of freedom, or spherical.
            position: target (rad or m), (4,) x, y, z, w for a spherical joint; None for a velocity motor.
            velocity: target (rad/s or m/s), (3,) for a spherical joint.
            kp: share of the position error corrected in a step.
            kd: share of the velocity error corrected in a step.
            max_force: bound (N m or N).
            max_impulse: bound in a step (N m s or N s), in addition.
            max_velocity: bound (rad/s or m/s); 0 for none.
            by_angles: of a spherical joint: correct roll, pitch and yaw separately, not along the shortest
                rotation.

        Raises:
            RoboyardError: a target or gain is not finite, or the joint cannot have a motor.
        """
        own = self.of(joint.body)
        start = joint.body.dof_offsets[joint.index]
        if joint.is_scalar:
            mode = 1.0 if position is None else 2.0
            target: Any = 0.0 if position is None else position
            own.set(start, mode, target, velocity, kp, kd, max_force, max_impulse, max_velocity)
            return
        motors, targets, bounds = own.motors, own.targets, own.bounds
        rows = slice(start, start + self._size(joint))
        mode = 1.0 if position is None else 3.0 if by_angles else 2.0
        if type(kp) is type(kd) is type(velocity) is float and type(position) is tuple:
            own.aim_together(range(rows.start, rows.stop), mode, position, velocity, kp, kd, max_velocity)
        else:
            motors[rows, MODE], motors[rows, KP], motors[rows, KD] = mode, kp, kd
            motors[rows, VELOCITY], motors[rows, LARGEST] = velocity, max_velocity
            if position is not None:
                targets[start] = to_wxyz(position)
            if not np.isfinite(motors[rows]).all() or not np.isfinite(targets[rows]).all():
                raise RoboyardError(
                    f"joint {joint.name!r}: a motor's target and gains must be finite, got {motors[rows]}"
                )
        before = bounds[rows].tolist()
        bounds[rows, 0], bounds[rows, 1] = max_force, max_impulse
        if bounds[rows].tolist() != before:
            self.bounds_changed(joint.body, rows)

    def clear(self, joint: Joint) -> None:
        """Remove a joint's motor."""
        own = self.of(joint.body)
        start = joint.body.dof_offsets[joint.index]
        rows = slice(start, start + self._size(joint))
        own.motors[rows] = 0.0
        own.bounds[rows] = 0.0
        self.bounds_changed(joint.body, rows)

    def applied(self, joint: Joint) -> Array:
        """Return the efforts (n,) of a joint's motor in the last step (N m or N), n degrees of freedom."""
        return self.forces()[joint.dof_slice]

    def forces(self) -> Array:
        """Return the efforts (nv,) of all motors in the last step (N m or N)."""
        elsewhere = self.forces_elsewhere()
        if elsewhere is not None:
            return elsewhere
        data = self._world.live_data
        out = np.zeros(self._world.live_model.nv)
        if data.nf:
            kernels().motor_forces(data.efc_type, data.efc_id, data.efc_force, data.ne, data.nf, out)
        return out

    # -------------------------------------------------------------------------------------------- in a step

    def prepare(self, model: Any, timestep: float) -> None:
        """Write force bounds into MuJoCo's dry friction, before the first half of a step."""
        if not self._gathered:
            self._gather(model)
        if timestep != self._bound_timestep:
            driven = self._motors[:, MODE] > 0
            model.dof_frictionloss[driven] = self._bounds[driven] @ (1.0, 1.0 / timestep)
            self._bound_timestep, self._rate[0] = timestep, 1.0 / timestep

    def is_prepared(self, timestep: float) -> bool:
        """Return whether `prepare` has nothing to do."""
        return self._gathered and timestep == self._bound_timestep

    def apply(self, data: Any, timestep: float, *, alone: bool = False) -> None:
        """Write requested accelerations into the motors' rows, between the halves of a step.

        Args:
            data: MjData.
            timestep: duration of the step (s).
            alone: whether all rows are solved in turn, which reads the references of spherical joints only.
        """
        count = data.nf
        if count == 0 or (alone and not self.has_spherical):
            return
        motors, targets, dof_joint, types, qpos_places, dof_places, qpos, qvel = self._joints
        kernels().drive_motors(
            motors,
            targets,
            dof_joint,
            types,
            qpos_places,
            dof_places,
            qpos,
            qvel,
            data.efc_type,
            data.efc_id,
            data.ne,
            count,
            timestep,
            SOFTNESS,
            data.efc_aref,
            data.efc_R,
            data.efc_D,
            data.map_efc2iefc,
            data.iefc_R,
            data.iefc_D,
        )

    # ----------------------------------------------------------------------------------------- book-keeping

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new."""
        self._gathered = False

    def forget(self, body_id: int) -> None:
        """Remove the motors of a body that is removed."""
        own = self._by_body.pop(body_id, None)
        if own is not None:  # its rows may remain inactive
            own.motors[:] = own.bounds[:] = 0.0

    def _size(self, joint: Joint) -> int:
        if joint.type not in MOTORED:
            raise RoboyardError(f"joint {joint.name!r} is {joint.type} and cannot have a motor")
        return VELOCITY_SIZE[joint.type]

    def of(self, body: LinkBody) -> BodyMotors:
        """Return the motors of one body."""
        found = self._by_body.get(body.id)
        if found is None:
            found = self._by_body[body.id] = BodyMotors(self, body)
            self._gathered = self._gathered and not self._world.is_stale
            if self._gathered:
                self._place(self._world.live_model, body, found)
                self._bound_timestep = 0.0
            self._world.refresh_stepping()
        return found

    def drop_prepared(self) -> None:
        """Note that arrays of a body's motors were replaced."""
        self._world.drop_prepared()

    def bound_places(self, body: LinkBody, bounds: Array) -> tuple[Array, Array, Array]:
        """Return where the bounds of a body's motors are written while MuJoCo's arrays are the same.

        Args:
            body: whose motors.
            bounds: its rows of the world's.

        Returns:
            (n, 2) bounds in force and impulse, (n,) dry frictions, impulses times (1,) rate (1/s). Frictions
            of driven motors that have another time step by the next step are written then.
        """
        if not self._gathered or self._world.is_stale:
            return bounds, np.zeros(len(bounds)), self._rate
        first = body.first_dof
        return bounds, self._world.live_model.dof_frictionloss[first : first + len(bounds)], self._rate

    def bounds_changed(self, body: LinkBody, rows: slice) -> None:
        """Copy force bounds that were written to some of a body's rows to MuJoCo."""
        world = self._world
        if self._gathered and world.takes_numbers():
            first = body.first_dof
            here = slice(first + rows.start, first + rows.stop)
            model = world.live_model
            model.dof_frictionloss[here] = self._bounds[here] @ (1.0, 1.0 / model.opt.timestep)

    def _gather(self, model: Any) -> None:
        """Arrange all bodies' rows like MuJoCo's dofs; bodies keep views, so that they write in place."""
        nv = model.nv
        self._motors, self._targets = np.zeros((nv, 5)), np.zeros((nv, 4))
        self._bounds = np.zeros((nv, 2))
        self.arrays = self._motors, self._targets
        for body_id, own in self._by_body.items():
            self._place(model, self._world.body_by_id[body_id], own)
        data = self._world.live_data
        self._joints = (
            *(self._motors, self._targets, model.dof_jntid, model.jnt_type, model.jnt_qposadr),
            *(model.jnt_dofadr, data.qpos, data.qvel),
        )
        self._bound_timestep = 0.0
        self._gathered = True
        self.has_spherical = bool((model.jnt_type == 1).any())

    def _place(self, model: Any, body: LinkBody, own: BodyMotors) -> None:
        here = slice(body.first_dof, body.first_dof + len(own.motors))
        own.move_to(self._motors[here], self._targets[here], self._bounds[here])
        model.dof_solimp[here] = IMPEDANCE


class BodyMotors:
    """The motors of one body, by dof among its joints' dofs; scripts set all of them in every step."""

    __slots__ = ("_all", "_body", "_buffer", "_goals", "_target_memory", "bounds", "motors", "targets")

    def __init__(self, every: VelocityMotors, body: LinkBody) -> None:
        count = body.joint_dofs
        self._all, self._body = every, body
        self.move_to(np.zeros((count, 5)), np.zeros((count, 4)), np.zeros((count, 2)))

    def move_to(self, motors: Array, targets: Array, bounds: Array) -> None:
        """Move the rows into given arrays, views of the world's.

        Args:
            motors: (n, 5) mode, kp, velocity, kd, largest velocity of n dofs.
            targets: (n, 4) positions; quaternions w, x, y, z of spherical joints.
            bounds: (n, 2) force and impulse.
        """
        if hasattr(self, "motors"):
            motors[:], targets[:], bounds[:] = self.motors, self.targets, self.bounds
        self.motors, self.targets, self.bounds = motors, targets, bounds
        self._all.drop_prepared()
        self._buffer = motors.reshape(-1).data if motors.size else memoryview(bytearray())
        self._goals = (
            targets.reshape(-1).data.cast("B").cast("d") if targets.size else memoryview(b"").cast("d")
        )
        self._target_memory = targets.reshape(-1).data if targets.size else memoryview(bytearray())

    def set(
        self,
        row: int,
        mode: float,
        target: float,
        velocity: float,
        kp: float,
        kd: float,
        max_force: float,
        max_impulse: float,
        max_velocity: float,
    ) -> None:
        """Set the motor of a joint of one dof: mode 1 velocity, 2 position; see `VelocityMotors.set`."""
        self.aim(row, mode, target, velocity, kp, kd, max_velocity)
        self.bound(row, max_impulse, max_force)

    def aim(
        self,
        row: int,
        mode: float,
        target: float,
        velocity: float,
        kp: float,
        kd: float,
        max_velocity: float,
    ) -> None:
        """Set the target and gains of a motor without its force bound; see `set`."""
        total = target + velocity + kp + kd + max_velocity
        if total - total != 0.0:  # inf and nan alike
            raise RoboyardError(
                f"body {self._body.name!r}: a motor's target and gains must be finite, got {total}"
            )
        _PACK(self._buffer, row * 40, mode, kp, velocity, kd, max_velocity)
        if mode == 2.0:
            self._goals[4 * row] = target

    def aim_together(
        self,
        rows: range,
        mode: float,
        target: tuple[float, ...],
        velocity: float,
        kp: float,
        kd: float,
        max_velocity: float,
    ) -> None:
        """Set the motor of a spherical joint but for its bounds, its target (4,) x, y, z, w; see `set`."""
        x, y, z, w = target
        total = x + y + z + w + velocity + kp + kd + max_velocity
        if total - total != 0.0:
            raise RoboyardError(
                f"body {self._body.name!r}: a motor's target and gains must be finite, got {total}"
            )
        for row in rows:
            _PACK(self._buffer, row * 40, mode, kp, velocity, kd, max_velocity)
        _PACK_TARGET(self._target_memory, rows.start * 32, w, x, y, z)

    def bound(self, row: int, max_impulse: float, max_force: float = 0.0) -> None:
        """Bound a motor by its impulse in a step (N m s or N s) and its force (N m or N) in addition."""
        bounds = self.bounds
        if bounds[row, 0] != max_force or bounds[row, 1] != max_impulse:
            bounds[row] = max_force, max_impulse
            self._all.bounds_changed(self._body, slice(row, row + 1))

    def bound_places(self) -> tuple[Array, Array, Array]:
        """Return (n, 2) bounds, (n,) dry frictions and the (1,) rate; see `VelocityMotors.bound_places`."""
        return self._all.bound_places(self._body, self.bounds)

    def set_bounds(self, rows: np.ndarray, max_impulse: Array) -> None:
        """Bound several motors by their impulse in a step.

        Args:
            rows: (k,) dofs.
            max_impulse: (k,) bounds (N m s or N s).
        """
        self.bounds[rows, 0] = 0.0
        self.bounds[rows, 1] = max_impulse
        self._all.bounds_changed(self._body, slice(int(rows.min()), int(rows.max()) + 1))
