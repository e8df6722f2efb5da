"""Joint drives: each joint of one degree of freedom has a PID actuator whose gains this file sets.

The effort is kp (target - q) + kd (target velocity - v) + feedforward, clamped to the joint's effort limit
(MuJoCo's `pid` actuator). Gains that are not given follow the drive law of `roboyard.sim.actuation.gains`
with the profile `JOINT`, motor inertia included. Gains given by the user come without motor inertia (set
`Joint.armature`); so do velocity and effort drives.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.sim.actuation import gains
from roboyard.sim.actuation.drive_arrays import DriveArrays
from roboyard.sim.body import Body
from roboyard.sim.build.joints import NO_EFFORT_LIMIT
from roboyard.sim.engine import Engine
from roboyard.sim.joint import Joint


class Drives:
    """The drives of one world; users reach them through `Joint.drive_position` and its siblings."""

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world

    def position(
        self,
        joint: Joint,
        target: float,
        velocity: float,
        stiffness: float | None,
        damping: float | None,
        max_effort: float | None,
    ) -> None:
        """Drive a joint towards a position; see `Joint.drive_position`."""
        inertia, motor = self._inertia(joint), 0.0
        if stiffness is None:
            effort, is_slide = self.effort_limit(joint), joint.type == "prismatic"
            kp, usual_damping, motor_of_usual = _usual_gains(inertia, effort, is_slide)
            if damping is None:
                kd, motor = usual_damping, motor_of_usual
            else:
                kd = damping
        else:
            kp = stiffness
            kd = 2.0 * np.sqrt(max(kp, 0.0) * inertia) if damping is None else damping
        self._write(joint, kp, kd, (target, velocity, 0.0), max_effort, motor)

    def velocity(self, joint: Joint, target: float, damping: float | None, max_effort: float | None) -> None:
        """Drive a joint towards a velocity; see `Joint.drive_velocity`."""
        kd = float(gains.velocity_damping(gains.JOINT, self._inertia(joint))) if damping is None else damping
        self._write(joint, 0.0, kd, (0.0, target, 0.0), max_effort)

    def effort(self, joint: Joint, effort: float) -> None:
        """Apply an effort (N m or N); see `Joint.drive_effort`."""
        self._write(joint, 0.0, 0.0, (0.0, 0.0, effort), None)

    def disable(self, joint: Joint) -> None:
        """Switch a joint's drive off; see `Joint.disable_drive`."""
        self._write(joint, 0.0, 0.0, (0.0, 0.0, 0.0), None)

    def applied(self, joint: Joint) -> float:
        """Return the effort of the drive in the last step (N m or N)."""
        actuator = self._actuator(joint)
        self._world.ensure_compiled()
        return float(self._world.live_data.actuator_force[actuator.id])

    def set_effort_limit(self, joint: Joint, effort: float) -> None:
        """Replace the effort limit of the file (N m or N)."""
        actuator = self._actuator(joint)
        actuator.forcerange = [-effort, effort]
        if self._world.takes_numbers():
            self._world.live_model.actuator_forcerange[actuator.id] = (-effort, effort)

    def effort_limit(self, joint: Joint) -> float:
        """Return the effort limit (N m or N); infinite where the file gives none."""
        bound = float(self._actuator(joint).forcerange[1])
        return np.inf if bound >= NO_EFFORT_LIMIT else bound

    def vector(self, joints: Sequence[Joint]) -> DriveArrays:
        """Return the drives of several joints as arrays."""
        from roboyard.sim.actuation.drive_arrays import DriveArrays

        return DriveArrays(self._world, joints)

    # ------------------------------------------------------------------------------------------------------

    def _actuator(self, joint: Joint):
        actuator = joint._built.actuator
        if actuator is None:
            name = f"joint {joint.name!r} of {joint.body.name!r}"
            described = joint._built.joint
            if joint.is_scalar and (described is None or described.mimic is None):
                raise RoboyardError(
                    f"{name} has no drive in this world; set world.motors or an actuator's control"
                )
            reason = "mimics another joint" if joint.is_scalar else f"is {joint.type}"
            raise RoboyardError(f"{name} {reason} and has no drive")
        return actuator

    def _inertia(self, joint: Joint) -> float:
        self._actuator(joint)
        self._world.ensure_compiled()
        dof = joint.body.dof_addresses[joint.index]
        return float(self._world.live_model.dof_M0[dof]) - joint._built.motor_inertia

    def _write(
        self,
        joint: Joint,
        kp: float,
        kd: float,
        inputs: tuple[float, float, float],
        max_effort: float | None,
        motor_inertia: float = 0.0,
    ) -> None:
        actuator = self._actuator(joint)
        for name, value in (("stiffness", kp), ("damping", kd)):
            if not (np.isfinite(value) and value >= 0):
                raise RoboyardError(f"joint {joint.name!r}: {name} must be at least 0, got {value}")
        if not np.isfinite(inputs).all():
            raise RoboyardError(f"joint {joint.name!r}: drive target {inputs} is not finite")
        world = self._world
        world.ensure_compiled()
        if max_effort is not None:
            self.set_effort_limit(joint, abs(max_effort))
        if motor_inertia != joint._built.motor_inertia:
            self._set_motor_inertia(joint, motor_inertia)
        bias = actuator.biasprm
        bias[1], bias[2] = -kp, -kd
        actuator.biasprm = bias
        model, data, row = world.live_model, world.live_data, actuator.id
        model.actuator_biasprm[row, 1] = -kp
        model.actuator_biasprm[row, 2] = -kd
        start = model.actuator_ctrladr[row]
        data.ctrl[start : start + 3] = inputs

    def _set_motor_inertia(self, joint: Joint, value: float) -> None:
        """Replace the motor inertia of a drive (kg m² or kg), in the spec and in MuJoCo's derived values."""
        built, world = joint._built, self._world
        change, total = value - built.motor_inertia, joint.armature + value
        built.joint_elements[0].armature = total
        built.motor_inertia = value
        model, dof = world.live_model, joint.body.dof_addresses[joint.index]
        model.dof_armature[dof] = total
        model.dof_M0[dof] += change
        free = model.dof_invweight0[dof]  # diagonal of the inverse; a rank-one update (Sherman and Morrison)
        model.dof_invweight0[dof] = free / (1.0 + change * free)
        world.mark_moved()


@lru_cache(maxsize=4096)
def _usual_gains(inertia: float, effort: float, is_slide: bool) -> tuple[float, float, float]:
    """Return stiffness, damping and motor inertia of a joint by the drive law; see `gains.JOINT`."""
    per_error = gains.effort_per_error(gains.JOINT, effort, is_slide)
    kp = gains.position_stiffness(gains.JOINT, inertia, per_error, is_slide)
    motor = gains.motor_inertia(gains.JOINT, kp, inertia)
    return float(kp), float(gains.position_damping(inertia + motor, kp)), float(motor)
