"""Episodes as a dataset in Minari's layout, which `minari.MinariDataset(FOLDER / "data")` opens.

    data/metadata.json     spaces, specification of the environment, task and options
    data/main_data.hdf5    a group for each episode: observations (one row more), actions, rewards, ...

Pictures are kept as they are, not as JPEG. Parts of observations are named `view.rgb` instead of `view/rgb`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from roboyard._version import __version__
from roboyard.envs.randomization.stored import from_plain, to_plain
from roboyard.errors import ConfigError, MissingExtraError
from roboyard.untrusted.files import check_file
from roboyard.untrusted.json_reading import read_json

try:
    import h5py  # pyright: ignore[reportMissingImports]
    import minari  # pyright: ignore[reportMissingImports]
    from minari.data_collector import EpisodeBuffer  # pyright: ignore[reportMissingImports]
    from minari.dataset.minari_storage import MinariStorage  # pyright: ignore[reportMissingImports]
except ImportError as error:
    raise MissingExtraError("minari", "minari", "datasets for Minari") from error

LARGEST_METADATA = 16 << 20
"""Bytes of `metadata.json`."""
LARGEST_DATA = 64 << 30
"""Bytes of `main_data.hdf5`; only one episode is read at a time."""
LARGEST_EPISODE = 1 << 30
"""Bytes of the numbers of an episode, unpacked."""


def record_minari(
    folder: Path | str,
    task_id: str,
    policy: Callable[[np.ndarray], np.ndarray],
    *,
    episodes: int,
    options: Mapping[str, Any] | None = None,
    seed: int = 0,
    dataset_id: str | None = None,
    description: str = "",
    author: str = "",
) -> Path:
    """Run a policy or a program in a task and write its episodes as a dataset for Minari.

    Args:
        folder: to write; it must not exist.
        task_id: of the environment, such as "roboyard/Reach-v0".
        policy: returns the (a,) action of an observation.
        episodes: number of episodes.
        options: of the environment, as for `gymnasium.make`.
        seed: of the first episode; the others follow with seed + 1, ...
        dataset_id: in Minari; by default the task's name, as in "roboyard/reach-v0".
        description: what the episodes show.
        author: of the dataset.

    Returns:
        The folder.

    Raises:
        ConfigError: the folder exists, or the task or an option is unknown.
    """
    root, given = Path(folder), dict(options or {})
    if root.exists():
        raise ConfigError(f"{root}: exists already; choose another folder or remove it")
    partial = root.with_name(root.name + ".partial")
    if partial.exists():
        raise ConfigError(f"{partial}: a dataset is being written there, or was left; remove it")
    env = gymnasium.make(task_id, **given)
    partial.mkdir(parents=True)
    storage = MinariStorage.new(
        partial / "data",
        observation_space=_space(env.observation_space),
        action_space=env.action_space,
        env_spec=env.spec,
        jpeg_encoding=False,
    )
    storage.update_metadata(
        {
            "dataset_id": dataset_id or task_id.lower(),
            "minari_version": minari.__version__,
            "description": description,
            "algorithm_name": getattr(policy, "__name__", type(policy).__name__),
            "author": {author} if author else set(),
            "requirements": [f"roboyard=={__version__}"],
            "roboyard": {"task": task_id, "options": to_plain(given)},
        }
    )
    for number in range(episodes):
        storage.update_episodes([_episode(env, policy, number, seed + number)])
    env.close()
    partial.rename(root)
    return root


def _episode(
    env: gymnasium.Env[Any, Any], policy: Callable[[Any], np.ndarray], number: int, seed: int
) -> Any:
    """Return an episode as Minari's storage takes it."""
    observed, _ = env.reset(seed=seed)
    seen, actions, rewards, ends, cuts, successes = [observed], [], [], [], [], []
    while not actions or not (ends[-1] or cuts[-1]):
        action = np.clip(policy(observed), -1.0, 1.0).astype(np.float32)
        observed, reward, terminated, truncated, info = env.step(action)
        seen.append(observed)
        actions.append(action)
        rewards.append(float(reward))
        ends.append(bool(terminated))
        cuts.append(bool(truncated))
        successes.append(bool(info.get("success")))
    return EpisodeBuffer(
        id=number,
        seed=seed,
        observations=_stacked(seen),
        actions=actions,
        rewards=rewards,
        terminations=ends,
        truncations=cuts,
        infos={"success": [False, *successes]},
    )


