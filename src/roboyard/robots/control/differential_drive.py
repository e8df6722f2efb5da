"""DifferentialDriveController: forward speed and yaw rate of a robot on wheels to its left and right.

ω_left = (v - ω L/2) / r, ω_right = (v + ω L/2) / r with wheel radius r and axle length L. A command of one
means v_max = w_max r, or ω_max = 2 v_max / L. Where both together exceed the limit of a wheel, both wheels
slow down alike, so that the robot stays on its curve (OmniGibson clips each wheel alone, which bends it).
Both speeds change in proportion, by at most `max_acceleration`, so that a robot that starts stays on its
curve. A robot that would tip over accelerates and brakes more gently, and drives curves slower (see
`roboyard.robots.stability.zmp`). Wheels reach their speeds under load and hold their position at rest, see
`velocity_tracking`.

With several wheels on a side (skid steering) all of a side turn alike; by a gyroscope's rate they turn as
much faster as sideways slip takes. A wheel whose axle points to the right turns the other way.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from roboyard.errors import ConfigError
from roboyard.robots.control.controller import (
    Control,
    Controller,
    ControllerSettings,
    GroupLimits,
    GroupState,
    MotorType,
)
from roboyard.robots.control.twist_ramp import next_twist
from roboyard.robots.control.velocity_tracking import VelocityTracking
from roboyard.transforms import Array

SLIP_RATE = 3.0
"""Rate at which wheels on several axles make up for sideways slip (1/s)."""
Positive = Annotated[float, Field(gt=0)]


class DifferentialDriveSettings(ControllerSettings):
    """Keys of a DifferentialDriveController."""

    wheel_radius: float = Field(default=0.0, ge=0)
    """Radius of both wheels (m); the definition's by default."""
    wheel_axle_length: float = Field(default=0.0, ge=0)
    """Distance between the wheels (m); the definition's by default."""
    max_acceleration: tuple[Positive, Positive] | None = (1.5, 6.0)
    """Largest acceleration (m/s², rad/s²); None: unlimited."""
    hold_position: bool = True
    """Hold the wheel positions once at rest with zero commands."""


