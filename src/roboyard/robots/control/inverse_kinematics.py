"""InverseKinematicsController: the tip follows a goal pose by joint positions.

At every step the reference r of the joints moves by the d that minimises

    |J(r) d - g e|² + λ² |d|²   within the joint limits and |d| ≤ v dt

with v growing by min(v_max / 0.2 s, 0.4 E / M) up to v_max, g = 15 dt / s (at most 1), and e the error of the
tip's pose at r; meanwhile the null space of J moves joints to the reset posture (rate 1/s). Once r is at the
goal it stays. Drives follow u = r. Source: damped least squares,
Wampler 1986; Nakamura and Hanafusa 1986; see `roboyard.kinematics.differential_step`.

OmniGibson takes one undamped pseudo-inverse step from the *measured* joints, u = clip(q + J⁺ e): it jumps
near singular postures, sags under load, ignores velocity limits, and has no null space. Here the reference
does not sag, and where steps stall at joint limits before a reachable goal, joints move to another posture of
`roboyard.kinematics.solve_ik` (`way_round`).

Where a robot may tip over, drives follow r with limited accelerations (`keep_balance`, see
`roboyard.robots.control.rate_limiter`).
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator

from roboyard.kinematics import ChainArrays, differential_step, forward_kinematics, solve_ik
from roboyard.robots.control.controller import (
    Control,
    ControllerSettings,
    GroupLimits,
    GroupState,
    MotorType,
    acceleration,
    warn_of_keys,
)
from roboyard.robots.control.rate_limiter import RateLimiter
from roboyard.robots.control.rotations import vector_of_matrix
from roboyard.robots.control.task import TaskController, TaskSettings
from roboyard.transforms import Array

APPROACH_RATE = 15.0
"""Rate at which the error decreases (1/s)."""
DAMPING = 0.03
"""λ (m or rad per rad)."""
REST_RATE = 1.0
"""Rate towards the reset posture in the null space (1/s)."""
CHECK_EVERY = 10
"""Steps between checks for a stall."""
THERE_POSITION, THERE_ORIENTATION = 1e-5, 1e-4
"""Errors at which the reference is at the goal (m, rad)."""
NEAR_POSITION, NEAR_ORIENTATION = 1e-3, 5e-3
"""Errors below these are no stall (m, rad)."""


class InverseKinematicsSettings(TaskSettings):
    """Keys of an InverseKinematicsController."""

    damping: float = Field(default=DAMPING, ge=0)
    """λ; larger values are smoother near singular postures, and slower."""
    smoothing_filter_size: int | None = Field(default=None, ge=1)
    """Number of steps over which targets are averaged."""
    way_round: bool = True
    """Search for another posture when steps stall before the goal."""
    condition_on_current_position: bool = True
    """Accepted for OmniGibson's sake, which stores it and does not use it: solutions always begin at the
    present posture.
    """
    keep_balance: bool = True
    """Keep a robot on wheels from tipping over."""
    use_impedances: bool = False
    """Follow by effort, τ = M (pos_kp (r - q) - kd q̇) + b, instead of stiff drives."""
    pos_kp: float = Field(default=50.0, ge=0)
    """Stiffness with use_impedances (1/s²)."""
    pos_damping_ratio: float = Field(default=1.0, ge=0)
    """Damping ratio with use_impedances."""

    @model_validator(mode="after")
    def _gains_fit(self) -> InverseKinematicsSettings:
        if not self.use_impedances:
            warn_of_keys(self, ("pos_kp", "pos_damping_ratio"), "without use_impedances")
        return self


class InverseKinematicsController(TaskController):
    """Drives an arm's end effector by joint positions."""

    Settings: ClassVar[type[ControllerSettings]] = InverseKinematicsSettings
    settings: InverseKinematicsSettings  # pyright: ignore[reportIncompatibleVariableOverride]

    def __init__(
        self, limits: GroupLimits, settings: InverseKinematicsSettings, *, chain: ChainArrays, rest: Array
    ) -> None:
        """Create the controller of a chain; arguments and errors as `TaskController`."""
        super().__init__(limits, settings, chain=chain, rest=rest)
        self.needs_mass_matrix = settings.use_impedances  # type: ignore[misc]
        self.keeps_balance = settings.keep_balance  # type: ignore[misc]
        self._rate_limiter = RateLimiter(limits)
        self._kd = 2.0 * np.sqrt(settings.pos_kp) * settings.pos_damping_ratio
        self._weight = 0.0 if self.is_orientation_free else 1.0
        self.reset()

    def reset(self) -> None:
        """Discard goal, reference and detour."""
        super().reset()
        self._reference: Array | None = None
        self._detour: Array | None = None
        self._count = 0
        self._last_error = np.inf
        self._is_unreachable = False
        self._history: list[Array] = []
        self._reached: Array | None = None
        self._speed = np.zeros(self.limits.size)
        self._rate_limiter.reset()

    @property
    def control_type(self) -> MotorType:
        """Kind of drive."""
        return "effort" if self.settings.use_impedances else "position"

    @property
    def reference(self) -> Array | None:
        """(n,) present reference of the joints (rad or m); None before the first step."""
        return self._reference

    def _goal(self, command: Array, state: GroupState) -> Array:
        before, goal = self.goal, super()._goal(command, state)
        if before is None or not np.array_equal(before, goal):
            self._detour, self._count, self._last_error, self._is_unreachable = None, 0, np.inf, False
        return goal

    def follow_posture(self, posture: Array, state: GroupState) -> None:
        """See `TaskController.follow_posture`: the reference moves to the posture itself, (n,) rad or m."""
        super().follow_posture(posture, state)
        self._detour = np.clip(posture, self.limits.lower, self.limits.upper)
        self._count, self._last_error, self._is_unreachable = 0, np.inf, False

    def _control(self, state: GroupState) -> Control:
        if self._reference is None:
            self._reference = np.clip(state.q, self.limits.lower, self.limits.upper)
        target = self.target(state)
        before, dt = self._reference, state.dt
        reach = (
            np.minimum(
                self.limits.velocity, self._speed + acceleration(self.limits, state.inertia, state.bias) * dt
            )
            * dt
        )
        if self._detour is not None:
            self._follow_detour(reach)
        elif self._reached is None or np.abs(target - self._reached).max() > THERE_POSITION:
            self._step_towards(target, reach, state.dt)
        self._speed = np.abs(self._reference - before) / dt
        target_q = self._smoothed(self._reference)
        if state.balance is not None:
            target_q = self._rate_limiter.follow(target_q, state)
        if not self.settings.use_impedances:
            return Control(kind="position", value=target_q)
        assert state.mass_matrix is not None
        effort = state.mass_matrix @ (self.settings.pos_kp * (target_q - state.q) - self._kd * state.v)
        return Control(kind="effort", value=effort if state.bias is None else effort + state.bias)

    def _step_towards(self, target: Array, reach: Array, dt: float) -> None:
        assert self._reference is not None
        position, turn = self.error(target)
        if position < THERE_POSITION and turn < THERE_ORIENTATION:
            self._reached = target
            return
        self._reached = None
        self._reference = differential_step(
            self.chain,
            self._reference,
            target,
            gain=min(1.0, APPROACH_RATE * dt),
            damping=self.settings.damping,
            max_step=reach,
            rest=self.preferred,
            rest_gain=REST_RATE * dt,
            orientation_weights=self._weight,
        )
        self._count += 1
        if self.settings.way_round and self._count % CHECK_EVERY == 0:
            self._search_detour(target, position, turn)

    def _follow_detour(self, reach: Array) -> None:
        """Move all joints together towards the other posture, within their (n,) `reach` (rad or m)."""
        assert self._detour is not None and self._reference is not None
        way = self._detour - self._reference
        slowest = np.abs(way / reach).max()
        if slowest <= 1.0:
            self._reference, self._detour = self._detour, None
        else:
            self._reference = self._reference + way / slowest

    def _search_detour(self, target: Array, position: float, turn: float) -> None:
        error, near = position + turn, position < NEAR_POSITION and turn < NEAR_ORIENTATION
        stalled = error > 0.9 * self._last_error and not near
        self._last_error = error
        if not stalled or self._is_unreachable:
            return
        answer = solve_ik(
            self.chain, target, self._reference, rest=self.preferred, orientation_weights=0.5 * self._weight
        )
        if answer.converged:
            self._detour = answer.q
            self._last_error = np.inf
        else:
            self._is_unreachable = True

    def error(self, target: Array) -> tuple[float, float]:
        """Return distance (m) and angle (rad) of the reference's tip from a (4, 4) target in the chain's
        frame.

        The angle is 0 where the orientation is free.
        """
        assert self._reference is not None
        here = forward_kinematics(self.chain, self._reference)
        gap = target[:3, 3] - here[:3, 3]
        position = math.sqrt(float(gap @ gap))
        if self.is_orientation_free:
            return position, 0.0
        x, y, z = vector_of_matrix(target[:3, :3] @ here[:3, :3].T)
        return position, math.sqrt(x * x + y * y + z * z)

    def _smoothed(self, target: Array) -> Array:
        size = self.settings.smoothing_filter_size
        if not size or size == 1:
            return target
        self._history = [*self._history[-(size - 1) :], target]
        return np.mean(self._history, axis=0)
