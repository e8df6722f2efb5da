"""The state of n environments as arrays: what the functions of a task are given."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from roboyard.envs.batch_physics import BatchPhysics
from roboyard.envs.body_arrays import BodyArrays, RobotArrays
from roboyard.envs.pictures.appearance import Appearance
from roboyard.envs.random_rows import Rows
from roboyard.errors import ConfigError, unknown_name
from roboyard.robots.robot import Robot
from roboyard.sim.body import Body
from roboyard.transforms import Array


class EnvArrays:
    """n environments; every array has n rows."""

    def __init__(
        self,
        physics: BatchPhysics,
        bodies: Mapping[str, Robot | Body],
        buffers: Mapping[str, int | tuple[int, ...]],
        dt: float,
    ) -> None:
        """Create the arrays.

        Args:
            physics: of the environments.
            bodies: robots and other bodies by the task's names.
            buffers: name to the shape of numbers that each environment keeps.
            dt: time between actions (s).

        Raises:
            ConfigError: there is no robot.
        """
        self.physics = physics
        self.n = physics.count
        """Number of environments."""
        self.dt = dt
        """Time between actions (s)."""
        self.steps = np.zeros(self.n, dtype=np.int64)
        """(n,) control steps of the present episodes."""
        self.robots: dict[str, RobotArrays] = {}
        """Robots by the task's names."""
        self.bodies: dict[str, BodyArrays] = {}
        """Robots and bodies by the task's names."""
        for name, body in bodies.items():
            if isinstance(body, Robot):
                self.bodies[name] = self.robots[name] = RobotArrays(physics, body)
            else:
                self.bodies[name] = BodyArrays(physics, body)
        if not self.robots:
            raise ConfigError("the world of a task needs a robot; return it from `build`")
        self._buffers = {
            name: np.zeros((self.n, *((size,) if isinstance(size, int) else size)))
            for name, size in buffers.items()
        }
        self._known: dict[Callable[[EnvArrays], Array], Array] = {}
        self.action = np.zeros((self.n, 0))
        """(n, k) last actions, as given, within -1 to 1."""
        self.last_action = np.zeros((self.n, 0))
        """(n, k) actions before the last."""

    @cached_property
    def appearance(self) -> Appearance:
        """Colours, lights and camera poses of the environments."""
        return Appearance(self.physics, self.robot.robot)

    @property
    def robot(self) -> RobotArrays:
        """The first robot."""
        return next(iter(self.robots.values()))

    @property
    def time(self) -> Array:
        """(n,) time since the start of the episodes (s)."""
        return self.dt * self.steps.astype(float)

    def once(self, term: Callable[[EnvArrays], Array]) -> Array:
        """Return (n, ...) what a function of the state gives, computed once between changes of the state.

        For a quantity that several observations and rewards use; do not write into the array.

        Args:
            term: the same function object in each call.
        """
        if term not in self._known:
            self._known[term] = term(self)
        return self._known[term]

    def forget(self) -> None:
        """Drop what `once` has computed; the environments do it when the state changes."""
        self._known.clear()

    def body(self, name: str) -> BodyArrays:
        """Return the arrays of a robot or body by the task's name.

        Raises:
            ConfigError: there is none; the message lists the nearest.
        """
        if name not in self.bodies:
            raise ConfigError(unknown_name("body of the task", name, self.bodies))
        return self.bodies[name]

    def __getitem__(self, name: str) -> Array:
        """Return a buffer of the task by name, (n, ...); write into it in place.

        Raises:
            ConfigError: there is none; the message lists the nearest.
        """
        if name not in self._buffers:
            raise ConfigError(unknown_name("buffer of the task", name, self._buffers))
        return self._buffers[name]

    def clear(self, rows: Rows) -> None:
        """Start episodes: time, buffers and last actions are zero."""
        self.steps[rows] = 0
        for buffer in self._buffers.values():
            buffer[rows] = 0.0
        self.action[rows] = 0.0
        self.last_action[rows] = 0.0


def named_bodies(built: Any) -> dict[str, Robot | Body]:
    """Return the robots and bodies that a world builder returned, by name.

    Raises:
        ConfigError: it returned something else.
    """
    if isinstance(built, Robot):
        return {"robot": built}
    if isinstance(built, Mapping) and all(isinstance(v, Robot | Body) for v in built.values()):
        return dict(built)
    raise ConfigError(
        "build: the world builder of a task must return a robot, or a mapping of names to robots and bodies, "
        f"got {built!r}"
    )
