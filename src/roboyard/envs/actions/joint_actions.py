"""Actions of single joints: changes of position, positions, and velocities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np

from roboyard.envs.actions.action import Action, BoundAction, Place, group_of
from roboyard.errors import ConfigError
from roboyard.robots.control.controller import acceleration
from roboyard.robots.robot import Robot
from roboyard.transforms import Array


@dataclass(frozen=True)
class JointAction(Action):
    """One number for each joint of a group, or of the joints named."""

    scale: float | tuple[float, ...] = 0.1
    """Largest value of each number (rad, m, or a share of the velocity limit)."""
    names: tuple[str, ...] = ()
    """Joints; those of the group by default."""

    def __post_init__(self) -> None:
        if not (np.asarray(self.scale) > 0).all():
            raise ConfigError(f"{type(self).__name__}: scale must be above 0, got {self.scale}")

    def joints(self, robot: Robot, group: str) -> tuple[str, ...]:
        """Return the joints named, or those of the group."""
        if self.names:
            for name in self.names:
                robot.joint(name)
            return self.names
        return group_of(robot, group).joints


@dataclass(frozen=True)
class JointDelta(JointAction):
    """Changes of joint positions, from the present ones; a joint whose change is 0 keeps its goal.

    The reference moves to the goal with the joints' speeds and accelerations, as that of a robot's
    `JointController` with `use_delta_commands`.
    """

    def bind(self, place: Place) -> BoundAction:
        """Return the action of n environments."""
        return _Delta(place, np.broadcast_to(np.asarray(self.scale, dtype=float), len(place.indices)))

    def controller(self, robot: Robot, group: str) -> dict[str, Any]:
        """Return the keys of the robot's `JointController` that does the same."""
        size = len(self.joints(robot, group))
        bound = np.broadcast_to(np.asarray(self.scale, dtype=float), size).tolist()
        return {
            "name": "JointController",
            "motor_type": "position",
            "use_delta_commands": True,
            "command_output_limits": [[-b for b in bound], bound],
            "keep_balance": False,
        }


@dataclass(frozen=True)
class JointTarget(JointAction):
    """Joint positions around the start posture, or within the joints' limits."""

    scale: float | tuple[float, ...] = 0.5
    around: Literal["rest", "limits"] = "rest"
    """"rest": the start posture plus the number times `scale` (rad or m); "limits": -1 is the lower and 1
    the upper position limit."""
    is_smooth: bool = False
    """Whether the reference moves to the goal with the joints' speeds and accelerations."""

    def bind(self, place: Place) -> BoundAction:
        """Return the action of n environments."""
        low, high = place.arrays.lower[place.indices], place.arrays.upper[place.indices]
        if self.around == "rest":
            middle = place.arrays.rest[place.indices]
            half = np.broadcast_to(np.asarray(self.scale, dtype=float), middle.shape)
        else:
            if not (np.isfinite(low) & np.isfinite(high)).all():
                raise ConfigError(f"JointTarget of {place.group!r}: joints without limits; use around='rest'")
            middle, half = (low + high) / 2, (high - low) / 2
        return _Target(place, middle, half, is_smooth=self.is_smooth)


@dataclass(frozen=True)
class JointVelocity(JointAction):
    """Joint velocities, as shares of the velocity limits."""

    scale: float | tuple[float, ...] = 1.0
    kind: ClassVar[Literal["position", "velocity"]] = "velocity"

    def bind(self, place: Place) -> BoundAction:
        """Return the action of n environments."""
        return _Velocity(place, np.asarray(self.scale, dtype=float) * place.velocity_limits)


class References:
    """References of k joints in n environments that move to their goals as drives can follow.

    The law is that of `roboyard.robots.control.rate_limiter`, without its balance.
    """

    def __init__(self, place: Place) -> None:
        indices = place.indices
        self._fastest = place.velocity_limits
        limits = place.robot.limits
        inertia = place.robot.joint_arrays.inertia
        self._rise = acceleration(limits, inertia)[indices]
        self._dt = place.dt
        count = place.physics.count
        self.position = np.tile(place.drives.position[0, indices], (count, 1))
        self._speed = np.zeros_like(self.position)

    def reset(self, rows: np.ndarray, q: Array) -> None:
        """Start at joint positions q (k, j) (rad or m)."""
        self.position[rows] = q
        self._speed[rows] = 0.0

    def follow(self, goal: Array) -> Array:
        """Return (n, k) references, moved one step towards the goals (n, k) (rad or m)."""
        dt, rise = self._dt, self._rise
        gap = goal - self.position
        distance = np.abs(gap)
        half = 0.5 * rise * dt
        braking = np.sqrt(half * half + 2.0 * rise * distance) - half
        wanted = np.copysign(np.minimum(np.minimum(self._fastest, braking), distance / dt), gap)
        change = rise * dt
        speed = np.clip(wanted, self._speed - change, self._speed + change)
        move = speed * dt
        arrives = (np.abs(move) >= (1.0 - 1e-9) * distance) & (move * gap >= 0.0)
        self.position = np.where(arrives, goal, self.position + move)
        self._speed = np.where(arrives, 0.0, speed)
        return self.position


class _Delta(BoundAction):
    def __init__(self, place: Place, scale: Array) -> None:
        self.size = len(place.indices)
        self._place, self._scale = place, scale
        self._columns = place.indices
        self._low, self._high = place.arrays.lower[self._columns], place.arrays.upper[self._columns]
        self._references = References(place)
        self._goal = self._references.position.copy()

    def reset(self, rows: np.ndarray) -> None:
        q = self._place.arrays.q[rows][:, self._columns]
        self._goal[rows] = q
        self._references.reset(rows, q)

    def apply(self, command: Array) -> None:
        q = self._place.arrays.q[:, self._columns]
        changed = np.clip(q + command * self._scale, self._low, self._high)
        self._goal = np.where(command == 0.0, self._goal, changed)
        self._place.drives.position[:, self._columns] = self._references.follow(self._goal)


class _Target(BoundAction):
    def __init__(self, place: Place, middle: Array, half: Array, *, is_smooth: bool) -> None:
        self.size = len(place.indices)
        self._place, self._middle, self._half = place, middle, half
        self._columns = place.indices
        self._low, self._high = place.arrays.lower[self._columns], place.arrays.upper[self._columns]
        self._references = References(place) if is_smooth else None

    def reset(self, rows: np.ndarray) -> None:
        if self._references is not None:
            self._references.reset(rows, self._place.arrays.q[rows][:, self._columns])

    def apply(self, command: Array) -> None:
        goal = np.clip(self._middle + self._half * command, self._low, self._high)
        if self._references is not None:
            goal = self._references.follow(goal)
        self._place.drives.position[:, self._columns] = goal


class _Velocity(BoundAction):
    def __init__(self, place: Place, fastest: Array) -> None:
        self.size = len(place.indices)
        self._place, self._fastest = place, fastest

    def apply(self, command: Array) -> None:
        self._place.drives.velocity[:, self._place.indices] = command * self._fastest
