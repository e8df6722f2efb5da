"""MultiFingerGripperController: open and close the fingers of a gripper.

    binary        c >= 0 opens (inverted: c < 0), anything else closes; one number
    smooth        the same value for every finger; one number
    independent   one number for each finger

Open means `open_qpos` or the upper limits, closed `closed_qpos` or the lower limits; with a velocity motor,
the largest velocity, which is set to zero within `limit_tolerance` of a limit. `inverted` mirrors commands
about the middle of the input limits.

Fingers that open towards their lower limits, as the definition's `opening_direction` states, turn the
other way, so that larger commands open in every mode; commands that are not scaled stay literal.
"""

from __future__ import annotations

from collections import deque
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from roboyard._arrays import ArrayLike
from roboyard.errors import ConfigError
from roboyard.robots.control.controller import (
    Control,
    Controller,
    ControllerSettings,
    GroupLimits,
    GroupState,
    MotorType,
    warn_of_keys,
)
from roboyard.transforms import Array

STILL = 0.02
"""Fingers slower than this are at rest (rad/s or m/s)."""
REACHED = 0.002
"""Distance at which fingers are at a target or limit (rad or m)."""
AVERAGED = 5
"""Number of velocities that `is_grasping` averages."""


class GripperSettings(ControllerSettings):
    """Keys of a MultiFingerGripperController."""

    motor_type: MotorType = "position"
    mode: Literal["binary", "smooth", "independent"] = "binary"
    """Meaning of a command."""
    inverted: bool = False
    """Mirror commands, so that positive ones close."""
    limit_tolerance: float = Field(default=0.001, ge=0)
    """Distance from a limit at which velocities are zeroed (rad or m)."""
    open_qpos: tuple[float, ...] | None = None
    """(n,) open positions (rad or m); the upper limits by default."""
    closed_qpos: tuple[float, ...] | None = None
    """(n,) closed positions (rad or m); the lower limits by default."""

    @model_validator(mode="after")
    def _fit(self) -> GripperSettings:
        if self.motor_type == "velocity" and self.isaac_kp:
            raise ValueError(f"isaac_kp={self.isaac_kp} has no effect with motor_type 'velocity'; remove it")
        if self.mode != "binary":
            warn_of_keys(self, ("open_qpos", "closed_qpos"), f"with mode {self.mode!r}")
        return self


