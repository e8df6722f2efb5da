"""Hours of random actions in every task: no value that is not finite, no memory that grows, no crash.

    python benchmarks/soak.py [--hours 24] [--envs 64] [--tasks roboyard/Reach-v0 ...] [--log FILE] [--part 3]

The hours are simulated time, of all environments together. Each action is drawn again or held for up
to a second, and is at times the largest. The hours come in parts, with seeds 0, 1 and so on; all parts of a
task run in one process, one after the other. With a log, parts are added to it as they end, those that it
has are not run again, and the table is of all of them. Prints a row for each task; exits with 1 where one
fails.
"""

from __future__ import annotations

import argparse
import gc
import json
import math
import os
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.envs import make_task, make_vec, task_ids

WARM_UP = 0.1
"""Share of a run after which memory counts."""
MOST_GROWTH = 8.0
"""Growth of resident memory that is no leak (MB): pages that the allocator keeps."""


@dataclass(frozen=True, kw_only=True)
class Soaked:
    """The result of a run."""

    hours: float
    """Simulated (h)."""
    episodes: int
    diverged: int
    """Episodes that ended because the simulation diverged."""
    grown: float
    """Resident memory after the run, less that after its first tenth (MB)."""
    cpu: float
    """CPU time (s)."""
    largest: float
    """Largest observed number."""


def soak(task: str, hours: float, count: int = 64, *, seed: int = 0, **options: Any) -> Soaked:
    """Run a task with random actions.

    Args:
        task: id.
        hours: of simulated time, of all environments together.
        count: number of environments.
        seed: of the episodes and the actions.
        options: of `make_vec` and the task.

    Raises:
        AssertionError: an observation or a reward is not finite, or outside the observation space.
    """
    envs = make_vec(task, count, **options)
    dt = 1.0 / make_task(task).control_freq
    steps = max(20, round(hours * 3600.0 / (dt * count)))
    random = np.random.default_rng(seed)
    observed, _ = envs.reset(seed=seed)
    size = envs.single_action_space.shape[0]
    actions = np.zeros((count, size))
    held = np.zeros(count, dtype=int)
    episodes = diverged = 0
    start, largest = 0.0, 0.0
    before = time.process_time()
    for step in range(steps):
        if step == int(steps * WARM_UP):
            gc.collect()
            start = resident_mb()
        new = held <= 0
        drawn = random.uniform(-1.5, 1.5, (int(new.sum()), size)).clip(-1.0, 1.0)
        actions[new] = drawn
        held[new] = random.integers(1, round(1.0 / dt) + 1, int(new.sum())) * (
            random.random(int(new.sum())) < 0.5
        )
        held -= 1
        observed, reward, terminated, truncated, info = envs.step(actions)
        assert np.isfinite(observed).all(), f"{task}: an observation is not finite in step {step}"
        assert np.isfinite(reward).all(), f"{task}: a reward is not finite in step {step}"
        largest = max(largest, float(np.abs(observed).max()))
        episodes += int((terminated | truncated).sum())
        diverged += int(info["diverged"].sum())
    gc.collect()
    grown = resident_mb() - start
    envs.close()
    return Soaked(
        hours=steps * count * dt / 3600.0,
        episodes=episodes,
        diverged=diverged,
        grown=grown,
        cpu=time.process_time() - before,
        largest=largest,
    )


def resident_mb() -> float:
    """Resident memory of this process in MB (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def combined(parts: list[Soaked]) -> Soaked:
    """Return the parts of a task as one result; growth is the largest of a part."""
    return Soaked(
        hours=sum(part.hours for part in parts),
        episodes=sum(part.episodes for part in parts),
        diverged=sum(part.diverged for part in parts),
        grown=max(part.grown for part in parts),
        cpu=sum(part.cpu for part in parts),
        largest=max(part.largest for part in parts),
    )


def logged(log: Path | None) -> dict[tuple[str, int], Soaked]:
    """Return the parts in a log by task and seed."""
    if log is None or not log.is_file():
        return {}
    rows = [json.loads(line) for line in log.read_text().splitlines()]
    return {(row["task"], row["seed"]): Soaked(**row["found"]) for row in rows}


def main() -> int:
    """Run all tasks and print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--part", type=float, default=3.0, help="hours of a part")
    parser.add_argument("--envs", type=int, default=64)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--log", type=Path, help="parts that are done, a line of JSON each")
    parser.add_argument("--tasks", nargs="*", default=[])
    given = parser.parse_args()
    done = logged(given.log)
    print(f"{'':<26}{'hours':>7}{'episodes':>10}{'diverged':>10}{'MB more':>9}{'largest':>9}{'CPU s':>8}")
    failed = False
    for task in given.tasks or task_ids():
        parts: list[Soaked] = []
        try:
            for seed in range(max(1, math.ceil(given.hours / given.part - 1e-9))):
                if (task, seed) not in done:
                    hours = min(given.part, given.hours - seed * given.part)
                    found = soak(task, hours, given.envs, seed=seed, threads=given.threads)
                    done[task, seed] = found
                    if given.log is not None:
                        with given.log.open("a", encoding="utf-8") as file:
                            print(json.dumps({"task": task, "seed": seed, "found": asdict(found)}), file=file)
                parts.append(done[task, seed])
        except AssertionError as error:
            print(error, flush=True)
            failed = True
            continue
        total = combined(parts)
        failed |= total.grown > MOST_GROWTH
        print(
            f"{task:<26}{total.hours:>7.1f}{total.episodes:>10}{total.diverged:>10}{total.grown:>9.1f}"
            f"{total.largest:>9.2g}{total.cpu:>8.0f}",
            flush=True,
        )
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
