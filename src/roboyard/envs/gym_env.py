"""One environment of a task, as a `gymnasium.Env`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from roboyard.envs.observer import joined
from roboyard.envs.pictures.picture_arrays import PictureArrays
from roboyard.envs.runner import Runner
from roboyard.envs.spaces import action_space, observation_space, split_modalities
from roboyard.envs.task import Task
from roboyard.errors import ConfigError, RoboyardError
from roboyard.robots.robot import Robot
from roboyard.sim.world import World


class TaskEnv(gymnasium.Env[Any, np.ndarray]):
    """One environment of a task: the same physics, actions and functions as those of `BatchEnv`, bit for bit.

    `world` and `robot` are the full world and robot in the present state, for sensors, queries and pictures.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 30}  # noqa: RUF012 - of Gymnasium

    def __init__(
        self,
        task: Task,
        *,
        obs_modalities: Sequence[str] | None = None,
        render_mode: str | None = None,
        state_folder: Path | str | None = None,
    ) -> None:
        """Build the task's world.

        Args:
            task: to run.
            obs_modalities: as in `BatchEnv`.
            render_mode: None, "rgb_array" for pictures, or "human" for a page in the browser.
            state_folder: where states of simulations that diverged are kept; a temporary folder by default.

        Raises:
            ConfigError: a name in the task is unknown, or a function returns another shape.
            ModelError: the world has rules that many copies of it cannot follow.
        """
        if render_mode not in (None, "human", "rgb_array"):
            raise ConfigError(f"render_mode must be None, 'human' or 'rgb_array', got {render_mode!r}")
        vectors, pictures = split_modalities(task, obs_modalities)
        self.runner = Runner(
            task,
            1,
            modalities=vectors,
            threads=1,
            state_folder=None if state_folder is None else Path(state_folder),
        )
        """The environment as arrays of one row."""
        self._pictures = PictureArrays(self.runner, pictures, threads=1) if pictures else None
        self.action_space = action_space(self.runner)
        self.observation_space = observation_space(self.runner, self._pictures)
        self.metadata = {**type(self).metadata, "render_fps": round(task.control_freq)}
        self.render_mode = render_mode
        self._viewer: Any = None
        self._is_over = True

    @property
    def world(self) -> World:
        """The world in the present state."""
        return self.runner.show()

    @property
    def robot(self) -> Robot:
        """The robot in the present state."""
        return self.runner.robot()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: of the random stream; None: it goes on.
            options: none are known.

        Returns:
            Observation and an empty dictionary.
        """
        super().reset(seed=seed)
        self.runner.streams[0] = self.np_random
        found = self.runner.reset()
        self._is_over = False
        if self.render_mode == "human":
            self.render()
        return self._observation(found), {}

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance by one action, (k,) within -1 to 1.

        Returns:
            Observation, reward, terminated, truncated, info: "rewards" by name, "success", "diverged"; and at
            an episode's end "episode_rewards" by name.

        Raises:
            RoboyardError: the action has another shape or is not finite, or the episode is over.
        """
        if self._is_over:
            raise RoboyardError("the episode is over, or none has begun; call reset()")
        given = np.asarray(action, dtype=float)
        if given.shape != self.action_space.shape:
            raise RoboyardError(f"an action must have shape {self.action_space.shape}, got {given.shape}")
        result = self.runner.step(given[None])
        terminated, truncated = bool(result.terminated[0]), bool(result.truncated[0])
        info = {key: _first(value) for key, value in result.info.items()}
        self._is_over = terminated or truncated
        if self._is_over:
            info["episode_rewards"] = {k: float(v[0]) for k, v in self.runner.episode_rewards.items()}
        if self.render_mode == "human":
            self.render()
        return self._observation(result.observations), float(result.reward[0]), terminated, truncated, info

    def _observation(self, found: dict[str, np.ndarray]) -> Any:
        if self._pictures is None:
            return joined(found)[0]
        return {name: values[0] for name, values in {**found, **self._pictures.take()}.items()}

    def render(self) -> Any:
        """Return a picture (h, w, 3) with render_mode "rgb_array", or update the page of "human"."""
        if self.render_mode == "rgb_array":
            from roboyard.envs.pictures.task_view import task_picture

            return task_picture(self.runner, 0)
        if self.render_mode == "human":
            self._show()
        return None

    def _show(self) -> None:
        world = self.runner.show()
        if self._viewer is None:
            from roboyard.viewer import Viewer

            self._viewer = Viewer(world)
        else:
            self._viewer.sync()

    def close(self) -> None:
        """Close the page, if there is one."""
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None


def _first(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _first(part) for key, part in value.items()}
    first = value[0]
    return first.item() if isinstance(first, np.generic) else first
