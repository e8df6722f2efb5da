"""Differences from episode to episode, by declaration: masses, friction, gains, delays, start states.

Each is drawn again at the start of an episode from the environment's own stream.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from roboyard.envs.body_arrays import BodyArrays
from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.errors import ConfigError
from roboyard.transforms import Array

Range = tuple[float, float]


class Randomization(ABC):
    """Something that differs from episode to episode."""

    @abstractmethod
    def bind(self, env: EnvArrays) -> Any:
        """Return a function (rows, random) that draws new values.

        Raises:
            ConfigError: a name is unknown, or a range does not fit.
        """


def _check(name: str, bounds: Range, least: float = -np.inf) -> None:
    low, high = bounds
    if not (least <= low <= high < np.inf):
        raise ConfigError(f"{name}: a range must be (low, high) with low at least {least:g}, got {bounds}")


def _body_rows(body: BodyArrays, links: Sequence[str]) -> np.ndarray:
    names = list(links) or [link.name for link in body.body.links]
    return np.array([body.link(name).row for name in names], dtype=np.intp)


@dataclass(frozen=True)
class Mass(Randomization):
    """Mass and inertia of links, by a common factor."""

    body: str
    factor: Range = (0.8, 1.2)
    links: tuple[str, ...] = ()
    """Links; all of the body by default."""

    def bind(self, env: EnvArrays) -> Any:
        """Return the function that draws masses."""
        _check("Mass.factor", self.factor, 1e-6)
        rows_of_body = _body_rows(env.body(self.body), self.links)
        physics = env.physics
        mass, inertia = physics.model_field("body_mass"), physics.model_field("body_inertia")
        own_mass, own_inertia = mass[0, rows_of_body].copy(), inertia[0, rows_of_body].copy()

        def draw(rows: Rows, random: RandomRows) -> None:
            factor = random.uniform(*self.factor)
            mass[np.ix_(rows, rows_of_body)] = factor[:, None] * own_mass
            inertia[np.ix_(rows, rows_of_body)] = factor[:, None, None] * own_inertia
            physics.update_constants(rows)

        return draw


@dataclass(frozen=True)
class Friction(Randomization):
    """Sliding friction of a body's shapes; between two bodies the larger coefficient acts."""

    body: str
    coefficient: Range = (0.5, 1.2)
    links: tuple[str, ...] = ()
    """Links; all of the body by default."""

    def bind(self, env: EnvArrays) -> Any:
        """Return the function that draws coefficients."""
        _check("Friction.coefficient", self.coefficient, 0.0)
        physics = env.physics
        geoms = np.flatnonzero(
            np.isin(physics.world.model.geom_bodyid, _body_rows(env.body(self.body), self.links))
        )
        friction = physics.model_field("geom_friction")

        def draw(rows: Rows, random: RandomRows) -> None:
            friction[rows[:, None], geoms, 0] = random.uniform(*self.coefficient)[:, None]

        return draw


@dataclass(frozen=True)
class Gains(Randomization):
    """Stiffness and damping of a robot's drives, by factors."""

    robot: str = "robot"
    stiffness: Range = (0.9, 1.1)
    damping: Range = (0.9, 1.1)

    def bind(self, env: EnvArrays) -> Any:
        """Return the function that draws gains."""
        _check("Gains.stiffness", self.stiffness, 0.0)
        _check("Gains.damping", self.damping, 0.0)
        joints = _robot(env, self.robot).joint_arrays
        rows_of_drives = np.array([joints.joints[i]._built.actuator.id for i in joints.driven], dtype=np.intp)
        bias = env.physics.model_field("actuator_biasprm")
        own = bias[0, rows_of_drives].copy()

        def draw(rows: Rows, random: RandomRows) -> None:
            for column, bounds in ((1, self.stiffness), (2, self.damping)):
                bias[rows[:, None], rows_of_drives, column] = (
                    random.uniform(*bounds)[:, None] * own[:, column]
                )

        return draw


@dataclass(frozen=True)
class Gravity(Randomization):
    """Direction and size of gravity: changes along each axis (m/s²)."""

    change: Range = (-0.1, 0.1)

    def bind(self, env: EnvArrays) -> Any:
        """Return the function that draws gravity."""
        _check("Gravity.change", self.change)
        gravity = env.physics.model_field("opt.gravity")
        own = gravity[0].copy()

        def draw(rows: Rows, random: RandomRows) -> None:
            gravity[rows] = own + random.uniform(*self.change, size=3)

        return draw


