"""NullJointController: no command; its joints stay at a default goal."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.errors import ConfigError
from roboyard.robots.control.controller import ControllerSettings, GroupLimits, GroupState
from roboyard.robots.control.joint import JointController, JointSettings
from roboyard.transforms import Array


class NullJointSettings(JointSettings):
    """Keys of a NullJointController."""

    default_goal: tuple[float, ...] | None = None
    """(n,) positions, velocities or efforts; zeros by default."""


class NullJointController(JointController):
    """Keeps its joints at a default goal."""

    Settings: ClassVar[type[ControllerSettings]] = NullJointSettings
    settings: NullJointSettings  # pyright: ignore[reportIncompatibleVariableOverride]

    def __init__(self, limits: GroupLimits, settings: NullJointSettings) -> None:
        """Create the controller of a group from its limits and keys."""
        super().__init__(limits, settings)
        self._default = np.zeros(limits.size)
        if settings.default_goal is not None:
            self.set_default_goal(settings.default_goal)

    @property
    def command_dim(self) -> int:
        """Numbers in a command: none."""
        return 0

    @property
    def default_goal(self) -> Array:
        """(n,) positions, velocities or efforts that the joints stay at."""
        return self._default.copy()

    def set_default_goal(self, goal: ArrayLike) -> None:
        """Change the default goal.

        Args:
            goal: (n,) positions, velocities or efforts.

        Raises:
            ConfigError: it does not have one number for each joint.
        """
        values = np.array(goal, dtype=float)
        if values.shape != (self.limits.size,):
            raise ConfigError(
                f"default_goal: has shape {values.shape}; the group has {self.limits.size} joints"
            )
        self._default = values
        self.goal = None

    def _default_output_limits(self) -> tuple[ArrayLike, ArrayLike]:
        return 0.0, 0.0

    def _goal(self, command: Array, state: GroupState) -> Array:
        return self._default

    def _noop_goal(self, state: GroupState) -> Array:
        return self._default

    def _noop(self, state: GroupState) -> Any:
        return np.zeros(0)
