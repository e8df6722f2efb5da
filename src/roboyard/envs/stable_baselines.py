"""Many environments for Stable-Baselines3, whose `VecEnv` is not Gymnasium's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from roboyard.envs.policy import Policy
from roboyard.envs.vector_env import BatchEnv
from roboyard.errors import MissingExtraError

try:
    from stable_baselines3.common.vec_env import VecEnv  # pyright: ignore[reportMissingImports]
except ModuleNotFoundError as error:
    raise MissingExtraError("stable-baselines3", "learn", "training with Stable-Baselines3") from error


class StableBaselinesEnv(VecEnv):
    """A `BatchEnv` as a `VecEnv`; its episodes are reported as `Monitor` does."""

    def __init__(self, envs: BatchEnv) -> None:
        """Wrap environments that start new episodes in the same step (the default of `BatchEnv`)."""
        self.envs = envs
        """The environments."""
        self.num_envs = envs.num_envs
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)
        self._actions = np.zeros((envs.num_envs, *envs.single_action_space.shape))  # type: ignore[misc]
        self._returns = np.zeros(envs.num_envs)
        self._next_seed: int | None = None

    def reset(self) -> Any:
        """Start new episodes and return the observations."""
        self._returns[:] = 0.0
        seed, self._next_seed = self._next_seed, None
        return self.envs.reset(seed=seed)[0]

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions (n, k) of the next step."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Advance and return observations, rewards (n,), ends of episodes (n,) and information."""
        observed, reward, terminated, truncated, info = self.envs.step(self._actions)
        self._returns += reward
        ended = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for row in np.flatnonzero(ended).tolist():
            length = int(info["final_info"]["episode_length"][row])
            infos[row] = {
                "terminal_observation": _row(info["final_obs"], row),
                "TimeLimit.truncated": bool(truncated[row]),
                "episode": {"r": float(self._returns[row]), "l": length, "t": 0.0},
            }
            if "success" in info:
                infos[row]["is_success"] = bool(info["success"][row])
        self._returns[ended] = 0.0
        return observed, reward.astype(np.float32), ended, infos

    def close(self) -> None:
        """Close the environments."""
        self.envs.close()

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the next reset: environment i gets seed + i."""
        self._next_seed = seed
        return [None if seed is None else seed + row for row in range(self.num_envs)]

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of the environments, the same for each."""
        return [getattr(self.envs, attr_name, None)] * len(self._rows(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of the environments, common to all."""
        setattr(self.envs, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Call a method of the environments once and return its result for each."""
        return [getattr(self.envs, method_name)(*args, **kwargs)] * len(self._rows(indices))

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Any = None) -> list[bool]:
        """Return that no environment has a wrapper."""
        return [False] * len(self._rows(indices))

    def _rows(self, indices: Any) -> Sequence[int]:
        if indices is None:
            return range(self.num_envs)
        return [indices] if isinstance(indices, int) else list(indices)


def _row(values: Any, row: int) -> Any:
    return {k: v[row] for k, v in values.items()} if isinstance(values, dict) else values[row]


def policy_of(model: Any, task: str, options: Mapping[str, Any] | None = None) -> Policy:
    """Return the actor of a Stable-Baselines3 model as a policy that needs neither torch nor the library.

    Args:
        model: PPO or A2C with an "MlpPolicy" without shared layers of its own features.
        task: id of the task it was trained for.
        options: of the task.
    """
    import torch  # pyright: ignore[reportMissingImports]

    network = [*model.policy.mlp_extractor.policy_net, model.policy.action_net]
    linear = [part for part in network if isinstance(part, torch.nn.Linear)]
    others = {type(part).__name__.lower() for part in network if not isinstance(part, torch.nn.Linear)}
    return Policy(
        task=task,
        options=options or {},
        activation=next(iter(others), "tanh"),
        layers=tuple(
            (part.weight.detach().double().numpy(), part.bias.detach().double().numpy()) for part in linear
        ),
    )