@dataclass(frozen=True)
class Delay(Randomization):
    """Actions act so many control steps late."""

    steps: tuple[int, int] = (0, 1)

    def bind(self, env: EnvArrays) -> Any:
        """Return the function that draws delays; `Randomizer` keeps past actions."""
        if not 0 <= self.steps[0] <= self.steps[1] <= 100:
            raise ConfigError(f"Delay.steps: a range must be (low, high) from 0 to 100, got {self.steps}")
        return None


@dataclass(frozen=True)
class JointNoise(Randomization):
    """Joints of a robot start away from the start posture (rad or m), within their limits."""

    robot: str = "robot"
    position: float = 0.05
    velocity: float = 0.0
    names: tuple[str, ...] = ()
    """Joints; all that have limits by default."""

    def bind(self, env: EnvArrays) -> Any:
        """Return the function that draws joint positions."""
        _robot(env, self.robot)
        arrays = env.robots[self.robot]
        limited = [j.name for j in arrays.robot.joint_arrays.joints if j.limits is not None]
        indices = arrays.indices_of(self.names or limited)

        def draw(rows: Rows, random: RandomRows) -> None:
            q, v = arrays.q[rows], np.array(arrays.v[rows])
            q[:, indices] += random.uniform(-self.position, self.position, size=len(indices))
            v[:, indices] += random.uniform(-self.velocity, self.velocity, size=len(indices))
            arrays.set_joints(rows, np.clip(q, arrays.lower, arrays.upper), v)

        return draw


@dataclass(frozen=True)
class Pose(Randomization):
    """A free body starts elsewhere: shifted along x and y and turned about z from where the world has it."""

    body: str
    x: Range = (0.0, 0.0)
    y: Range = (0.0, 0.0)
    yaw: Range = (-np.pi, np.pi)

    def bind(self, env: EnvArrays) -> Any:
        """Return the function that draws poses."""
        for name in ("x", "y", "yaw"):
            _check(f"Pose.{name}", getattr(self, name))
        body = env.body(self.body)
        from roboyard.transforms import multiply

        position, quaternion = body.body.pose

        def draw(rows: Rows, random: RandomRows) -> None:
            shift = np.stack([random.uniform(*self.x), random.uniform(*self.y), np.zeros(len(rows))], axis=1)
            turn = random.yaw_quaternion(*self.yaw)
            body.set_pose(rows, position + shift, multiply(turn, np.broadcast_to(quaternion, turn.shape)))

        if not body.is_free:
            raise ConfigError(f"Pose: {self.body!r} is fixed to the world")
        return draw


def _robot(env: EnvArrays, name: str) -> Any:
    from roboyard.errors import unknown_name

    if name not in env.robots:
        raise ConfigError(unknown_name("robot of the task", name, env.robots))
    return env.robots[name].robot


class Randomizer:
    """All randomisations of n environments, and the actions that wait for their delay."""

    def __init__(self, declared: Sequence[Randomization], env: EnvArrays) -> None:
        """Bind the declarations to bodies and robots."""
        self._draws = [draw for d in declared if (draw := d.bind(env)) is not None]
        delays = [d for d in declared if isinstance(d, Delay)]
        if len(delays) > 1:
            raise ConfigError("randomize: give one Delay")
        self._bounds = delays[0].steps if delays else (0, 0)
        self._delay = np.zeros(env.n, dtype=np.intp)
        self._past: list[Array] = []
        self._env = env

    def start(self, rows: Rows, random: RandomRows) -> None:
        """Draw new values for episodes that start."""
        for draw in self._draws:
            draw(rows, random)
        if self._bounds[1]:
            self._delay[rows] = random.integers(*self._bounds)
            for past in self._past:
                past[rows] = 0.0

    def delayed(self, actions: Array) -> Array:
        """Return the actions that act now, (n, k)."""
        longest = self._bounds[1]
        if not longest:
            return actions
        if not self._past:
            self._past = [np.zeros_like(actions) for _ in range(longest + 1)]
        self._past = [actions.copy(), *self._past[:longest]]
        return np.stack(self._past)[self._delay, np.arange(len(actions))]


__all__ = [
    "Delay",
    "Friction",
    "Gains",
    "Gravity",
    "JointNoise",
    "Mass",
    "Pose",
    "Randomization",
    "Randomizer",
]
