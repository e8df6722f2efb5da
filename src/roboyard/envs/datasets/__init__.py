"""Episodes as datasets in LeRobot's v3 layout: parquet tables of numbers and films of each camera.

    meta/info.json, meta/stats.json, meta/tasks.parquet, meta/roboyard.json
    meta/episodes/chunk-000/file-000.parquet      one row for each episode
    data/chunk-000/file-000.parquet               one row for each step
    videos/observation.images.NAME/chunk-000/file-000.mp4

Format: `huggingface/lerobot`, version v3.0 of its datasets. `meta/roboyard.json` is ours: the task, and the
seed of each episode, with which `replay_episode` repeats it bit for bit.
"""

from __future__ import annotations

from roboyard.envs.datasets.episodes import record_episodes, replay_episode
from roboyard.envs.datasets.merging import merge_datasets
from roboyard.envs.datasets.robot_recorder import RobotRecorder
from roboyard.envs.datasets.writer import DatasetWriter

__all__ = ["DatasetWriter", "RobotRecorder", "merge_datasets", "record_episodes", "replay_episode"]
