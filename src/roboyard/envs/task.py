"""A task: a world, the commands of its robot, and named functions of the state of n environments.

Every function of a task is given the `EnvArrays` of n environments and returns an array with n rows, so that
the same task runs once or in thousands of copies.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from roboyard.errors import ConfigError
from roboyard.robots.robot import Robot
from roboyard.sim.body import Body
from roboyard.sim.world import World

if TYPE_CHECKING:
    from roboyard.envs.actions.action import Action
    from roboyard.envs.env_arrays import EnvArrays
    from roboyard.envs.random_rows import RandomRows, Rows
    from roboyard.envs.randomization import Randomization

Term: TypeAlias = "Callable[[EnvArrays], np.ndarray[Any, np.dtype[Any]]]"
"""A function of the state: EnvArrays to an array with n rows."""
ResetTerm: TypeAlias = "Callable[[EnvArrays, Rows, RandomRows], None]"
"""A change at the start of an episode: of the environments `rows`, with one random stream for each."""
Built: TypeAlias = "Robot | Mapping[str, Robot | Body]"
"""The result of a world builder: the robot alone, or robots and bodies by the names that the task's functions
use."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Reward:
    """One part of the reward: weight times function, (n,) for each control step."""

    function: Term
    weight: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Task:
    """A task for one robot or several."""

    build: Callable[[World], Built]
    """Fills an empty world."""
    actions: Mapping[str, Action] | Callable[[Robot], Mapping[str, Action]]
    """Group of joints ("arm_left", or "robot/arm_left" where there are several robots) to the meaning of
    its numbers in an action; in this order."""
    observations: Mapping[str, Term | Mapping[str, Term]]
    """Name to function returning (n, k) or (n,); or modality ("proprio", "state") to such a mapping."""
    rewards: Mapping[str, Reward | Term] = field(default_factory=dict)
    """Name to the parts of the reward; each is reported in `info["rewards"]`."""
    success: Term | None = None
    """(n,) whether the goal is reached now; reported, and ends no episode by itself."""
    terminations: Mapping[str, Term] = field(default_factory=dict)
    """Name to (n,) whether an episode ends."""
    reset: Sequence[ResetTerm] = ()
    """Changes at the start of each episode, in order."""
    randomize: Sequence[Randomization] = ()
    """Differences from episode to episode: masses, friction, gains, delays, start states."""
    buffers: Mapping[str, int | tuple[int, ...]] = field(default_factory=dict)
    """Name to the shape of numbers that each environment keeps, such as a goal; zero at first."""
    cameras: Sequence[str] = ("rgb",)
    """Modalities of the robot's cameras and lidars that `obs_modalities` may ask for."""
    limit: int = 100
    """Control steps after which an episode is cut off."""
    control_freq: float = 30.0
    """Rate of actions (Hz)."""
    timestep: float = 1 / 240
    """Time step of the physics (s)."""
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    """In the world frame (m/s²)."""
    cone: Literal["elliptic", "pyramidal"] = "elliptic"
    """Friction cones of contacts: exact ones; or pyramids inside them, which are faster to solve and hold up
    to 30 % less in directions between their edges: for feet, not for grasped objects."""
    reward_floor: float | None = None
    """Least reward of a step; None for none."""
    view: tuple[tuple[float, float, float], tuple[float, float, float]] = ((1.8, -1.8, 1.4), (0.0, 0.0, 0.4))
    """Where pictures of the task are taken from, and the point they show (m, in the world frame)."""

    def __post_init__(self) -> None:
        if self.limit < 1:
            raise ConfigError(f"limit must be at least 1 control step, got {self.limit}")
        if self.cone not in ("elliptic", "pyramidal"):
            raise ConfigError(f"cone must be 'elliptic' or 'pyramidal', got {self.cone!r}")
        if not (self.timestep > 0 and 0 < self.control_freq * self.timestep <= 1.0 + 1e-9):
            raise ConfigError(
                f"control_freq must be above 0 and at most {1 / self.timestep:g} Hz, the rate of time steps, "
                f"got {self.control_freq:g}"
            )

    @property
    def substeps(self) -> int:
        """Time steps for each action."""
        return max(1, round(1.0 / (self.control_freq * self.timestep)))

    @property
    def parts(self) -> dict[str, Reward]:
        """The parts of the reward by name."""
        return {
            name: part if isinstance(part, Reward) else Reward(function=part)
            for name, part in self.rewards.items()
        }

    @property
    def modalities(self) -> dict[str, dict[str, Term]]:
        """Observed functions by modality and name; those given without a modality are "state"."""
        found: dict[str, dict[str, Term]] = {}
        for name, given in self.observations.items():
            if isinstance(given, Mapping):
                found.setdefault(name, {}).update(given)
            else:
                found.setdefault("state", {})[name] = given
        return found
