"""Writes steps one by one as episodes of a dataset."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from roboyard.envs.datasets.statistics import Statistics
from roboyard.envs.datasets.tables import FILE, INDEX, column, pa, pq, task_table, write_json
from roboyard.errors import ConfigError, RoboyardError
from roboyard.recording import VideoWriter


class DatasetWriter:
    """Writes episodes to a folder, which appears when the writer is closed; a context manager."""

    def __init__(
        self,
        folder: Path | str,
        *,
        fps: float,
        robot: str = "",
        source: Mapping[str, Any] | None = None,
        names: Mapping[str, Sequence[str]] | None = None,
    ) -> None:
        """Begin a dataset.

        Args:
            folder: to write; it must not exist.
            fps: steps a second; a whole number.
            robot: kind of robot, for `info.json`.
            source: "task" and "options" of the environment, for `replay_episode`.
            names: "observation.state" and "action" to the names of their numbers, where they have any.

        Raises:
            ConfigError: the folder exists, or fps is no whole number above 0.
        """
        self.folder = Path(folder)
        if self.folder.exists():
            raise ConfigError(f"{self.folder}: exists already; choose another folder or remove it")
        if round(fps) < 1 or abs(fps - round(fps)) > 1e-6:
            raise ConfigError(f"fps must be a whole number above 0, got {fps:g}")
        self._fps, self._robot, self._source = round(fps), robot, dict(source or {})
        self._names = {key: list(value) for key, value in (names or {}).items()}
        self._partial = self.folder.with_name(self.folder.name + ".partial")
        if self._partial.exists():
            raise ConfigError(f"{self._partial}: a dataset is being written there, or was left; remove it")
        (self._partial / "data" / "chunk-000").mkdir(parents=True)
        self._rows: list[dict[str, Any]] = []
        self._pictures: dict[str, list[np.ndarray]] = {}
        self._films: dict[str, VideoWriter] = {}
        self._sizes: dict[str, tuple[int, ...]] = {}
        self._table: Any = None
        self._tasks: dict[str, int] = {}
        self._episodes: list[dict[str, Any]] = []
        self._seeds: list[int | None] = []
        self._sums: dict[str, Statistics] = {}
        self._frames = 0

    def add(
        self,
        state: np.ndarray,
        action: np.ndarray,
        reward: float,
        *,
        done: bool = False,
        success: bool = False,
        pictures: Mapping[str, np.ndarray] | None = None,
    ) -> None:
        """Add a step: what was seen before an action, the action, and what followed.

        Args:
            state: (k,) observation.
            action: (a,) within -1 to 1.
            reward: of the step.
            done: whether the episode ended with the step.
            success: whether the goal was reached after it.
            pictures: camera to its (h, w, 3) picture (0 to 255).
        """
        self._rows.append(
            {
                "observation.state": np.asarray(state, dtype=np.float32),
                "action": np.asarray(action, dtype=np.float32),
                "next.reward": np.float32(reward),
                "next.done": bool(done),
                "next.success": bool(success),
            }
        )
        for name, picture in (pictures or {}).items():
            self._pictures.setdefault(name, []).append(picture)

    def finish_last(self, *, success: bool) -> None:
        """Note that the episode ended with the last step that was added."""
        if self._rows:
            self._rows[-1] |= {"next.done": True, "next.success": success}

    def end_episode(self, task: str, *, seed: int | None = None) -> None:
        """Write the steps that were added as one episode.

        Args:
            task: what the episode shows, in words.
            seed: of the environment's reset.

        Raises:
            RoboyardError: no step was added, or steps differ in size, or a camera misses a picture.
        """
        count, number = len(self._rows), len(self._episodes)
        if not count:
            raise RoboyardError("an episode needs at least one step")
        for name, pictures in self._pictures.items():
            if len(pictures) != count:
                raise RoboyardError(f"camera {name!r} has {len(pictures)} pictures for {count} steps")
        if number and set(self._pictures) != set(self._films):
            raise RoboyardError(f"cameras {sorted(self._pictures)} differ from {sorted(self._films)} before")
        task_index = self._tasks.setdefault(task, len(self._tasks))
        columns: dict[str, Any] = {}
        for name in self._rows[0]:
            values = np.stack([row[name] for row in self._rows])
            size = values.shape[1:] or (1,)
            if self._sizes.setdefault(name, size) != size:
                raise RoboyardError(f"{name} has {size} numbers, {self._sizes[name]} before")
            columns[name] = values
            self._sums.setdefault(name, Statistics(size[0])).add(values.reshape(count, -1))
        index = np.arange(count, dtype=np.int64)
        columns |= {
            "timestamp": (index / self._fps).astype(np.float32),
            "frame_index": index,
            "episode_index": np.full(count, number, dtype=np.int64),
            "index": index + self._frames,
            "task_index": np.full(count, task_index, dtype=np.int64),
        }
        self._write_rows(columns)
        episode: dict[str, Any] = {
            "episode_index": number,
            "tasks": [task],
            "length": count,
            "data/chunk_index": 0,
            "data/file_index": 0,
            "dataset_from_index": self._frames,
            "dataset_to_index": self._frames + count,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
        }
        for name, pictures in self._pictures.items():
            key = f"videos/observation.images.{name}"
            episode |= {
                f"{key}/chunk_index": 0,
                f"{key}/file_index": 0,
                f"{key}/from_timestamp": self._frames / self._fps,
                f"{key}/to_timestamp": (self._frames + count) / self._fps,
            }
            self._write_pictures(name, pictures)
        self._episodes.append(episode)
        self._seeds.append(seed)
        self._frames += count
        self._rows, self._pictures = [], {}

    def _write_rows(self, columns: Mapping[str, Any]) -> None:
        table = pa.table({name: column(values) for name, values in columns.items()})
        if self._table is None:
            self._table = pq.ParquetWriter(self._partial / "data" / f"{FILE}.parquet", table.schema)
        self._table.write_table(table)

    def _write_pictures(self, name: str, pictures: Sequence[np.ndarray]) -> None:
        key = f"observation.images.{name}"
        if name not in self._films:
            file = self._partial / "videos" / key / f"{FILE}.mp4"
            file.parent.mkdir(parents=True)
            self._films[name] = VideoWriter(file, fps=self._fps)
            self._sizes[key] = pictures[0].shape
        for picture in pictures:
            self._films[name].add(picture)
        shares = np.stack([p[::4, ::4, :3].reshape(-1, 3) for p in pictures[:: max(1, len(pictures) // 10)]])
        self._sums.setdefault(key, Statistics(3)).add(shares.reshape(-1, 3) / 255.0)

    def close(self) -> None:
        """Write the tables of `meta/` and put the folder in its place."""
        if self._table is None:
            shutil.rmtree(self._partial, ignore_errors=True)
            return
        self._table.close()
        for film in self._films.values():
            film.close()
        meta = self._partial / "meta"
        (meta / "episodes" / "chunk-000").mkdir(parents=True)
        pq.write_table(pa.Table.from_pylist(self._episodes), meta / "episodes" / f"{FILE}.parquet")
        pq.write_table(task_table(self._tasks), meta / "tasks.parquet")
        write_json(meta / "info.json", self._info())
        write_json(meta / "stats.json", {name: s.result(name) for name, s in self._sums.items()})
        write_json(meta / "roboyard.json", {**self._source, "seeds": self._seeds})
        self._partial.rename(self.folder)

    def _info(self) -> dict[str, Any]:
        kinds = {"next.done": "bool", "next.success": "bool", "timestamp": "float32"}
        features: dict[str, Any] = {}
        for name, size in self._sizes.items():
            if name.startswith("observation.images."):
                height, width = size[:2]
                features[name] = {
                    "dtype": "video",
                    "shape": [height, width, 3],
                    "names": ["height", "width", "channels"],
                    "info": {
                        "video.height": height,
                        "video.width": width,
                        "video.channels": 3,
                        "video.fps": self._fps,
                        "video.codec": "h264",
                        "video.pix_fmt": "yuv420p",
                        "video.is_depth_map": False,
                        "has_audio": False,
                    },
                }
            else:
                features[name] = {"dtype": kinds.get(name, "float32"), "shape": list(size)}
                features[name]["names"] = self._names.get(name)
        for name in INDEX:
            features[name] = {"dtype": kinds.get(name, "int64"), "shape": [1], "names": None}
        return {
            "codebase_version": "v3.0",
            "robot_type": self._robot,
            "total_episodes": len(self._episodes),
            "total_frames": self._frames,
            "total_tasks": len(self._tasks),
            "chunks_size": 1000,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": self._fps,
            "splits": {"train": f"0:{len(self._episodes)}"},
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
            "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
            if self._films
            else None,
            "features": features,
        }

    def __enter__(self) -> DatasetWriter:
        """Return the writer."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish the dataset; after an error nothing is left of it."""
        if kind is None:
            self.close()
            return
        if self._table is not None:
            self._table.close()
        for film in self._films.values():
            film.close()
        shutil.rmtree(self._partial, ignore_errors=True)
