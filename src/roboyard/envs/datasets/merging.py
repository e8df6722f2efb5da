"""Joins datasets that were written in parallel into one: tables with new indices, films as they are."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from roboyard.envs.datasets.statistics import merged_statistics
from roboyard.envs.datasets.tables import FILE, pa, pq, read_meta, read_table, task_table, write_json
from roboyard.errors import ConfigError

CHUNK = 1000
"""Files in a folder."""
EPISODE = ("episode_index", "tasks", "dataset_from_index", "dataset_to_index")
"""Columns that an episode must have."""


def merge_datasets(folder: Path | str, parts: Sequence[Path | str]) -> Path:
    """Join datasets of the same robot and cameras into one, and remove the parts.

    Episodes keep their order, part after part. Films are moved, not encoded again.

    Args:
        folder: to write; it must not exist.
        parts: folders of datasets, with one file of data each.

    Returns:
        The folder.

    Raises:
        ConfigError: the folder exists, a part is no dataset, has several files, or differs in its features.
    """
    root, sources = Path(folder), [Path(part) for part in parts]
    if root.exists():
        raise ConfigError(f"{root}: exists already; choose another folder or remove it")
    if not sources:
        raise ConfigError("merge_datasets: give at least one part")
    infos = [read_meta(source, "info.json") for source in sources]
    for source, info in zip(sources, infos, strict=True):
        for key in ("features", "fps", "robot_type"):
            if info[key] != infos[0][key]:
                raise ConfigError(f"{source}: its {key} differ from those of {sources[0]}")
        if (source / "data" / "chunk-000" / "file-001.parquet").exists():
            raise ConfigError(f"{source}: it has several files of data, and is joined already")
    partial = root.with_name(root.name + ".partial")
    if partial.exists():
        raise ConfigError(f"{partial}: a dataset is being written there, or was left; remove it")
    tasks: dict[str, int] = {}
    episodes: list[dict[str, Any]] = []
    seeds: list[int | None] = []
    frames = 0
    (partial / "meta" / "episodes" / "chunk-000").mkdir(parents=True)
    for number, source in enumerate(sources):
        rows = read_table(source / "meta" / "episodes" / f"{FILE}.parquet", EPISODE).to_pylist()
        moved = {"chunk_index": number // CHUNK, "file_index": number % CHUNK}
        for row in rows:
            for text in row["tasks"]:
                tasks.setdefault(text, len(tasks))
            for key in [key for key in row if key.startswith(("data/", "videos/"))]:
                row[key] = moved.get(key.rsplit("/", 1)[1], row[key])
            row["dataset_from_index"] += frames
            row["dataset_to_index"] += frames
        _write_data(source, partial / "data" / _file(number, "parquet"), rows, len(episodes), frames, tasks)
        for video in sorted((source / "videos").glob(f"*/{FILE}.mp4")):
            target = partial / "videos" / video.parts[-3] / _file(number, "mp4")
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(video, target)
        for row in rows:
            row["episode_index"] += len(episodes)
        episodes += rows
        seeds += read_meta(source, "roboyard.json")["seeds"]
        frames += infos[number]["total_frames"]
    counted = {
        "total_episodes": len(episodes),
        "total_frames": frames,
        "total_tasks": len(tasks),
        "splits": {"train": f"0:{len(episodes)}"},
    }
    meta = partial / "meta"
    pq.write_table(pa.Table.from_pylist(episodes), meta / "episodes" / f"{FILE}.parquet")
    pq.write_table(task_table(tasks), meta / "tasks.parquet")
    write_json(meta / "info.json", {**infos[0], **counted})
    stats = [read_meta(source, "stats.json") for source in sources]
    write_json(meta / "stats.json", {name: merged_statistics([s[name] for s in stats]) for name in stats[0]})
    write_json(meta / "roboyard.json", {**read_meta(sources[0], "roboyard.json"), "seeds": seeds})
    partial.rename(root)
    for source in sources:
        shutil.rmtree(source)
    return root


def _file(number: int, ending: str) -> Path:
    return Path(f"chunk-{number // CHUNK:03d}") / f"file-{number % CHUNK:03d}.{ending}"


def _write_data(
    source: Path, target: Path, rows: Sequence[Any], episode: int, frame: int, tasks: dict[str, int]
) -> None:
    """Write the steps of a part with indices that count on."""
    table = read_table(source / "data" / f"{FILE}.parquet", ("episode_index", "index", "task_index"))
    own = table["episode_index"].to_numpy()
    task_of = [tasks[row["tasks"][0]] for row in rows]
    changed = {
        "episode_index": own + episode,
        "index": table["index"].to_numpy() + frame,
        "task_index": [task_of[k] for k in own],
    }
    for name, values in changed.items():
        place = table.schema.get_field_index(name)
        table = table.set_column(place, name, pa.array(values, pa.int64()))
    target.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, target)
