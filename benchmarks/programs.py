"""Whole PyBullet programs, unmodified, on Roboyard and on an installed PyBullet, in alternating processes.

    python benchmarks/programs.py [--rounds 5] [--only arm,pile]

Each program of benchmarks/programs/ runs as `python PROGRAM` with PyBullet and as `roboyard run PROGRAM`,
start-up included. A figure is CPU time (user and system, s), the median over the rounds; the ratio is the
median of the rounds' own ratios. Both sides read the files of the installed pybullet_data. --show prints what
the programs print. Without pybullet only Roboyard's column is printed.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import resource
import statistics
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).parent / "programs"
CODE = {
    "PyBullet": (),
    "Roboyard": ("-m", "roboyard", "run"),
}


def main() -> None:
    """Run all programs on both sides and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    names = sorted(file.stem for file in FOLDER.glob("*.py"))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", default="", help=f"programs, by name: {', '.join(names)}")
    parser.add_argument("--show", action="store_true", help="print what each program prints")
    arguments = parser.parse_args()
    chosen = [name for name in arguments.only.split(",") if name] or names
    if unknown := sorted(set(chosen) - set(names)):
        parser.error(f"no program {unknown[0]!r}; there are {', '.join(names)}")
    sides = [side for side in CODE if side != "PyBullet" or importlib.util.find_spec("pybullet")]
    print("| program | PyBullet (s) | Roboyard (s) | ratio | what it does |")
    print("|---|---|---|---|---|")
    ratios = []
    for name in chosen:
        file = FOLDER / f"{name}.py"
        run("Roboyard", file, show=arguments.show)  # fills the caches
        figures: dict[str, list[float]] = {side: [] for side in sides}
        for k in range(arguments.rounds):
            for side in sides:
                figures[side].append(run(side, file, show=arguments.show and k == 0))
        ours = statistics.median(figures["Roboyard"])
        what = file.read_text(encoding="utf-8").split('"""')[1]
        if "PyBullet" not in figures:
            print(f"| {name} | | {ours:.2f} | | {what} |", flush=True)
            continue
        pairs = zip(figures["Roboyard"], figures["PyBullet"], strict=True)
        ratios.append(statistics.median(a / b for a, b in pairs))
        theirs = statistics.median(figures["PyBullet"])
        print(f"| {name} | {theirs:.2f} | {ours:.2f} | {ratios[-1]:.2f} | {what} |", flush=True)
    if len(ratios) > 1:
        print(f"| median | | | {statistics.median(ratios):.2f} | |")


def run(side: str, program: Path, *, show: bool = False) -> float:
    """Run a program on one side; return its CPU time (s)."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, *CODE[side], str(program)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr[-2000:]}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if show:
        print(f"{side}: {done.stdout.splitlines()[-1]}", file=sys.stderr)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    main()
