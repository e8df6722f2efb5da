"""The base class of controllers: commands in, drive targets out, arrays only.

A controller drives one group of n joints. `update_goal` scales a command and keeps the result as the goal;
`step` computes drive targets from the goal and the state of the group, and is called once per control step.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from roboyard._arrays import ArrayLike
from roboyard.errors import ConfigError, RoboyardError
from roboyard.robots.control.scaling import LimitSetting, Scaling
from roboyard.robots.stability.zmp import BalanceMargins
from roboyard.transforms import Array

MotorType = Literal["position", "velocity", "effort"]
EYE4 = np.eye(4)
EYE4.flags.writeable = False


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class GroupLimits:
    """Limits of a group's n joints."""

    lower: Array
    """(n,) lower position limits (rad or m), -inf for none."""
    upper: Array
    """(n,) upper position limits (rad or m), inf for none."""
    velocity: Array
    """(n,) largest speeds (rad/s or m/s)."""
    effort: Array
    """(n,) largest efforts (N m or N)."""

    @property
    def size(self) -> int:
        """Number of joints."""
        return len(self.lower)

    def of(self, motor_type: MotorType) -> tuple[Array, Array]:
        """Return the (n,) lowest and (n,) highest positions, velocities or efforts."""
        if motor_type == "position":
            return self.lower, self.upper
        bound = self.velocity if motor_type == "velocity" else self.effort
        return -bound, bound


@dataclass(kw_only=True, slots=True)
class GroupState:
    """The present state of a group's n joints."""

    q: Array
    """(n,) positions (rad or m)."""
    v: Array
    """(n,) velocities (rad/s or m/s)."""
    dt: float
    """Time until the next call of `step` (s)."""
    inertia: Array | None = None
    """(n,) inertia of each joint with all others fixed (kg m² or kg); limits the acceleration of references.
    """
    mass_matrix: Array | None = None
    """(n, n) inertia of the joints with all others fixed; for controllers with `needs_mass_matrix`."""
    bias: Array | None = None
    """(n,) effort of gravity, Coriolis and centrifugal forces (N m or N)."""
    balance: Callable[[], BalanceMargins | None] | None = None
    """Returns the stability margins of the robot; for controllers with `keeps_balance`."""
    mount: Array = field(default_factory=lambda: EYE4)
    """(4, 4) pose of the group's parent frame in the robot's base frame. For a base: its pose in the frame of
    the virtual joints."""
    yaw_rate: float | None = None
    """Of the base about its own z axis, as a gyroscope measures it (rad/s); for controllers with
    `needs_yaw_rate`."""


RISE_TIME = 0.2
"""Shortest time to full speed (s)."""
EFFORT_FRACTION = 0.4
"""Fraction of the effort limit for acceleration; the rest is for gravity and disturbances."""
SPARE_FRACTION, LEAST_FRACTION = 0.8, 0.02
"""Fraction of what gravity leaves of the effort limit, and of the limit where it leaves nothing."""


def acceleration(limits: GroupLimits, inertia: Array | None, bias: Array | None = None) -> Array:
    """Return the largest accelerations of a reference that drives can follow: min(v_max / 0.2 s, e / M) with
    e = min(0.4 E, 0.8 (E - |gravity|)), so that a drive which holds a load near its limit can still brake it.

    Args:
        limits: v_max and E of the n joints.
        inertia: M, (n,) kg m² or kg; None: unknown.
        bias: (n,) effort of gravity (N m or N); None: unknown.

    Returns:
        (n,) rad/s² or m/s².
    """
    usual = limits.velocity / RISE_TIME
    if inertia is None:
        return usual
    effort = EFFORT_FRACTION * limits.effort
    if bias is not None:
        spare = np.where(np.isfinite(limits.effort), limits.effort - np.abs(bias), np.inf)
        effort = np.minimum(effort, np.maximum(SPARE_FRACTION * spare, LEAST_FRACTION * limits.effort))
    return np.minimum(usual, effort / np.maximum(inertia, 1e-9))


@dataclass(kw_only=True, slots=True)
class Control:
    """The drive targets of a group."""

    kind: MotorType
    value: Array
    """(n,) positions (rad or m), velocities (rad/s or m/s) or efforts (N m or N)."""
    led: Array | None = None
    """(n,) intended velocities (rad/s or m/s), where `value` includes a correction. Drives compensate
    friction and damping at this velocity."""


