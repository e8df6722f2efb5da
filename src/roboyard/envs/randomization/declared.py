"""The base of all declared differences from episode to episode, and checks of their values."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

import numpy as np

from roboyard.envs.body_arrays import BodyArrays
from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.errors import ConfigError, unknown_name
from roboyard.robots.robot import Robot

Range = tuple[float, float]
"""Least and largest value."""
Draw = Callable[[Rows, RandomRows], None]
"""Draws new values for environments whose episodes start."""


class Randomization(ABC):
    """Something that differs from episode to episode."""

    @abstractmethod
    def bind(self, env: EnvArrays) -> Draw | None:
        """Return a function (rows, random) that draws new values; None where something else does.

        Raises:
            ConfigError: a name is unknown, or a range does not fit.
        """


def check_range(name: str, bounds: Range, least: float = -np.inf, most: float = np.inf) -> None:
    """Check a range of values.

    Raises:
        ConfigError: it is not (low, high) within `least` to `most`.
    """
    low, high = bounds
    if not (least <= low <= high <= most and np.isfinite(high)):
        limits = f"low at least {least:g}" + (f" and high at most {most:g}" if np.isfinite(most) else "")
        raise ConfigError(f"{name}: a range must be (low, high) with {limits}, got {bounds}")


def rows_of_links(body: BodyArrays, links: Sequence[str]) -> np.ndarray:
    """Return (k,) rows of links in MuJoCo's arrays of bodies; all of the body where none is named."""
    names = list(links) or [link.name for link in body.body.links]
    return np.array([body.link(name).row for name in names], dtype=np.intp)


def robot_of(env: EnvArrays, name: str) -> Robot:
    """Return a robot by the task's name.

    Raises:
        ConfigError: there is none; the message lists the nearest.
    """
    if name not in env.robots:
        raise ConfigError(unknown_name("robot of the task", name, env.robots))
    return env.robots[name].robot
