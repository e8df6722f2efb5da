"""HolonomicBaseJointController: a base driven along x and y and about z, commanded in its own frame.

With R, p the pose of the base in the frame its virtual joints start from, and a command (c_x, c_y, c_ω):

    velocity   (v_x, v_y) = R_xy(ω dt / 2) R (c_x, c_y),  ω = c_ω
    position   (x, y) = p + R (c_x, c_y),  rz = rz + c_ω

Velocities change by at most `max_acceleration` in the base's frame, and by less where a robot would tip over;
curves that would tip it are driven slower, all three velocities alike so that the curve stays the same
(see `roboyard.robots.stability.zmp`).

The goal is the command itself, turned into the base's present frame at every step, and by half the turn
that the base makes before the next one; so a held command drives an arc (OmniGibson freezes the direction
at the time of the command). A base with zero command holds its position. Joint angles are
not wrapped.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import model_validator

from roboyard.errors import ConfigError
from roboyard.robots.control.controller import (
    Control,
    ControllerSettings,
    GroupLimits,
    GroupState,
    MotorType,
    refuse_keys,
)
from roboyard.robots.control.joint import JointController, JointSettings
from roboyard.robots.control.twist_ramp import next_twist
from roboyard.transforms import Array


class HolonomicBaseSettings(JointSettings):
    """Keys of a HolonomicBaseJointController."""

    motor_type: MotorType = "velocity"
    max_acceleration: tuple[float, float, float] | None = (1.5, 1.5, 3.0)
    """Largest acceleration along x, y and about z (m/s², m/s², rad/s²); None: unlimited."""

    @model_validator(mode="after")
    def _is_absolute(self) -> HolonomicBaseSettings:
        if self.use_delta_commands:
            raise ValueError(
                "use_delta_commands must be false: commands to a holonomic base are already relative to it"
            )
        if self.motor_type != "velocity":
            refuse_keys(self, ("max_acceleration",), f"with motor_type {self.motor_type!r}")
        if self.max_acceleration is not None and not min(self.max_acceleration) > 0:
            raise ValueError(
                f"max_acceleration: must be three positive numbers, or null, got {self.max_acceleration}"
            )
        return self


class HolonomicBaseJointController(JointController):
    """Drives the x, y and rz joints of a holonomic base."""

    Settings: ClassVar[type[ControllerSettings]] = HolonomicBaseSettings
    settings: HolonomicBaseSettings  # pyright: ignore[reportIncompatibleVariableOverride]

    def __init__(self, limits: GroupLimits, settings: HolonomicBaseSettings) -> None:
        """Create the controller of a base from its limits and keys.

        Raises:
            ConfigError: the group does not have three joints.
        """
        if limits.size != 3:
            raise ConfigError(f"a holonomic base has 3 joints (x, y, rz); got {limits.size}")
        super().__init__(limits, settings)
        self._velocity_now = np.zeros(3)
        self.keeps_balance = settings.max_acceleration is not None  # type: ignore[misc]

    def _within_limits(self, speed: Array, state: GroupState) -> Array:
        """Return the speeds as they are: the virtual joints of a base have no stops."""
        return speed

    def reset(self) -> None:
        """Discard goal and velocity."""
        super().reset()
        self._velocity_now = np.zeros(3)

    def _limited_twist(self, command: Array, state: GroupState) -> Array:
        """Return the (3,) twist of this step, limited by acceleration and stability (m/s, m/s, rad/s)."""
        if self.settings.max_acceleration is None or self.settings.motor_type != "velocity":
            return command
        reach = np.asarray(self.settings.max_acceleration) * state.dt
        self._velocity_now = next_twist(
            self._velocity_now, command, state, lambda change: np.clip(change, -reach, reach)
        )
        return self._velocity_now

    def _goal(self, command: Array, state: GroupState) -> Array:
        if self.settings.motor_type != "position":
            low, high = self.limits.of(self.settings.motor_type)
            return np.clip(command, low, high)
        shift = state.mount[:2, :2] @ command[:2]
        turn = (command[2] + np.pi) % (2 * np.pi) - np.pi
        return np.array([state.mount[0, 3] + shift[0], state.mount[1, 3] + shift[1], state.q[2] + turn])

    def _control(self, state: GroupState) -> Control:
        if self.settings.motor_type == "position":
            return super()._control(state)
        command = self._limited_twist(self.goal, state)
        half = command[2] * state.dt / 2 if self.settings.motor_type == "velocity" else 0.0
        turned = state.mount[:2, :2] @ command[:2]
        c, s = np.cos(half), np.sin(half)
        wanted = np.array([c * turned[0] - s * turned[1], s * turned[0] + c * turned[1], command[2]])
        goal, self.goal = self.goal, wanted
        try:
            return super()._control(state)
        finally:
            self.goal = goal

    def _noop(self, state: GroupState) -> Array:
        return np.zeros(3)
