"""DifferentialDriveController: forward speed and turning rate by two wheels.

ω_left = (v - ω L/2) / r, ω_right = (v + ω L/2) / r with wheel radius r and axle length L. A command of one
means v_max = w_max r, or ω_max = 2 v_max / L. Where both together ask more of a wheel than it can, both
wheels slow down alike, so that the robot keeps to its curve (OmniGibson clips each wheel alone, which bends
it). An integral brings the wheels to their speeds under load, see `velocity_integral`.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from roboyard.errors import ConfigError
from roboyard.poses import Array
from roboyard.robots.controllers.base import (
    Control,
    Controller,
    ControllerSettings,
    GroupLimits,
    GroupState,
    MotorType,
)
from roboyard.robots.controllers.velocity_integral import VelocityIntegral


class DifferentialDriveSettings(ControllerSettings):
    wheel_radius: float = Field(default=0.0, ge=0)
    """m; from the definition by default."""
    wheel_axle_length: float = Field(default=0.0, ge=0)
    """m, between the wheels; from the definition by default."""


class DifferentialDriveController(Controller):
    Settings: ClassVar[type[ControllerSettings]] = DifferentialDriveSettings
    settings: DifferentialDriveSettings

    def __init__(self, limits: GroupLimits, settings: DifferentialDriveSettings) -> None:
        if limits.size != 2:
            raise ConfigError(
                f"a differential drive has 2 joints (left wheel, right wheel); got {limits.size}"
            )
        if not (settings.wheel_radius > 0 and settings.wheel_axle_length > 0):
            raise ConfigError("a differential drive needs wheel_radius and wheel_axle_length; give both in m")
        if limits.velocity[0] != limits.velocity[1]:
            raise ConfigError(
                f"both wheels need the same velocity limit; they have {limits.velocity[0]} and "
                f"{limits.velocity[1]}"
            )
        super().__init__(limits, settings)
        self._integral = VelocityIntegral(limits.velocity)

    @property
    def command_dim(self) -> int:
        return 2

    @property
    def control_type(self) -> MotorType:
        return "velocity"

    def _default_output_limits(self) -> tuple[Array, Array]:
        fastest = self.limits.velocity[0] * self.settings.wheel_radius
        bound = np.array([fastest, 2.0 * fastest / self.settings.wheel_axle_length])
        return -bound, bound

    def _goal(self, command: Array, state: GroupState) -> Array:
        v, turn = command
        half = turn * self.settings.wheel_axle_length / 2
        wheels = np.array([v - half, v + half]) / self.settings.wheel_radius
        excess = np.abs(wheels).max() / self.limits.velocity[0]
        return wheels / excess if excess > 1.0 else wheels

    def _noop_goal(self, state: GroupState) -> Array:
        return np.zeros(2)

    def _control(self, state: GroupState) -> Control:
        return Control(kind="velocity", value=self._integral.corrected(self.goal, state.v, state.dt))

    def reset(self) -> None:
        super().reset()
        self._integral.reset()

    def _noop(self, state: GroupState) -> Array:
        return np.zeros(2)

    def odometry(self, wheel_velocities: Array) -> tuple[float, float]:
        """Forward speed (m/s) and turning rate (rad/s) of wheels that do not slip: the inverse of the
        formula.
        """
        left, right = wheel_velocities
        r, length = self.settings.wheel_radius, self.settings.wheel_axle_length
        return float(left + right) / 2 * r, float(right - left) * r / length
