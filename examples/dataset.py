"""A dataset of randomised episodes, written by all cores (or a cluster) at once and joined into one.

python examples/dataset.py FOLDER [EPISODES [WORKERS]]

Needs `pip install "roboyard[datasets,cluster]"`. An arm goes to random points, in other colours, light and
camera poses each time; pictures are what its camera sees. The result is in LeRobot's v3 layout.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import ray

from roboyard.envs import CameraPose, Color, JointNoise, Lighting
from roboyard.envs.datasets import merge_datasets, record_episodes, replay_episode

DIFFERENCES = (
    JointNoise(position=0.1),
    Color(low=(0.2, 0.2, 0.2)),
    Lighting(),
    CameraPose(position=0.05, angle=0.05),
)


def straight(observed: np.ndarray) -> np.ndarray:
    """Return the action of the program that is recorded: the tip moves straight to the goal."""
    return 20.0 * observed[-3:]


@ray.remote
def write(folder: str, first: int, count: int) -> str:
    """Write the episodes of seeds from `first` on; return the folder."""
    options = {"control": "tip", "limit": 40, "randomize": DIFFERENCES}
    record_episodes(
        folder, "roboyard/Reach-v0", straight, episodes=count, seed=first, options=options,
        text="reach the point", pictures=False, cameras=True,
    )  # fmt: skip
    return folder


def main(folder: Path, episodes: int = 64, workers: int = 2) -> float:
    """Write the dataset, and return the largest error of its last episode when it is repeated (0)."""
    ray.init(num_cpus=workers, include_dashboard=False, ignore_reinit_error=True, log_to_driver=False)
    bounds = np.linspace(0, episodes, min(workers, episodes) + 1).astype(int)
    parts = [write.remote(str(folder.absolute()) + f".{a}", int(a), int(b - a)) for a, b in pairwise(bounds)]
    merge_datasets(folder, ray.get(parts))
    error = replay_episode(folder, episodes - 1)
    print(f"{episodes} episodes in {folder}; the last one repeats with an error of {error:g}")
    return error


if __name__ == "__main__":
    main(Path(sys.argv[1]), *(int(value) for value in sys.argv[2:4]))
