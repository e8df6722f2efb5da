"""MultiFingerGripperController: open and close fingers.

    binary        c >= 0 opens (inverted: c <= 0), anything else closes; one number
    smooth        every finger goes to the same value; one number
    independent   one number a finger

Open means `open_qpos` or the upper limits, closed `closed_qpos` or the lower limits; with a velocity motor,
the largest speed up or down, which stops within `limit_tolerance` of a limit. `inverted` mirrors commands
about the middle of the input limits.
"""

from __future__ import annotations

from collections import deque
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from roboyard.errors import ConfigError
from roboyard.robots.control.controller import (
    Control,
    Controller,
    ControllerSettings,
    GroupLimits,
    GroupState,
    MotorType,
    idle,
)
from roboyard.transforms import Array

STILL = 0.02
"""rad/s or m/s: fingers slower than this stand."""
REACHED = 0.002
"""rad or m: fingers this near a target or limit are there."""
AVERAGED = 5
"""Velocities that `is_grasping` averages."""


class GripperSettings(ControllerSettings):
    motor_type: MotorType = "position"
    mode: Literal["binary", "smooth", "independent"] = "binary"
    inverted: bool = False
    limit_tolerance: float = Field(default=0.001, ge=0)
    """rad or m"""
    open_qpos: tuple[float, ...] | None = None
    closed_qpos: tuple[float, ...] | None = None

    @model_validator(mode="after")
    def _fit(self) -> GripperSettings:
        if self.motor_type == "velocity" and self.isaac_kp:
            raise ValueError("isaac_kp has no meaning with motor_type 'velocity'; leave it out")
        if self.mode != "binary":
            idle(self, ("open_qpos", "closed_qpos"), f"with mode {self.mode!r}")
        return self


class MultiFingerGripperController(Controller):
    Settings: ClassVar[type[ControllerSettings]] = GripperSettings
    settings: GripperSettings

    def __init__(self, limits: GroupLimits, settings: GripperSettings) -> None:
        super().__init__(limits, settings)
        low, high = limits.of(settings.motor_type)
        self._open = self._posture(settings.open_qpos, "open_qpos", high)
        self._closed = self._posture(settings.closed_qpos, "closed_qpos", low)
        self._speeds: deque[Array] = deque(maxlen=AVERAGED)
        self._last: tuple[Array, Array] | None = None

    def _posture(self, given: tuple[float, ...] | None, key: str, default: Array) -> Array:
        if given is None:
            if not np.isfinite(default).all():
                raise ConfigError(f"{key}: the fingers have no limit to go to; give {len(default)} values")
            return default
        if len(given) != self.limits.size:
            raise ConfigError(f"{key}: has {len(given)} values for {self.limits.size} fingers")
        if self.settings.motor_type != "position":
            raise ConfigError(
                f"{key}: has no meaning with motor_type {self.settings.motor_type!r}; leave it out"
            )
        return np.array(given)

    @property
    def command_dim(self) -> int:
        return self.limits.size if self.settings.mode == "independent" else 1

    @property
    def control_type(self) -> MotorType:
        return self.settings.motor_type

    def reset(self) -> None:
        super().reset()
        self._speeds.clear()
        self._last = None

    def _default_output_limits(self) -> tuple[ArrayLike, ArrayLike] | None:
        low, high = self.limits.of(self.settings.motor_type)
        match self.settings.mode:
            case "binary":
                return -1.0, 1.0
            case "smooth":
                return float(np.mean(low)), float(np.mean(high))
            case _:
                return low, high

    def update_goal(self, command: ArrayLike, state: GroupState) -> None:
        values = np.atleast_1d(np.asarray(command, dtype=float))
        if self.settings.inverted:
            scaling = self.scaling
            values = -values if scaling.low is None else scaling.high - (values - scaling.low)  # type: ignore[operator]
        super().update_goal(values, state)

    def _goal(self, command: Array, state: GroupState) -> Array:
        if self.settings.mode == "binary":
            opens = command[0] > 0.0 if self.settings.inverted else command[0] >= 0.0
            return self._open if opens else self._closed
        return np.broadcast_to(command, (self.limits.size,)).astype(float)

    def _noop_goal(self, state: GroupState) -> Array:
        return state.q.copy() if self.settings.motor_type == "position" else np.zeros(self.limits.size)

    def _control(self, state: GroupState) -> Control:
        value = self.goal
        if self.settings.motor_type != "position":
            near = self.settings.limit_tolerance
            blocked = ((state.q > self.limits.upper - near) & (value > 0)) | (
                (state.q < self.limits.lower + near) & (value < 0)
            )
            value = np.where(blocked, 0.0, value)
        self._speeds.append(state.v.copy())
        self._last = (state.q.copy(), value)
        return Control(kind=self.settings.motor_type, value=value)

    def is_grasping(self) -> bool | None:
        """Whether the fingers hold something: they were sent further, stand still, and are at no limit.

        None where it cannot be told: fingers driven one by one or not alike, or sent where they already are.
        """
        if self.settings.mode == "independent":
            return None
        if self._last is None:
            return False
        q, value = self._last
        if np.ptp(value) > 1e-9 or self.settings.limit_tolerance >= REACHED:
            return None
        if self.settings.motor_type == "position" and np.abs(q - value).mean() < REACHED:
            return None
        if self.settings.motor_type == "velocity" and np.abs(value).mean() < STILL:
            return None
        away = min((q - self.limits.lower).mean(), (self.limits.upper - q).mean()) > REACHED
        still = (np.abs(np.mean(self._speeds, axis=0)) < STILL).all()
        return bool(away and still)

    def _noop(self, state: GroupState) -> Array:
        """Keep the goal; before the first one, binary grippers open."""
        if self.settings.mode == "binary":
            closed = self.goal is self._closed
            return np.array([1.0 if closed == self.settings.inverted else -1.0])
        held = self._noop_goal(state) if self.goal is None else self.goal
        value = held if self.settings.mode == "independent" else np.array([float(np.mean(held))])
        return value

    def noop_command(self, state: GroupState) -> Array:
        command = super().noop_command(state)
        if self.settings.inverted and self.settings.mode != "binary":
            scaling = self.scaling
            command = -command if scaling.low is None else scaling.low + scaling.high - command  # type: ignore[operator]
        return command