class DifferentialDriveController(Controller):
    """Drives the left and the right wheels of a robot."""

    Settings: ClassVar[type[ControllerSettings]] = DifferentialDriveSettings
    settings: DifferentialDriveSettings

    def __init__(
        self,
        limits: GroupLimits,
        settings: DifferentialDriveSettings,
        signs: Sequence[float] = (),
        forward: Sequence[float] = (1.0, 0.0),
    ) -> None:
        """Create the controller of two wheels, or of several on each side.

        Args:
            limits: of the wheels, the left ones first.
            settings: keys of the controller.
            signs: 1 for each wheel that rolls forwards with a positive speed, -1 for others; 1 by default.
            forward: (2,) unit vector in the base frame along which a positive speed drives.

        Raises:
            ConfigError: there are not two wheels of one velocity limit, or a wheel size is missing.
        """
        if limits.size < 2 or limits.size % 2:
            raise ConfigError(
                f"a differential drive has 2 joints (left wheel, right wheel); got {limits.size}"
            )
        if not (settings.wheel_radius > 0 and settings.wheel_axle_length > 0):
            raise ConfigError(
                "wheel_radius and wheel_axle_length must be positive (m), got "
                f"{settings.wheel_radius} and {settings.wheel_axle_length}"
            )
        if np.ptp(limits.velocity) > 0:
            raise ConfigError(
                f"both wheels need the same velocity limit; they have {limits.velocity.min()} and "
                f"{limits.velocity.max()}"
            )
        super().__init__(limits, settings)
        self.signs: Array = np.array(signs, dtype=float) if len(signs) else np.ones(limits.size)
        """(k,) 1 for each wheel that rolls forwards with a positive speed, -1 for others."""
        self._tracking = VelocityTracking(limits.velocity, hold_position=settings.hold_position)
        self._twist_now = np.zeros(2)
        self._slip = 0.0
        self.forward: Array = np.array(forward, dtype=float)
        """(2,) unit vector in the base frame along which a positive speed drives."""
        self.needs_yaw_rate = limits.size > 2  # type: ignore[misc]
        self.keeps_balance = settings.max_acceleration is not None  # type: ignore[misc]

    @property
    def command_dim(self) -> int:
        """Numbers in a command: forward speed and yaw rate."""
        return 2

    @property
    def control_type(self) -> MotorType:
        """Wheels are driven by velocity."""
        return "velocity"

    def _default_output_limits(self) -> tuple[Array, Array]:
        fastest = self.limits.velocity[0] * self.settings.wheel_radius
        bound = np.array([fastest, 2.0 * fastest / self.settings.wheel_axle_length])
        return -bound, bound

    def _goal(self, command: Array, state: GroupState) -> Array:
        """Return (2,) forward speed (m/s) and yaw rate (rad/s) within the limits of both wheels."""
        excess = np.abs(self.wheel_speeds(command)).max() / self.limits.velocity[0]
        return command / excess if excess > 1.0 else command

    def _noop_goal(self, state: GroupState) -> Array:
        return np.zeros(2)

    def _control(self, state: GroupState) -> Control:
        self._approach(self.goal, state)
        return self._tracking.control(self.wheel_speeds(self._with_slip(state)), state)

    def _with_slip(self, state: GroupState) -> Array:
        """Return the (2,) twist of the wheels that turns the robot at the present rate.

        Wheels behind each other slip sideways in a curve, so that the robot turns less than they do. The
        difference is integrated, until the measured rate is the commanded one.
        """
        speed, turn = self._twist_now
        if state.yaw_rate is None or not (speed or turn):
            self._slip = 0.0
            return self._twist_now
        bound = 2.0 * self.limits.velocity[0] * self.settings.wheel_radius / self.settings.wheel_axle_length
        change = SLIP_RATE * state.dt * (turn - state.yaw_rate)
        self._slip = float(np.clip(self._slip + change, -bound, bound))
        return np.array([speed, turn + self._slip])

    def _approach(self, twist: Array, state: GroupState) -> None:
        """Move the present twist towards a (2,) target within the limits of acceleration and stability."""
        led = next_twist(
            self._planar(self._twist_now), self._planar(twist), state, partial(self._reachable, dt=state.dt)
        )
        self._twist_now = np.array([led[:2] @ self.forward, led[2]])

    def _planar(self, twist: Array) -> Array:
        """Return the (3,) twist (x, y, yaw) in the base frame of a (2,) forward speed and yaw rate."""
        return np.append(twist[0] * self.forward, twist[1])

    def _reachable(self, change: Array, dt: float) -> Array:
        """Return a (3,) change of twist, scaled down to the acceleration limits."""
        if self.settings.max_acceleration is None:
            return change
        excess = (np.abs([np.hypot(*change[:2]), change[2]]) / self.settings.max_acceleration).max() / dt
        return change / excess if excess > 1.0 else change

    def reset(self) -> None:
        """Discard goal and velocity."""
        super().reset()
        self._tracking.reset()
        self._twist_now = np.zeros(2)
        self._slip = 0.0

    def wheel_speeds(self, twist: Array) -> Array:
        """Return the (k,) speeds of the wheels, left then right (rad/s), for a (2,) twist (m/s, rad/s)."""
        v, turn = twist
        half = turn * self.settings.wheel_axle_length / 2
        speeds = np.repeat([v - half, v + half], self.limits.size // 2)
        return self.signs * speeds / self.settings.wheel_radius

    def _noop(self, state: GroupState) -> Array:
        return np.zeros(2)

    def odometry(self, wheel_velocities: Array) -> tuple[float, float]:
        """Return forward speed (m/s) and yaw rate (rad/s) from (k,) wheel speeds (rad/s), without slip."""
        return wheel_odometry(
            self.signs * wheel_velocities, self.settings.wheel_radius, self.settings.wheel_axle_length
        )


def wheel_odometry(wheel_velocities: Array, radius: float, axle_length: float) -> tuple[float, float]:
    """Return the motion of a differential drive without slip.

    Args:
        wheel_velocities: (k,) forward speeds of the left wheels, then of the right ones (rad/s).
        radius: of both wheels (m).
        axle_length: distance between the wheels (m).

    Returns:
        Forward speed (m/s) and yaw rate (rad/s).
    """
    left, right = np.reshape(wheel_velocities, (2, -1)).mean(axis=1)
    return float(left + right) / 2 * radius, float(right - left) * radius / axle_length