class ControllerSettings(BaseModel):
    """Keys of every controller."""

    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True)

    name: str = ""
    command_input_limits: LimitSetting = "default"
    """Commands are clipped to these; "default": -1 and 1; None: not clipped."""
    command_output_limits: LimitSetting = "default"
    """Input limits are scaled to these; "default": the limits of the joints; None: not scaled."""
    isaac_kp: float | None = Field(default=None, ge=0)
    """Stiffness of the drives (N m/rad or N/m); by default from the joints' inertia
    (`roboyard.sim.actuation.gains`).
    """
    isaac_kd: float | None = Field(default=None, ge=0)
    """Damping of the drives (N m s/rad or N s/m)."""
    use_gravity_compensation: bool | None = None
    """Add the effort of gravity, so that joints do not sag; the base still supports the weight. None: yes,
    unless commands are raw efforts."""
    subsume_controllers: tuple[str, ...] = ()
    """Groups whose joints this controller also drives, before its own; they have no part in the action."""


def refuse_keys(settings: BaseModel, keys: Iterable[str], why: str) -> None:
    """Refuse keys that have no effect.

    Raises:
        ValueError: one of them was given; `why` completes "... has no effect".
    """
    for key in keys:
        if key in settings.model_fields_set and getattr(settings, key) is not None:
            raise ValueError(f"{key}={getattr(settings, key)!r} has no effect {why}; remove it")


def warn_of_keys(settings: BaseModel, keys: Iterable[str], why: str) -> None:
    """Warn of keys without effect that are common in OmniGibson configurations."""
    for key in keys:
        if key in settings.model_fields_set and getattr(settings, key) is not None:
            warnings.warn(f"{type(settings).__name__}: {key} has no effect {why}", stacklevel=2)


class Controller(ABC):
    """One controller of one group."""

    Settings: ClassVar[type[ControllerSettings]] = ControllerSettings
    """Model of its keys."""
    needs_mass_matrix: ClassVar[bool] = False
    needs_yaw_rate: ClassVar[bool] = False
    """Whether states need `mass_matrix`."""
    keeps_balance: ClassVar[bool] = False
    """Whether states need `balance`."""

    def __init__(self, limits: GroupLimits, settings: ControllerSettings) -> None:
        """Create the controller of a group from its limits and keys.

        Raises:
            ConfigError: a key does not fit the group.
        """
        self.limits = limits
        self.settings = settings
        if self.control_type == "effort":
            try:
                refuse_keys(settings, ("isaac_kp", "isaac_kd"), "for joints driven by effort")
            except ValueError as error:
                raise ConfigError(str(error)) from None
        self.goal: Any = None
        """Result of the last command; None before the first and after `reset`."""
        self.scaling = Scaling.from_settings(
            settings.command_input_limits,
            settings.command_output_limits,
            self.command_dim,
            self._default_output_limits(),
        )

    @property
    @abstractmethod
    def command_dim(self) -> int:
        """Numbers in a command."""

    @property
    @abstractmethod
    def control_type(self) -> MotorType:
        """Kind of drive; controllers of type "effort" are called at every time step."""

    @abstractmethod
    def _default_output_limits(self) -> tuple[ArrayLike, ArrayLike] | None: ...

    @abstractmethod
    def _goal(self, command: Array, state: GroupState) -> Any:
        """Return the goal of a scaled command."""

    @abstractmethod
    def _noop_goal(self, state: GroupState) -> Any:
        """Return the goal before the first command: stay."""

    @abstractmethod
    def _control(self, state: GroupState) -> Control: ...

    @abstractmethod
    def _noop(self, state: GroupState) -> ArrayLike:
        """Return the scaled command that keeps the goal."""

    def update_goal(self, command: ArrayLike, state: GroupState) -> None:
        """Set the goal from a command.

        Args:
            command: (command_dim,) as in an action.
            state: of the joints.

        Raises:
            RoboyardError: the command has another length, or is not finite.
        """
        values = np.asarray(command, dtype=float)
        if values.shape != (self.command_dim,):
            raise RoboyardError(
                f"{type(self).__name__}: a command must have {self.command_dim} numbers, got shape "
                f"{values.shape}"
            )
        if not np.isfinite(values).all():
            raise RoboyardError(f"{type(self).__name__}: the command {values} is not finite")
        self.goal = self._goal(self.scaling.apply(values), state)

    def step(self, state: GroupState) -> Control:
        """Return the drive targets, within the joints' limits."""
        if self.goal is None:
            self.goal = self._noop_goal(state)
        control = self._control(state)
        low, high = self.limits.of(control.kind)
        control.value = np.minimum(np.maximum(control.value, low), high)
        return control

    def noop_command(self, state: GroupState) -> Array:
        """Return the (command_dim,) command that keeps the goal, as in an action."""
        return self.scaling.invert(np.asarray(self._noop(state), dtype=float))

    def reset(self) -> None:
        """Discard the goal, as after joints were moved at once."""
        self.goal = None
