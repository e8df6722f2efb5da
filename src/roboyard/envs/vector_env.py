"""Many environments of one task in one process, as a `gymnasium.vector.VectorEnv`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from roboyard.envs.batch_physics import BatchPhysics
from roboyard.envs.pictures.picture_arrays import PictureArrays
from roboyard.envs.runner import Runner, StepRows
from roboyard.envs.spaces import action_space, observation_space, split_modalities
from roboyard.envs.task import Task
from roboyard.errors import ConfigError, RoboyardError


class BatchEnv(VectorEnv[Any, np.ndarray, np.ndarray]):
    """n environments of a task, stepped on threads of one process.

    Observations are one (n, k) float32 array of all modalities, or a dictionary by modality where pictures
    are among them. With the autoreset mode "same_step" (the default) the observation after an episode's end
    is the first of the next one, and `info["final_obs"]` and `info["final_info"]` have the last ones.
    """

    def __init__(
        self,
        task: Task,
        num_envs: int,
        *,
        obs_modalities: Sequence[str] | None = None,
        autoreset: Literal["same_step", "next_step", "disabled"] = "same_step",
        threads: int = 0,
        render_mode: str | None = None,
        state_folder: Path | str | None = None,
        first_seed: int = 0,
        make_physics: Callable[..., BatchPhysics] = BatchPhysics,
    ) -> None:
        """Build the task's world once and copy it.

        Args:
            task: to run.
            num_envs: n.
            obs_modalities: "proprio", "state" and others of the task's functions (all of them by default),
                and "rgb", "depth", "seg", "scan" of the robot's cameras and lidars.
            autoreset: when new episodes start.
            threads: of the processor; 0 for all that this process may use.
            render_mode: None, or "rgb_array" for pictures of all environments.
            state_folder: where states of simulations that diverged are kept; a temporary folder by default.
            first_seed: added to the number of an environment where `reset` is given one seed; workers of a
                larger set of environments pass the number of their first one.
            make_physics: makes the simulations of (world, count, threads=...), as `BatchPhysics`.

        Raises:
            ConfigError: a name in the task is unknown, or a function returns another shape.
            ModelError: the world has rules that copies of it cannot follow.
        """
        if render_mode not in (None, "rgb_array"):
            raise ConfigError(f"render_mode must be None or 'rgb_array', got {render_mode!r}")
        vectors, pictures = split_modalities(task, obs_modalities)
        self.runner = Runner(
            task,
            num_envs,
            modalities=vectors,
            threads=threads,
            state_folder=None if state_folder is None else Path(state_folder),
            make_physics=make_physics,
        )
        """The environments as arrays."""
        self._pictures = PictureArrays(self.runner, pictures, threads=threads) if pictures else None
        self.num_envs = num_envs
        self.single_action_space = action_space(self.runner)
        self.single_observation_space = observation_space(self.runner, self._pictures)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        modes = {
            "same_step": AutoresetMode.SAME_STEP,
            "next_step": AutoresetMode.NEXT_STEP,
            "disabled": AutoresetMode.DISABLED,
        }
        if autoreset not in modes:
            raise ConfigError(f"autoreset must be one of {', '.join(modes)}, got {autoreset!r}")
        self._mode = modes[autoreset]
        self.render_mode = render_mode
        self.metadata = {
            "render_modes": ["rgb_array"],
            "render_fps": round(task.control_freq),
            "autoreset_mode": self._mode,
        }
        self._first_seed = first_seed
        self._ended = np.zeros(num_envs, dtype=bool)
        self._is_reset = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start new episodes.

        Args:
            seed: of environment 0, the others follow with seed + 1, ...; or one for each. None: the random
                streams go on.
            options: "reset_mask", (n,) booleans: only these environments.

        Returns:
            Observations of all environments, and an empty dictionary.

        Raises:
            RoboyardError: the seeds or the mask have another length.
        """
        rows = np.arange(self.num_envs)
        if options and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"])
            if mask.shape != (self.num_envs,) or mask.dtype != bool:
                raise RoboyardError(f"reset_mask must be {self.num_envs} booleans, got shape {mask.shape}")
            rows = rows[mask]
        seeds = self._seeds(seed)
        found = self.runner.reset(rows, None if seeds is None else [seeds[row] for row in rows])
        self._ended[rows] = False
        self._is_reset = True
        return self._observation(found), {}

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None] | None:
        if seed is None:
            return None
        if isinstance(seed, int | np.integer):
            return [int(seed) + self._first_seed + row for row in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise RoboyardError(f"give one seed for each of {self.num_envs} environments, got {len(seed)}")
        return list(seed)

    def step(self, actions: np.ndarray) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Advance all environments by one action.

        Args:
            actions: (n, k) within -1 to 1.

        Returns:
            Observations, rewards (n,), terminated (n,), truncated (n,), info.

        Raises:
            RoboyardError: actions have another shape or are not finite, or an episode that ended was not
                started again (autoreset "disabled").
        """
        if not self._is_reset:
            raise RoboyardError("call reset() before the first step()")
        if self._mode == AutoresetMode.DISABLED and self._ended.any():
            rows = np.flatnonzero(self._ended)[:5].tolist()
            raise RoboyardError(f"episodes of environments {rows} have ended; reset them (reset_mask)")
        starting = np.flatnonzero(self._ended) if self._mode == AutoresetMode.NEXT_STEP else np.zeros(0, int)
        result = self.runner.step(actions)
        reward, terminated, truncated = result.reward, result.terminated, result.truncated
        info = dict(result.info)
        found = result.observations
        if len(starting):
            # the action of a step that starts an episode has no effect
            reward[starting], terminated[starting], truncated[starting] = 0.0, False, False
            found = self.runner.reset(starting)
        ended = terminated | truncated
        observation: Any = None
        if ended.any():
            self._add_final(info, result, ended)
            if self._mode == AutoresetMode.SAME_STEP:
                info["final_obs"] = self._observation(result.observations)
                info["_final_obs"] = ended.copy()
                observation = self._observation(self.runner.reset(np.flatnonzero(ended)))
        self._ended = ended
        return (
            observation if observation is not None else self._observation(found),
            reward,
            terminated,
            truncated,
            info,
        )

    def _add_final(self, info: dict[str, Any], result: StepRows, ended: np.ndarray) -> None:
        runner = self.runner
        final = {
            "episode_rewards": {name: total.copy() for name, total in runner.episode_rewards.items()},
            "episode_length": runner.env.steps.copy(),
        }
        if "success" in result.info:
            final["success"] = result.info["success"].copy()
        info["final_info"], info["_final_info"] = final, ended.copy()

    def _observation(self, found: dict[str, np.ndarray]) -> Any:
        from roboyard.envs.observer import joined

        if self._pictures is None:
            return joined(found)
        return {**found, **self._pictures.take()}

    def render(self) -> tuple[np.ndarray, ...]:
        """Return a picture (h, w, 3) of each environment, with render_mode "rgb_array"."""
        if self.render_mode is None:
            raise RoboyardError("give render_mode='rgb_array' to render")
        from roboyard.envs.pictures.task_view import task_picture

        return tuple(task_picture(self.runner, row) for row in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Stop the threads that draw; the simulations go with this object."""
        if self._pictures is not None:
            self._pictures.close()
