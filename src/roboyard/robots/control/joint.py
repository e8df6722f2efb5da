"""JointController: positions, velocities or efforts of joints, absolute or as changes.

    position   u = r, a reference that moves from the joint's position to q* with speeds up to v_max and
               accelerations up to min(v_max / 0.2 s, 0.4 E / M), so that the drive can follow. With
               keep_balance a robot on wheels does not tip over: accelerations are limited, and a joint stops
               where it would shift the centre of mass out of the support polygon, see
               `roboyard.robots.stability.zmp`
    velocity   u = q̇* + i, with i the integral of `velocity_tracking`; q̇* decreases towards a position
               limit. Once all are zero and the joints rest, u = the present positions
    effort     u = τ*
    with use_impedances
    position   τ = M (kp (r - q) - kd q̇) + b,  kd = 2 ζ √kp
    velocity   τ = M vel_kp (q̇* - q̇) + b

A change d of joint i means q*_i = q_i + d_i; joints whose change is zero keep their goal, so that an
arm under load does not creep (OmniGibson re-targets the measured position of every joint, which sags step by
step). b is the effort of gravity, Coriolis and centrifugal forces, where compensation is on.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from roboyard._arrays import ArrayLike
from roboyard.robots.control.controller import (
    Control,
    Controller,
    ControllerSettings,
    GroupLimits,
    GroupState,
    MotorType,
    refuse_keys,
    warn_of_keys,
)
from roboyard.robots.control.rate_limiter import RateLimiter
from roboyard.robots.control.velocity_tracking import VelocityTracking
from roboyard.transforms import Array, multiply, normalized, quaternion_from_rpy

STOP_TIME = 0.15
"""Time constant with which a speed decreases towards a position limit (s)."""


class JointSettings(ControllerSettings):
    """Keys of a JointController."""

    motor_type: MotorType = "position"
    use_delta_commands: bool = False
    compute_delta_in_quat_space: tuple[tuple[int, int, int], ...] | None = None
    """Triples of joint indices (rx, ry, rz) whose changes are composed as rotations."""
    use_impedances: bool = False
    pos_kp: float | None = Field(default=None, ge=0)
    """Stiffness of position with use_impedances (1/s²); 50 by default."""
    pos_damping_ratio: float | None = Field(default=None, ge=0)
    """Damping ratio of position with use_impedances; 1 by default."""
    vel_kp: float | None = Field(default=None, ge=0)
    """Gain of velocity with use_impedances (1/s); 2 by default."""
    use_cc_compensation: bool = True
    """Also add Coriolis and centrifugal effort (with use_impedances)."""
    smoothing_filter_size: int | None = Field(default=None, ge=1)
    """Number of steps over which targets are averaged."""
    keep_balance: bool = True
    """Position: keep a robot on wheels from tipping over."""
    hold_position: bool = True
    """Velocity: hold the positions once at rest with zero commands."""

    @model_validator(mode="after")
    def _fit(self) -> JointSettings:
        kind = f"with motor_type {self.motor_type!r}"
        if self.motor_type != "position":
            refuse_keys(self, ("pos_kp", "pos_damping_ratio", "keep_balance"), kind)
        if self.motor_type != "velocity":
            refuse_keys(self, ("vel_kp", "hold_position"), kind)
        if not self.use_impedances:
            gains = ("pos_kp", "pos_damping_ratio", "vel_kp", "use_cc_compensation")
            warn_of_keys(self, gains, "without use_impedances")
        if self.motor_type == "velocity" and self.isaac_kp:
            raise ValueError(f"isaac_kp={self.isaac_kp} has no effect with motor_type 'velocity'; remove it")
        if self.use_delta_commands and isinstance(self.command_output_limits, str):
            raise ValueError(
                "command_output_limits must be null or numbers with use_delta_commands, got "
                f"{self.command_output_limits!r}"
            )
        if self.compute_delta_in_quat_space and not (
            self.use_delta_commands and self.motor_type == "position"
        ):
            raise ValueError(
                "compute_delta_in_quat_space needs motor_type 'position' and use_delta_commands, got "
                f"{self.motor_type!r} and {self.use_delta_commands}"
            )
        return self


class JointController(Controller):
    """Drives each joint of a group by its own number."""

    Settings: ClassVar[type[ControllerSettings]] = JointSettings
    settings: JointSettings

    def __init__(self, limits: GroupLimits, settings: JointSettings) -> None:
        """Create the controller of a group from its limits and keys.

        Raises:
            ConfigError: a key does not fit the group.
        """
        super().__init__(limits, settings)
        self.needs_mass_matrix = settings.use_impedances and settings.motor_type != "effort"  # type: ignore[misc]
        self.keeps_balance = settings.keep_balance and settings.motor_type == "position"  # type: ignore[misc]
        self._kp = 50.0 if settings.pos_kp is None else settings.pos_kp
        damping = 1.0 if settings.pos_damping_ratio is None else settings.pos_damping_ratio
        self._kd = 2.0 * np.sqrt(self._kp) * damping
        self._vel_kp = 2.0 if settings.vel_kp is None else settings.vel_kp
        self._rate_limiter = RateLimiter(limits)
        self._history: list[Array] = []
        self._tracking = VelocityTracking(limits.velocity, hold_position=settings.hold_position)
        for triple in settings.compute_delta_in_quat_space or ():
            if not all(0 <= index < limits.size for index in triple):
                from roboyard.errors import ConfigError

                raise ConfigError(
                    f"compute_delta_in_quat_space: {triple} exceeds the {limits.size} joints of the group"
                )

    @property
    def command_dim(self) -> int:
        """Numbers in a command: one for each joint."""
        return self.limits.size

    @property
    def control_type(self) -> MotorType:
        """Kind of drive."""
        settings = self.settings
        return "effort" if settings.use_impedances else settings.motor_type

    @property
    def reference(self) -> Array | None:
        """(n,) present reference of a position controller (rad or m); None before the first step."""
        return self._rate_limiter.reference

    def reset(self) -> None:
        """Discard goal, reference and history."""
        super().reset()
        self._rate_limiter.reset()
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
            indices = list(triple)
            if change[indices].any():
                rotation = multiply(
                    quaternion_from_rpy(change[indices]), quaternion_from_rpy(state.q[indices])
                )
                goal[indices] = _rpy(normalized(rotation))
        return goal

    def _noop_goal(self, state: GroupState) -> Array:
        return state.q.copy() if self.settings.motor_type == "position" else np.zeros(self.limits.size)

    def _control(self, state: GroupState) -> Control:
        settings = self.settings
        if settings.motor_type == "position":
            return self._position(self._rate_limiter.follow(self._smoothed(self.goal), state), state)
        goal = self._smoothed(self.goal)
        if settings.motor_type == "effort":
            compensated = settings.use_gravity_compensation and state.bias is not None
            return Control(kind="effort", value=goal + state.bias if compensated else goal)  # type: ignore[operator]
        goal = self._within_limits(goal, state)
        if settings.use_impedances:
            return self._effort(self._vel_kp * (goal - state.v), state)
        return self._tracking.control(goal, state)

    def _within_limits(self, speed: Array, state: GroupState) -> Array:
        """Return (n,) speeds (rad/s or m/s) that come to a stop at the position limits."""
        low = np.minimum((self.limits.lower - state.q) / STOP_TIME, 0.0)
        high = np.maximum((self.limits.upper - state.q) / STOP_TIME, 0.0)
        return np.clip(speed, low, high)

    def _position(self, target: Array, state: GroupState) -> Control:
        if not self.settings.use_impedances:
            return Control(kind="position", value=target)
        return self._effort(self._kp * (target - state.q) - self._kd * state.v, state)

    def _effort(self, acceleration: Array, state: GroupState) -> Control:
        assert state.mass_matrix is not None
        effort = state.mass_matrix @ acceleration
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
