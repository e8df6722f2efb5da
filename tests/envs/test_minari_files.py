"""Datasets in Minari's layout: read back by Minari and by h5py, and repeated bit for bit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

h5py = pytest.importorskip("h5py")
minari = pytest.importorskip("minari")

from roboyard.envs.datasets.minari_files import record_minari, replay_minari  # noqa: E402
from roboyard.envs.gym_env import TaskEnv  # noqa: E402
from roboyard.envs.registration import make_task  # noqa: E402
from roboyard.errors import ConfigError  # noqa: E402

OPTIONS = {"robot": "arm7", "limit": 12}


def _policy(observed: np.ndarray) -> np.ndarray:
    return np.cos(7 * observed[:7]).astype(np.float32)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("minari") / "reach"
    return record_minari(folder, "roboyard/Reach-v0", _policy, episodes=3, options=OPTIONS, seed=4)


def test_minari_reads_what_the_environment_gave(dataset: Path) -> None:
    read = minari.MinariDataset(dataset / "data")
    assert read.id == "roboyard/reach-v0" and read.total_episodes == 3 and read.total_steps == 36
    env = TaskEnv(make_task("roboyard/Reach-v0", **OPTIONS))
    assert read.observation_space == env.observation_space and read.action_space == env.action_space
    for number, episode in enumerate(read.iterate_episodes()):
        observed, _ = env.reset(seed=4 + number)
        np.testing.assert_array_equal(episode.observations[0], observed)
        for k, action in enumerate(episode.actions):
            np.testing.assert_array_equal(action, np.clip(_policy(observed), -1, 1))
            observed, reward, terminated, truncated, info = env.step(action)
            np.testing.assert_array_equal(episode.observations[k + 1], observed)
            assert episode.rewards[k] == float(reward)
            assert (episode.terminations[k], episode.truncations[k]) == (terminated, truncated)
            assert episode.infos["success"][k + 1] == bool(info.get("success"))


def test_minari_makes_the_environment_again(dataset: Path) -> None:
    read = minari.MinariDataset(dataset / "data")
    env = read.recover_environment()
    observed, _ = env.reset(seed=4)
    np.testing.assert_array_equal(observed, next(iter(read.iterate_episodes())).observations[0])


def test_the_file_has_minaris_layout(dataset: Path) -> None:
    with h5py.File(dataset / "data" / "main_data.hdf5") as file:
        assert sorted(file) == ["episode_0", "episode_1", "episode_2"]
        episode: Any = file["episode_2"]
        assert dict(episode.attrs) == {"id": 2, "seed": 6, "total_steps": 12}
        assert episode["observations"].shape[0] == 13 and episode["actions"].shape == (12, 7)


def test_episodes_repeat_bit_for_bit(dataset: Path) -> None:
    assert [replay_minari(dataset, number) for number in range(3)] == [0.0, 0.0, 0.0]


def test_pictures_are_kept_as_they_are(tmp_path: Path) -> None:
    options = {"robot": "arm7", "limit": 3, "obs_modalities": ["state", "rgb"]}
    folder = record_minari(
        tmp_path / "seen", "roboyard/Reach-v0", lambda _: np.zeros(7), episodes=1, options=options
    )
    (episode,) = minari.MinariDataset(folder / "data").iterate_episodes()
    pictures = [value for name, value in episode.observations.items() if name.endswith(".rgb")]
    assert pictures and all(p.dtype == np.uint8 and len(p) == 4 and p.std() > 0 for p in pictures)
    assert replay_minari(folder) == 0.0


def test_what_cannot_be_replayed_is_named(dataset: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no episode 7"):
        replay_minari(dataset, 7)
    with pytest.raises(ConfigError, match="exists already"):
        record_minari(dataset, "roboyard/Reach-v0", _policy, episodes=1)
    metadata = json.loads((dataset / "data" / "metadata.json").read_text())
    metadata["roboyard"]["task"] = "os:system"
    data = tmp_path / "data"
    data.mkdir()
    (data / "metadata.json").write_text(json.dumps(metadata))
    (data / "main_data.hdf5").write_bytes((dataset / "data" / "main_data.hdf5").read_bytes())
    with pytest.raises(ConfigError, match="none of Roboyard's"):
        replay_minari(tmp_path)
    (data / "main_data.hdf5").write_bytes((dataset / "data" / "main_data.hdf5").read_bytes()[:2000])
    with pytest.raises(ConfigError, match="no episode 0 to replay"):
        replay_minari(tmp_path)
