"""R1's work in the flat (examples/r1_at_home.py) from several start poses, with mug and drawer elsewhere.

    python benchmarks/home.py [--runs 10] [--first 1]

prints what the skills say for each seed, and how many runs were finished.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from roboyard.recording import SceneSetup, set_up
from roboyard.transforms import quaternion_from_rpy

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from r1_at_home import play

MOVED = 0.20
"""Distance by which mug and drawer are moved at most (m)."""


def rearrange(stage: SceneSetup, seed: int) -> None:
    """Move robot, mug and the cabinet with the drawer at random; seed 0 leaves them where they are."""
    if seed == 0:
        return
    random = np.random.default_rng(seed)
    assert stage.robot is not None
    x, y = np.array(stage.scene.rooms["living room"]) + random.uniform(-0.4, 0.4, 2)
    stage.robot.set_pose((x, y, 0.0), quaternion_from_rpy((0, 0, random.uniform(-np.pi, np.pi))))
    cabinet, mug = stage.scene.body("kitchen_east"), stage.scene.body("mug")
    far, angle = MOVED * np.sqrt(random.random()), random.uniform(np.pi / 2, np.pi)
    cabinet.set_pose(cabinet.position + far * np.array([np.cos(angle), np.sin(angle), 0.0]))
    others = [stage.scene.body(name).position[:2] for name in ("banana", "bowl", "plate")]
    while True:  # on the table, not on what else stands there
        far, angle = MOVED * np.sqrt(random.random()), random.uniform(-np.pi, np.pi)
        spot = mug.position + far * np.array([np.cos(angle), np.sin(angle), 0.0])
        if min(np.linalg.norm(spot[:2] - other) for other in others) > 0.16 and -0.8 < spot[1] < -0.1:
            break
    mug.set_pose(spot, quaternion_from_rpy((0, 0, random.uniform(-np.pi, np.pi))))


def main() -> None:
    """Run the script from each start pose."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=10, help="number of seeds")
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    given = parser.parse_args()
    finished = 0
    for seed in range(given.first, given.first + given.runs):
        print(f"seed {seed}")
        stage = set_up({"scene": "home", "robot": "r1"})
        rearrange(stage, seed)
        steps = play(stage, seed=seed)
        print(*steps, sep="\n", flush=True)
        finished += all(steps)
    print(f"{finished} of {given.runs} finished")


if __name__ == "__main__":
    main()