def _key(name: str) -> str:
    """Return the name of a part of observations in the file, where "/" would make a group."""
    return name.replace("/", ".")


def _space(space: gymnasium.Space[Any]) -> gymnasium.Space[Any]:
    """Return a space with the names of the file."""
    if isinstance(space, gymnasium.spaces.Dict):
        return gymnasium.spaces.Dict({_key(name): part for name, part in space.spaces.items()})
    return space


def _stacked(seen: list[Any]) -> Any:
    """Return observations as lists, one for each part of an observation."""
    if isinstance(seen[0], dict):
        return {_key(name): [observed[name] for observed in seen] for name in seen[0]}
    return seen


def replay_minari(folder: Path | str, number: int = 0) -> float:
    """Repeat an episode from its seed and actions; return the largest difference of its observations.

    Args:
        folder: a dataset that `record_minari` wrote.
        number: of the episode.

    Raises:
        ConfigError: the folder is no such dataset, or has no such episode.
    """
    data = Path(folder) / "data"
    try:
        own = read_json(data / "metadata.json", LARGEST_METADATA)["roboyard"]
        file = data / "main_data.hdf5"
        check_file(file, LARGEST_DATA)
        with h5py.File(file, "r") as opened:
            episode: Any = opened[f"episode_{int(number)}"]
            seed = int(episode.attrs["seed"])
            actions = _read(episode["actions"])
            seen = episode["observations"]
            observations = (
                {name: _read(part) for name, part in seen.items()}
                if isinstance(seen, h5py.Group)
                else _read(seen)
            )
        env = _environment(own["task"], from_plain(own["options"]))
    except (OSError, KeyError, IndexError, ValueError, TypeError, AttributeError, RuntimeError) as error:
        raise ConfigError(f"{data}: no episode {number} to replay: {error}") from None
    worst = _difference(env.reset(seed=seed)[0], observations, 0)
    for k, action in enumerate(actions):
        worst = max(worst, _difference(env.step(action)[0], observations, k + 1))
    return worst


def _environment(task: Any, options: Mapping[str, Any]) -> gymnasium.Env[Any, Any]:
    """Return the environment of a dataset: one of ours, which writes and shows nothing.

    Raises:
        ValueError: it is another one, which a file may not start.
    """
    if not isinstance(task, str) or not task.startswith("roboyard/"):
        raise ValueError(f"the task {task!r} is none of Roboyard's")
    kept = {key: value for key, value in options.items() if key not in ("state_folder", "render_mode")}
    return gymnasium.make(task, **kept)


def _read(part: Any) -> np.ndarray:
    """Return the numbers of a data set.

    Raises:
        ValueError: they are too many, or no numbers.
    """
    if not isinstance(part, h5py.Dataset) or part.dtype.kind not in "fiub":
        raise ValueError(f"{part.name} holds no numbers")
    if part.size * part.dtype.itemsize > LARGEST_EPISODE:
        raise ValueError(f"{part.name} has {part.size} numbers; at most {LARGEST_EPISODE >> 20} MB are read")
    return part[()]


def _difference(observed: Any, recorded: Any, row: int) -> float:
    """Return the largest difference of an observation from a recorded one."""
    if isinstance(observed, dict):
        return max(_difference(part, recorded[_key(name)], row) for name, part in observed.items())
    return float(np.abs(np.asarray(observed, dtype=float) - recorded[row]).max())
