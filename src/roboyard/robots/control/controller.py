"""What every controller is: commands in, goals kept, drive targets out. Arrays only.

A controller drives one group of n joints. `update_goal` takes a command, scales it and keeps what it means as
the goal; `step` turns the goal into drive targets and is called again and again while the goal stands. What a
controller knows of the robot comes in a `GroupState`.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field

from roboyard.errors import ConfigError, RoboyardError
from roboyard.robots.control.scaling import LimitSetting, Scaling
from roboyard.robots.stability.zmp import BalanceMargins
from roboyard.transforms import Array

MotorType = Literal["position", "velocity", "effort"]
EYE4 = np.eye(4)
EYE4.flags.writeable = False


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class GroupLimits:
    """Limits of a group's joints; (n,) each."""

    lower: Array
    """rad or m, -inf for none"""
    upper: Array
    """rad or m, inf for none"""
    velocity: Array
    """Largest speed; rad/s or m/s"""
    effort: Array
    """Largest effort; N m or N"""

    @property
    def size(self) -> int:
        return len(self.lower)

    def of(self, motor_type: MotorType) -> tuple[Array, Array]:
        """(n,) lowest and highest value of this kind."""
        if motor_type == "position":
            return self.lower, self.upper
        bound = self.velocity if motor_type == "velocity" else self.effort
        return -bound, bound


@dataclass(kw_only=True, slots=True)
class GroupState:
    """The present of a group's joints."""

    q: Array
    """(n,) rad or m"""
    v: Array
    """(n,) rad/s or m/s"""
    dt: float
    """s until the next call of `step`"""
    inertia: Array | None = None
    """(n,) kg m² or kg that each joint moves, all others held; bounds how fast references speed up"""
    mass_matrix: Array | None = None
    """(n, n) of the group's joints, all others held; for controllers with `needs_mass_matrix`"""
    bias: Array | None = None
    """(n,) effort that gravity, Coriolis and centrifugal forces take; N m or N"""
    balance: Callable[[], BalanceMargins | None] | None = None
    """How these joints tip a robot that stands; for controllers with `keeps_balance`, worked out if asked"""
    mount: Array = field(default_factory=lambda: EYE4)
    """(4, 4) pose, in the robot's base frame, of the frame that the group hangs from. For a base: pose of the
    base in the frame of its virtual joints."""


RISE_TIME = 0.2
"""s: shortest time to full speed"""
EFFORT_SHARE = 0.4
"""Of the effort limit that speeding up may take; the rest is for gravity and for what comes."""


def acceleration(limits: GroupLimits, inertia: Array | None) -> Array:
    """(n,) min(v_max / 0.2 s, 0.4 E / M): how fast the drives can follow a reference; rad/s² or m/s²."""
    usual = limits.velocity / RISE_TIME
    if inertia is None:
        return usual
    return np.minimum(usual, EFFORT_SHARE * limits.effort / np.maximum(inertia, 1e-9))


@dataclass(kw_only=True, slots=True)
class Control:
    """What the drives of a group are to do."""

    kind: MotorType
    value: Array
    """(n,) rad, m; rad/s, m/s; N m, N"""
    led: Array | None = None
    """(n,) of a velocity: the speed that joints are to have, where `value` asks for more or less to reach it.
    Drives make up for the joints' own friction and damping at this speed."""


class ControllerSettings(BaseModel):
    """Keys that every controller takes."""

    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True)

    name: str = ""
    command_input_limits: LimitSetting = "default"
    """Commands are clipped to these; "default": -1 and 1; None: taken as they are."""
    command_output_limits: LimitSetting = "default"
    """What the input limits are scaled to; "default": the limits of the joints; None: not scaled."""
    isaac_kp: float | None = Field(default=None, ge=0)
    """N m/rad or N/m of the drives; by default from the joints' inertia (`roboyard.sim.actuation.gains`)."""
    isaac_kd: float | None = Field(default=None, ge=0)
    """N m s/rad or N s/m of the drives."""
    use_gravity_compensation: bool | None = None
    """Add the effort that gravity takes, so that joints do not sag; the base still carries the weight. None:
    yes, unless commands are raw efforts."""
    subsume_controllers: tuple[str, ...] = ()
    """Groups whose joints this controller drives too, before its own; they leave the action."""


def meaningless(settings: BaseModel, keys: Iterable[str], why: str) -> None:
    """Refuse keys that were given but would change nothing.

    Raises:
        ValueError: one of them was given; `why` completes "... has no meaning".
    """
    for key in keys:
        if key in settings.model_fields_set and getattr(settings, key) is not None:
            raise ValueError(f"{key} has no meaning {why}; leave it out")


def idle(settings: BaseModel, keys: Iterable[str], why: str) -> None:
    """Warn of keys that change nothing but stand in many an OmniGibson configuration all the same."""
    for key in keys:
        if key in settings.model_fields_set and getattr(settings, key) is not None:
            warnings.warn(f"{type(settings).__name__}: {key} has no effect {why}", stacklevel=2)


class Controller(ABC):
    """One controller of one group."""

    Settings: ClassVar[type[ControllerSettings]] = ControllerSettings
    needs_mass_matrix: ClassVar[bool] = False
    keeps_balance: ClassVar[bool] = False

    def __init__(self, limits: GroupLimits, settings: ControllerSettings) -> None:
        self.limits = limits
        self.settings = settings
        if self.control_type == "effort":
            try:
                meaningless(settings, ("isaac_kp", "isaac_kd"), "for joints driven by effort")
            except ValueError as error:
                raise ConfigError(str(error)) from None
        self.goal: Any = None
        """What the last command meant; None before the first and after `reset`."""
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
        """Which gains the drives get. Controllers of type "effort" are called at every physics step."""

    @abstractmethod
    def _default_output_limits(self) -> tuple[ArrayLike, ArrayLike] | None: ...

    @abstractmethod
    def _goal(self, command: Array, state: GroupState) -> Any:
        """What a scaled command means."""

    @abstractmethod
    def _noop_goal(self, state: GroupState) -> Any:
        """The goal of a controller that nobody has told anything: stay."""

    @abstractmethod
    def _control(self, state: GroupState) -> Control: ...

    @abstractmethod
    def _noop(self, state: GroupState) -> ArrayLike:
        """The scaled command that changes nothing."""

    def update_goal(self, command: ArrayLike, state: GroupState) -> None:
        """Take a command.

        Args:
            command: (command_dim,)
            state: where the joints are now.

        Raises:
            RoboyardError: it has another length, or is not finite.
        """
        values = np.asarray(command, dtype=float)
        if values.shape != (self.command_dim,):
            raise RoboyardError(
                f"{type(self).__name__}: a command has {self.command_dim} numbers; got shape {values.shape}"
            )
        if not np.isfinite(values).all():
            raise RoboyardError(f"{type(self).__name__}: the command {values} is not finite")
        self.goal = self._goal(self.scaling.apply(values), state)

    def step(self, state: GroupState) -> Control:
        """Drive targets for now, within the joints' limits."""
        if self.goal is None:
            self.goal = self._noop_goal(state)
        control = self._control(state)
        low, high = self.limits.of(control.kind)
        control.value = np.minimum(np.maximum(control.value, low), high)
        return control

    def noop_command(self, state: GroupState) -> Array:
        """(command_dim,) the command that leaves everything as it is, in the units of commands."""
        return self.scaling.invert(np.asarray(self._noop(state), dtype=float))

    def reset(self) -> None:
        """Forget the goal, as after a jump of the joints."""
        self.goal = None
