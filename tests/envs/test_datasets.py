"""Datasets: read back by pyarrow, pandas and ffmpeg, frame by frame and value by value, and replayed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pq: Any = pytest.importorskip("pyarrow.parquet")
ffmpeg: Any = pytest.importorskip("imageio_ffmpeg")

import roboyard.envs as envs  # noqa: E402
from roboyard.envs.datasets import DatasetWriter, record_episodes, replay_episode  # noqa: E402
from roboyard.errors import ConfigError, RoboyardError  # noqa: E402


def straight(observed: np.ndarray) -> np.ndarray:
    return 20.0 * observed[-3:]


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record_episodes(
        tmp_path_factory.mktemp("sets") / "reach",
        "roboyard/Reach-v0",
        straight,
        episodes=2,
        text="reach the point",
        options={"control": "tip", "limit": 12},
        seed=5,
    )


def test_values_are_those_of_the_environment(written: Path) -> None:
    table = pq.read_table(written / "data" / "chunk-000" / "file-000.parquet").to_pydict()
    env = envs.TaskEnv(envs.make_task("roboyard/Reach-v0", control="tip", limit=12))
    at = 0
    for number in range(2):
        observed, _ = env.reset(seed=5 + number)
        for step in range(12):
            assert np.array_equal(np.float32(table["observation.state"][at]), observed)
            action = np.clip(straight(observed), -1, 1).astype(np.float32)
            assert np.array_equal(np.float32(table["action"][at]), action)
            observed, reward, _, truncated, info = env.step(action)
            assert np.float32(table["next.reward"][at]) == np.float32(reward)
            assert table["next.done"][at] == truncated and table["next.success"][at] == info["success"]
            assert (table["episode_index"][at], table["frame_index"][at]) == (number, step)
            assert table["index"][at] == at
            assert table["timestamp"][at] == pytest.approx(step / 30)
            at += 1
    assert len(table["index"]) == at


def test_lerobots_own_reader_gives_the_same_values(written: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With LeRobot's place and time of each frame; its own decoders of films need certain builds of torch."""
    reader: Any = pytest.importorskip("lerobot.datasets.lerobot_dataset", exc_type=ImportError)
    asked: list[tuple[str, float]] = []

    def decode(file: Any, times: list[float], *_: Any) -> Any:
        import torch  # pyright: ignore[reportMissingImports]

        asked.extend((Path(file).name, time) for time in times)
        return torch.zeros(len(times), 3, 4, 4)

    monkeypatch.setattr(reader, "decode_video_frames", decode)
    found = reader.LeRobotDataset("here/reach", root=written)
    table = pq.read_table(written / "data" / "chunk-000" / "file-000.parquet").to_pydict()
    assert (found.num_episodes, len(found), found.fps) == (2, 24, 30)
    for at in range(24):
        row = found[at]
        assert row["task"] == "reach the point"
        for name, values in table.items():
            kind = np.asarray(row[name]).dtype
            assert np.array_equal(np.asarray(row[name]), np.asarray(values[at], dtype=kind)), name
    films = [(name, round(30 * time)) for name, time in asked]
    assert films == [("file-000.mp4", at) for at in range(24)]


def test_films_show_the_environment(written: Path) -> None:
    info = json.loads((written / "meta" / "info.json").read_text())
    file = written / info["video_path"].format(
        video_key="observation.images.view", chunk_index=0, file_index=0
    )
    frames = ffmpeg.read_frames(str(file))
    size = next(frames)["size"]
    pictures = [np.frombuffer(data, dtype=np.uint8).reshape(size[1], size[0], 3) for data in frames]
    assert len(pictures) == info["total_frames"] == 24
    assert list(pictures[0].shape) == info["features"]["observation.images.view"]["shape"]
    env = envs.TaskEnv(envs.make_task("roboyard/Reach-v0", control="tip", limit=12), render_mode="rgb_array")
    env.reset(seed=6)  # the first of the second episode
    difference = np.abs(pictures[12].astype(float) - env.render())
    assert difference.mean() < 4.0  # H.264 loses some


def test_tables_of_episodes_and_tasks(written: Path) -> None:
    episodes = pq.read_table(written / "meta" / "episodes" / "chunk-000" / "file-000.parquet").to_pylist()
    assert [(e["dataset_from_index"], e["dataset_to_index"]) for e in episodes] == [(0, 12), (12, 24)]
    assert episodes[1]["videos/observation.images.view/from_timestamp"] == pytest.approx(12 / 30)
    assert episodes[0]["tasks"] == ["reach the point"]
    stats = json.loads((written / "meta" / "stats.json").read_text())
    table = pq.read_table(written / "data" / "chunk-000" / "file-000.parquet")
    actions = np.array(table["action"].to_pylist())
    np.testing.assert_allclose(stats["action"]["mean"], actions.mean(axis=0), atol=1e-6)
    np.testing.assert_allclose(stats["action"]["std"], actions.std(axis=0), atol=1e-6)
    pandas: Any = pytest.importorskip("pandas")
    tasks = pandas.read_parquet(written / "meta" / "tasks.parquet")
    assert tasks.loc["reach the point"].task_index == 0


def test_episodes_are_replayed_bit_for_bit(written: Path) -> None:
    assert [replay_episode(written, number) for number in range(2)] == [0.0, 0.0]
    with pytest.raises(ConfigError, match="episode 7"):
        replay_episode(written, 7)


def test_nothing_is_overwritten_and_nothing_half_written_is_left(tmp_path: Path, written: Path) -> None:
    with pytest.raises(ConfigError, match="exists"):
        DatasetWriter(written, fps=30)
    with (
        pytest.raises(RoboyardError, match="at least one step"),
        DatasetWriter(tmp_path / "a", fps=30) as writer,
    ):
        writer.add(np.zeros(2), np.zeros(1), 0.0)
        writer.end_episode("one")
        writer.end_episode("two")
    assert list(tmp_path.iterdir()) == []
