"""`roboyard plan`: collision-free, jerk-limited motions of a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

EXAMPLES = """
Examples:

\b
  roboyard plan --problems arm.json --out rows.jsonl   plan every problem of a file
"""


def plan(
    problems: Annotated[
        Path | None,
        typer.Option(help="Problems to plan (.json); docs/planning.md has the format.", show_default=False),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Results, one JSON object a line (.jsonl).", show_default=False),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the random samples.")] = 0,
) -> None:
    """Plan collision-free motions within velocity, acceleration and jerk limits.

    A file of problems holds a URDF, obstacles, starts and goals; each result has the outcome, the reason of a
    failure, the path and the timed trajectory.
    """
    from roboyard.errors import ConfigError

    if problems is None:
        raise ConfigError("--problems is missing; give a file of problems (roboyard plan --help)")
    if out is None:
        raise ConfigError(f"--out is missing; give a file for the results, such as {problems.stem}.jsonl")
    _plan_file(problems, out, seed)


def _plan_file(problems: Path, out: Path, seed: int) -> None:
    import json
    from collections import Counter

    import numpy as np

    from roboyard.planning.problem_files import load_problems, row_of, solve_problems

    loaded = load_problems(problems)
    outcomes: Counter[str] = Counter()
    times: list[float] = []
    with out.open("w", encoding="utf-8") as file:
        fitting = lambda link: print(f"fitting spheres to {link}", flush=True)  # noqa: E731
        for problem, made in solve_problems(loaded, seed=seed, progress=fitting):
            file.write(json.dumps(row_of(problem.name, made)) + "\n")
            outcomes[made.outcome] += 1
            times.append(1e3 * (made.planning_seconds + made.timing_seconds))
            if not made.solved:
                print(f"{problem.name}: {made.outcome}: {made.reason}")
    counts = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.most_common()) or "no problems"
    median = f"; median {np.median(times):.1f} ms" if times else ""
    print(f"{counts}{median}\nwrote {out}")
