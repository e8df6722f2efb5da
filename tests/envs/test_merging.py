"""Datasets written in parts, with looks that differ, joined into one and repeated bit for bit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pq: Any = pytest.importorskip("pyarrow.parquet")
ffmpeg: Any = pytest.importorskip("imageio_ffmpeg")

from roboyard.envs import CameraPose, Color, Gains, JointNoise, Lighting  # noqa: E402
from roboyard.envs.datasets import merge_datasets, record_episodes, replay_episode  # noqa: E402
from roboyard.envs.randomization.stored import from_plain, to_plain  # noqa: E402
from roboyard.errors import ConfigError  # noqa: E402

DIFFERENCES = (JointNoise(position=0.2), Gains(), Color(), Lighting(), CameraPose())
LENGTH = 6


def part(folder: Path, seed: int, episodes: int, text: str = "reach") -> Path:
    def policy(observed: np.ndarray) -> np.ndarray:
        return np.sin(np.arange(7) + 10.0 * observed[:7])

    return record_episodes(
        folder,
        "roboyard/Reach-v0",
        policy,
        episodes=episodes,
        text=text,
        options={"limit": LENGTH, "randomize": DIFFERENCES},
        seed=seed,
        pictures=False,
        cameras=True,
    )


@pytest.fixture(scope="module")
def joined(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A dataset of three episodes in one go, and the same written in two parts."""
    root = tmp_path_factory.mktemp("sets")
    whole = part(root / "whole", 3, 3)
    parts = [part(root / "a", 3, 2), part(root / "b", 5, 1)]
    return whole, merge_datasets(root / "joined", parts)


def rows(folder: Path) -> list[dict[str, Any]]:
    return [row for f in sorted((folder / "data").rglob("*.parquet")) for row in pq.read_table(f).to_pylist()]


def test_parts_have_the_rows_of_the_whole(joined: tuple[Path, Path]) -> None:
    whole, parts = joined
    assert sorted(p.name for p in parts.parent.iterdir()) == ["joined", "whole"]
    assert rows(parts) == rows(whole)
    read = [pq.read_table(f / "meta/episodes/chunk-000/file-000.parquet").to_pylist() for f in joined]
    for key in ("episode_index", "length", "dataset_from_index", "dataset_to_index", "tasks"):
        assert [e[key] for e in read[0]] == [e[key] for e in read[1]]
    assert [e["data/file_index"] for e in read[1]] == [0, 0, 1]
    stats = [json.loads((f / "meta" / "stats.json").read_text()) for f in joined]
    for name in ("action", "observation.state", "next.reward"):
        for key in ("min", "max", "mean", "std", "count"):
            np.testing.assert_allclose(stats[1][name][key], stats[0][name][key], atol=1e-6)
    infos = [json.loads((f / "meta" / "info.json").read_text()) for f in joined]
    assert infos[0] == infos[1]


def test_each_episode_finds_its_film(joined: tuple[Path, Path]) -> None:
    _, folder = joined
    info = json.loads((folder / "meta" / "info.json").read_text())
    for episode in pq.read_table(folder / "meta/episodes/chunk-000/file-000.parquet").to_pylist():
        key = "observation.images.view"
        file = folder / info["video_path"].format(
            video_key=key,
            chunk_index=episode[f"videos/{key}/chunk_index"],
            file_index=episode[f"videos/{key}/file_index"],
        )
        frames, _ = ffmpeg.count_frames_and_secs(str(file))
        last = episode[f"videos/{key}/to_timestamp"] * info["fps"]
        assert round(last - episode[f"videos/{key}/from_timestamp"] * info["fps"]) == LENGTH
        assert round(last) <= frames


def test_episodes_of_every_part_repeat_with_their_differences(joined: tuple[Path, Path]) -> None:
    assert [replay_episode(joined[1], number) for number in range(3)] == [0.0, 0.0, 0.0]


def test_differences_survive_files() -> None:
    stored = json.loads(json.dumps(to_plain({"randomize": DIFFERENCES, "limit": 4})))
    assert from_plain(stored) == {"randomize": DIFFERENCES, "limit": 4}
    with pytest.raises(ConfigError, match="Color"):
        from_plain({"randomize": [{"randomization": "Colr"}]})


def test_parts_must_fit(joined: tuple[Path, Path], tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="exists"):
        merge_datasets(joined[0], [joined[1]])
    with pytest.raises(ConfigError, match="joined already"):
        merge_datasets(tmp_path / "new", [joined[1]])
    with pytest.raises(ConfigError, match=r"info\.json"):
        merge_datasets(tmp_path / "new", [tmp_path])
    assert list(tmp_path.iterdir()) == []