class MultiFingerGripperController(Controller):
    """Drives the fingers of a gripper together."""

    Settings: ClassVar[type[ControllerSettings]] = GripperSettings
    settings: GripperSettings

    def __init__(
        self, limits: GroupLimits, settings: GripperSettings, opening: ArrayLike | None = None
    ) -> None:
        """Create the controller of a gripper from its limits and keys.

        Args:
            limits: of the n fingers.
            settings: keys.
            opening: (n,) 1 for each finger that opens towards its upper limit, -1 towards its lower one, 0
                for one that neither opens nor closes the gripper; all 1 by default.

        Raises:
            ConfigError: a key does not fit the fingers.
        """
        opening = np.ones(limits.size) if opening is None else np.asarray(opening, dtype=float)
        self._way = np.where(opening < 0, -1.0, 1.0)
        literal = settings.command_input_limits is None or not isinstance(settings.command_output_limits, str)
        self._sign = np.ones(limits.size) if literal else self._way
        super().__init__(limits, settings)
        low, high = limits.of(settings.motor_type)
        still = np.clip(0.0, low, high)
        ends = [
            np.where(opening == 0, still, np.where(opening > 0, up, down))
            for up, down in ((high, low), (low, high))
        ]
        self._open = self._posture(settings.open_qpos, "open_qpos", ends[0])
        self._closed = self._posture(settings.closed_qpos, "closed_qpos", ends[1])
        self._speeds: deque[Array] = deque(maxlen=AVERAGED)
        self._last: tuple[Array, Array] | None = None

    def _posture(self, given: tuple[float, ...] | None, key: str, default: Array) -> Array:
        if given is None:
            if not np.isfinite(default).all():
                raise ConfigError(
                    f"{key}: the fingers have no limits {default.tolist()}; give {len(default)} values"
                )
            return default
        if len(given) != self.limits.size:
            raise ConfigError(
                f"{key}: must have {self.limits.size} values, one for each finger, got {len(given)}"
            )
        if self.settings.motor_type != "position":
            raise ConfigError(f"{key}: has no effect with motor_type {self.settings.motor_type!r}; remove it")
        return np.array(given)

    @property
    def postures(self) -> tuple[Array, Array]:
        """(n,) positions of the open and (n,) of the closed fingers (rad or m)."""
        return self._open, self._closed

    @property
    def command_dim(self) -> int:
        """Numbers in a command, by mode."""
        return self.limits.size if self.settings.mode == "independent" else 1

    @property
    def control_type(self) -> MotorType:
        """Kind of drive."""
        return self.settings.motor_type

    def reset(self) -> None:
        """Discard goal and measured velocities."""
        super().reset()
        self._speeds.clear()
        self._last = None

    def _default_output_limits(self) -> tuple[ArrayLike, ArrayLike] | None:
        low, high = self.limits.of(self.settings.motor_type)
        low, high = np.where(self._sign < 0, -high, low), np.where(self._sign < 0, -low, high)
        match self.settings.mode:
            case "binary":
                return -1.0, 1.0
            case "smooth":
                return float(np.mean(low)), float(np.mean(high))
            case _:
                return low, high

    def update_goal(self, command: ArrayLike, state: GroupState) -> None:
        """Set the goal from a (command_dim,) command or one number; errors as `Controller.update_goal`."""
        values = np.atleast_1d(np.asarray(command, dtype=float))
        if self.settings.inverted:
            scaling = self.scaling
            values = -values if scaling.low is None else scaling.high - (values - scaling.low)  # type: ignore[operator]
        super().update_goal(values, state)

    def _goal(self, command: Array, state: GroupState) -> Array:
        if self.settings.mode == "binary":
            opens = command[0] > 0.0 if self.settings.inverted else command[0] >= 0.0
            return self._open if opens else self._closed
        return self._sign * np.broadcast_to(command, (self.limits.size,))

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

    def is_closing(self, q: Array) -> bool:
        """Return whether the goal closes the gripper from positions q (n,) (rad or m), or keeps it closed."""
        if self.goal is None:
            return False
        if self.settings.motor_type != "position":
            return float((self._way * self.goal).sum()) < 0
        closes = float((self._way * (self.goal - q)).sum())
        return closes < -REACHED or (closes < REACHED and bool(np.allclose(self.goal, self._closed)))

    def is_grasping(self) -> bool | None:
        """Return whether the fingers hold an object: at rest before their target, and not at a limit.

        None where this cannot be detected: fingers with different targets, or already at their target.
        """
        if self.settings.mode == "independent":
            return None
        if self._last is None:
            return False
        q, value = self._last
        if np.ptp(self._way * value) > 1e-9 or self.settings.limit_tolerance >= REACHED:
            return None
        if self.settings.motor_type == "position" and np.abs(q - value).mean() < REACHED:
            return None
        if self.settings.motor_type == "velocity" and np.abs(value).mean() < STILL:
            return None
        away = min((q - self.limits.lower).mean(), (self.limits.upper - q).mean()) > REACHED
        still = (np.abs(np.mean(self._speeds, axis=0)) < STILL).all()
        return bool(away and still)

    def _noop(self, state: GroupState) -> Array:
        """Return the scaled command that keeps the goal; before the first one, binary grippers open."""
        if self.settings.mode == "binary":
            closed = self.goal is self._closed
            return np.array([1.0 if closed == self.settings.inverted else -1.0])
        held = self._sign * (self._noop_goal(state) if self.goal is None else self.goal)
        value = held if self.settings.mode == "independent" else np.array([float(np.mean(held))])
        return value

    def noop_command(self, state: GroupState) -> Array:
        """Return the (command_dim,) command that keeps the goal, as in an action."""
        command = super().noop_command(state)
        if self.settings.inverted and self.settings.mode != "binary":
            scaling = self.scaling
            command = -command if scaling.low is None else scaling.low + scaling.high - command  # type: ignore[operator]
        return command
