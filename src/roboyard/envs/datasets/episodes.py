"""Episodes of a policy or program in a task, recorded and repeated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.envs.datasets.tables import FILE, read_meta, read_table
from roboyard.envs.datasets.writer import DatasetWriter
from roboyard.envs.gym_env import TaskEnv
from roboyard.envs.randomization.stored import from_plain, to_plain
from roboyard.envs.registration import make_task
from roboyard.errors import ConfigError

PLACE = ("data/chunk_index", "data/file_index")
"""Columns that name the file of an episode."""


def record_episodes(
    folder: Path | str,
    task_id: str,
    policy: Callable[[np.ndarray], np.ndarray],
    *,
    episodes: int,
    text: str,
    options: Mapping[str, Any] | None = None,
    seed: int = 0,
    pictures: bool = True,
    cameras: bool = False,
) -> Path:
    """Run a policy or a program in a task and write its episodes as a dataset.

    Args:
        folder: to write; it must not exist.
        task_id: of the environment, such as "roboyard/Reach-v0".
        policy: returns the (a,) action of a (k,) observation.
        episodes: number of episodes.
        text: what they show, in words.
        options: of the task.
        seed: of the first episode; the others follow with seed + 1, ...
        pictures: also record the task's view as a film.
        cameras: also record what each camera of the robot sees.

    Returns:
        The folder.

    Raises:
        ConfigError: the folder exists, or the task or an option is unknown.
    """
    task = make_task(task_id, **dict(options or {}))
    modalities = list(task.modalities)
    env = TaskEnv(
        task,
        obs_modalities=[*modalities, "rgb"] if cameras else modalities,
        render_mode="rgb_array" if pictures else None,
    )
    source = {"task": task_id, "options": to_plain(options or {})}
    with DatasetWriter(
        folder, fps=round(env.runner.task.control_freq), robot=env.robot.model, source=source
    ) as writer:
        for number in range(episodes):
            observed, _ = env.reset(seed=seed + number)
            over = False
            while not over:
                state, seen = _parts(observed, modalities)
                if pictures:
                    seen["view"] = env.render()
                action = np.clip(policy(state), -1.0, 1.0).astype(np.float32)
                observed, reward, terminated, truncated, info = env.step(action)
                over = terminated or truncated
                done = bool(info.get("success"))
                writer.add(state, action, reward, done=over, success=done, pictures=seen)
            writer.end_episode(text, seed=seed + number)
    return Path(folder)


def _parts(observed: Any, modalities: Sequence[str]) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the vector of an observation, and camera to its picture."""
    if not isinstance(observed, dict):
        return observed, {}
    vector = np.concatenate([observed[name] for name in modalities])
    return vector, {
        name.rsplit("/", 1)[0].replace("/", "_"): picture
        for name, picture in observed.items()
        if name not in modalities
    }


def replay_episode(folder: Path | str, number: int = 0) -> float:
    """Repeat an episode from its seed and actions; return the largest difference of its observations.

    Args:
        folder: a dataset that `record_episodes` wrote.
        number: of the episode.

    Raises:
        ConfigError: the folder is no such dataset, or has no such episode.
    """
    root = Path(folder)
    try:
        own = read_meta(root, "roboyard.json")
        seed, task, options = own["seeds"][number], own["task"], own["options"]
        found = read_table(root / "meta" / "episodes" / f"{FILE}.parquet", PLACE)
        place = found.slice(number, 1).to_pylist()[0]
        chunk, file = (int(place[name]) for name in PLACE)
        table = read_table(
            root / "data" / f"chunk-{chunk:03d}" / f"file-{file:03d}.parquet",
            ["observation.state", "action"],
            only=True,
            filters=[("episode_index", "=", number)],
        )
    except (OSError, KeyError, IndexError, ValueError, TypeError) as error:
        raise ConfigError(f"{root.name}: no episode {number} to replay: {error}") from None
    states = np.array(table["observation.state"].to_pylist(), dtype=np.float32)
    actions = np.array(table["action"].to_pylist(), dtype=np.float32)
    env = TaskEnv(make_task(task, **from_plain(options)))
    observed, _ = env.reset(seed=seed)
    worst = 0.0
    for state, action in zip(states, actions, strict=True):
        worst = max(worst, float(np.abs(observed - state).max()))
        observed = env.step(action)[0]
    return worst
