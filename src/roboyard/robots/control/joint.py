"""JointController: positions, velocities or efforts of joints, as they are or as changes.

    position   u = r, which runs from the joint's position to q* with speeds up to v_max and accelerations
    up to
               min(v_max / 0.2 s, 0.4 E / M), so that the drive can follow; and with keep_balance so that a
               robot on wheels does not fall, see `roboyard.robots.stability.zmp`: a joint speeds up and
               brakes as
               its footing bears, and stops where it would lead the centre of mass off the wheels
    velocity   u = q̇* + i, with i the integral of `velocity_tracking`; once all are zero and the joints rest,
               u = the positions they rest at
    effort     u = τ*
    with use_impedances
    position   τ = M (kp (r - q) - kd q̇) + b,  kd = 2 ζ √kp
    velocity   τ = M vel_kp (q̇* - q̇) + b

A change d of joint i means q*_i = q_i + d_i; joints whose change is zero keep the goal they have, so that
an arm under load does not creep (OmniGibson re-targets the measured position of every joint, which sags
step by step). b is gravity, Coriolis and centrifugal effort, as far as compensation is on.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from roboyard.robots.control.controller import (
    Control,
    Controller,
    ControllerSettings,
    GroupLimits,
    GroupState,
    MotorType,
    idle,
    meaningless,
)
from roboyard.robots.control.rate_limiter import RateLimiter
from roboyard.robots.control.velocity_tracking import VelocityTracking
from roboyard.transforms import Array, multiply, normalized, quaternion_from_rpy


class JointSettings(ControllerSettings):
    motor_type: MotorType = "position"
    use_delta_commands: bool = False
    compute_delta_in_quat_space: tuple[tuple[int, int, int], ...] | None = None
    """Triples of places of joints (rx, ry, rz) whose changes are composed as rotations."""
    use_impedances: bool = False
    pos_kp: float | None = Field(default=None, ge=0)
    """1/s²; 50 by default, for position with use_impedances."""
    pos_damping_ratio: float | None = Field(default=None, ge=0)
    """1 by default."""
    vel_kp: float | None = Field(default=None, ge=0)
    """1/s; 2 by default, for velocity with use_impedances."""
    use_cc_compensation: bool = True
    """Add Coriolis and centrifugal effort too (with use_impedances)."""
    smoothing_filter_size: int | None = Field(default=None, ge=1)
    """Targets are averaged over this many steps."""
    keep_balance: bool = True
    """Position: stop short of tipping over, for robots that stand on the floor by their wheels."""
    hold_position: bool = True
    """Velocity: stay in place, against any push, once at rest with all commands zero."""

    @model_validator(mode="after")
    def _fit(self) -> JointSettings:
        kind = f"with motor_type {self.motor_type!r}"
        if self.motor_type != "position":
            meaningless(self, ("pos_kp", "pos_damping_ratio", "keep_balance"), kind)
        if self.motor_type != "velocity":
            meaningless(self, ("vel_kp", "hold_position"), kind)
        if not self.use_impedances:
            gains = ("pos_kp", "pos_damping_ratio", "vel_kp", "use_cc_compensation")
            idle(self, gains, "without use_impedances")
        if self.motor_type == "velocity" and self.isaac_kp:
            raise ValueError("isaac_kp has no meaning with motor_type 'velocity'; leave it out")
        if self.use_delta_commands and isinstance(self.command_output_limits, str):
            raise ValueError("command_output_limits must be null or numbers with use_delta_commands")
        if self.compute_delta_in_quat_space and not (
            self.use_delta_commands and self.motor_type == "position"
        ):
            raise ValueError("compute_delta_in_quat_space needs motor_type 'position' and use_delta_commands")
        return self


class JointController(Controller):
    Settings: ClassVar[type[ControllerSettings]] = JointSettings
    settings: JointSettings

    def __init__(self, limits: GroupLimits, settings: JointSettings) -> None:
        super().__init__(limits, settings)
        self.needs_mass_matrix = settings.use_impedances and settings.motor_type != "effort"  # type: ignore[misc]
        self.keeps_balance = settings.keep_balance and settings.motor_type == "position"  # type: ignore[misc]
        self._kp = 50.0 if settings.pos_kp is None else settings.pos_kp
        damping = 1.0 if settings.pos_damping_ratio is None else settings.pos_damping_ratio
        self._kd = 2.0 * np.sqrt(self._kp) * damping
        self._vel_kp = 2.0 if settings.vel_kp is None else settings.vel_kp
        self._approach = RateLimiter(limits)
        self._history: list[Array] = []
        self._tracking = VelocityTracking(limits.velocity, hold_position=settings.hold_position)
        for triple in settings.compute_delta_in_quat_space or ():
            if not all(0 <= place < limits.size for place in triple):
                from roboyard.errors import ConfigError

                raise ConfigError(
                    f"compute_delta_in_quat_space: {triple} goes beyond the {limits.size} joints of the group"
                )

    @property
    def command_dim(self) -> int:
        return self.limits.size

    @property
    def control_type(self) -> MotorType:
        settings = self.settings
        return "effort" if settings.use_impedances else settings.motor_type

    @property
    def reference(self) -> Array | None:
        """(n,) where a position controller has led its joints so far; None before the first step."""
        return self._approach.reference

    def reset(self) -> None:
        super().reset()
        self._approach.reset()
        self._history.clear()
        self._tracking.reset()

    def _default_output_limits(self) -> tuple[ArrayLike, ArrayLike]:
        return self.limits.of(self.settings.motor_type)

    def _goal(self, command: Array, state: GroupState) -> Array:
        kind = self.settings.motor_type
        goal = self._changed(command, state) if self.settings.use_delta_commands else command
        low, high = self.limits.of(kind)
        return np.clip(goal, low, high)

    def _changed(self, change: Array, state: GroupState) -> Array:
        kind = self.settings.motor_type
        if kind != "position":
            last = (
                state.v if kind == "velocity" else (np.zeros_like(change) if self.goal is None else self.goal)
            )
            return last + change
        held = self.goal if self.goal is not None else state.q
        goal = np.where(change == 0.0, held, state.q + change)
        for triple in self.settings.compute_delta_in_quat_space or ():
            places = list(triple)
            if change[places].any():
                turned = multiply(quaternion_from_rpy(change[places]), quaternion_from_rpy(state.q[places]))
                goal[places] = _rpy(normalized(turned))
        return goal

    def _noop_goal(self, state: GroupState) -> Array:
        return state.q.copy() if self.settings.motor_type == "position" else np.zeros(self.limits.size)

    def _control(self, state: GroupState) -> Control:
        settings = self.settings
        if settings.motor_type == "position":
            return self._position(self._approach.follow(self._smoothed(self.goal), state), state)
        goal = self._smoothed(self.goal)
        if settings.motor_type == "effort":
            wanted = settings.use_gravity_compensation and state.bias is not None
            return Control(kind="effort", value=goal + state.bias if wanted else goal)  # type: ignore[operator]
        if settings.use_impedances:
            return self._effort(self._vel_kp * (goal - state.v), state)
        return self._tracking.control(goal, state)

    def _position(self, target: Array, state: GroupState) -> Control:
        if not self.settings.use_impedances:
            return Control(kind="position", value=target)
        return self._effort(self._kp * (target - state.q) - self._kd * state.v, state)

    def _effort(self, wanted: Array, state: GroupState) -> Control:
        assert state.mass_matrix is not None
        effort = state.mass_matrix @ wanted
        if state.bias is not None and self.settings.use_cc_compensation:
            effort = effort + state.bias
        return Control(kind="effort", value=effort)

    def _smoothed(self, target: Array) -> Array:
        size = self.settings.smoothing_filter_size
        if not size or size == 1:
            return target
        self._history = [*self._history[-(size - 1) :], target]
        return np.mean(self._history, axis=0)

    def _noop(self, state: GroupState) -> Any:
        kind, size = self.settings.motor_type, self.limits.size
        if kind != "position" or self.settings.use_delta_commands:
            return np.zeros(size)
        return state.q if self.goal is None else self.goal


def _rpy(quaternion: Array) -> Array:
    from roboyard.transforms import matrix_from_quaternion, rpy_from_matrix

    return rpy_from_matrix(matrix_from_quaternion(quaternion))
