"""Run the side-by-side benchmarks and write docs/benchmarks.md, with machine, versions and date: make bench.

    python tools/bench_page.py [--only step,calls] [--out docs/benchmarks.md] [--quick]

Peers take part where they are installed beside Roboyard (`pip install pybullet mink mplib`); the page names
those that did not. Each table is what the benchmark printed: nothing is omitted, also where Roboyard loses.
"""

from __future__ import annotations

import argparse
import datetime
import importlib.metadata
import os
import platform
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
PEERS = ("pybullet", "mujoco", "numba", "mink", "mplib", "ompl", "pybullet_planning", "viser")
LIMIT = 1800.0
"""Longest time of one benchmark (s)."""


@dataclass(frozen=True, kw_only=True)
class Benchmark:
    """One section of the page."""

    name: str
    title: str
    reading: str
    """How to read the table, in a sentence or two."""
    arguments: tuple[str, ...] = ()
    quick: tuple[str, ...] | None = None
    """Arguments of a short run; those of the full one by default."""


BENCHMARKS = (
    Benchmark(
        name="programs",
        title="Whole PyBullet programs",
        reading="CPU time of whole processes, start-up included; a ratio below 1: Roboyard takes less.",
        quick=("--rounds", "1"),
    ),
    Benchmark(
        name="step",
        title="Physics steps",
        reading="`times PyBullet` above 1: Roboyard makes more steps in the same time. "
        "`over mj_step`: the cost above MuJoCo alone.",
        quick=("--rounds", "5"),
    ),
    Benchmark(
        name="calls",
        title="Single calls of PyBullet's API, and the start of a script",
        reading="Microseconds of CPU; a ratio below 1: Roboyard is faster. `start` is a whole process, in s.",
        quick=("--rounds", "1"),
    ),
    Benchmark(
        name="camera",
        title="Pictures",
        reading="Milliseconds a picture; `x tiny` above 1: faster than PyBullet's TinyRenderer.",
        arguments=("--no-gl",),
        quick=("--no-gl", "--rounds", "5"),
    ),
    Benchmark(name="ik", title="Inverse kinematics", reading="Time of one pose.", quick=("--poses", "60")),
    Benchmark(
        name="collision_checks",
        title="Collision checks",
        reading="Configurations a second of CPU time on one core: 60 spheres of the arm among 20 boxes.",
        quick=("--count", "4000"),
    ),
    Benchmark(
        name="planning_sets",
        title="Motion planning",
        reading="Seeded problems; path, shortening and timing on one core. MuJoCo replays each motion.",
        quick=("--count", "30", "--only", "arm7"),
    ),
    Benchmark(
        name="planning",
        title="Motion planning beside other planners",
        reading="The same problems for all, on one core; CPU time of a path, and of its timing for Roboyard. "
        "`valid`: free in MuJoCo every 0.01 rad. `length / ours` above 1: Roboyard's path is shorter. "
        "Published by others, on their machines and problems: VAMP finds paths of a Panda (MotionBenchMaker) "
        "in 0.035 ms (median, one CPU core; arXiv:2309.14545), cuRobo whole motions within 50 ms on average "
        "and geometric paths within 20 ms (GPU; arXiv:2310.17274).",
        arguments=("scenes",),
        quick=("scenes", "--count", "5"),
    ),
    Benchmark(
        name="viewer",
        title="Pages in the browser",
        reading="R1 moves in a headless Chromium without a GPU, where Roboyard starts in low quality.",
        arguments=("r1", "--rounds", "2"),
        quick=("r1", "--rounds", "1"),
    ),
    Benchmark(name="pool", title="Adding bodies one by one", reading="With the body pool and without."),
    Benchmark(name="import", title="An import", reading="The bundled R1 from its vendor file."),
)


def machine() -> list[str]:
    """Lines about the machine and the versions."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        found = re.search(r"^model name\s*: (.+)$", info.read_text(encoding="utf-8"), flags=re.MULTILINE)
        model = found[1] if found else model
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    versions = {name: _version(name) for name in PEERS}
    present = ", ".join(f"{name} {version}" for name, version in versions.items() if version)
    absent = ", ".join(name for name, version in versions.items() if not version)
    return [
        f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d}, {model}, {count} cores, {platform.system()}, "
        f"Python {platform.python_version()}; {present}. "
        f"Mean load while it ran: {_load():.1f}." + (f" Not installed: {absent}." if absent else "")
    ]


def _load() -> float:
    """Return the mean number of busy processes in the last quarter of an hour; 0 where it is not known."""
    return os.getloadavg()[2] if hasattr(os, "getloadavg") else 0.0


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return ""


def section(benchmark: Benchmark, *, quick: bool) -> list[str]:
    """Run one benchmark; return its part of the page."""
    arguments = benchmark.quick if quick and benchmark.quick is not None else benchmark.arguments
    command = ["python", f"benchmarks/{benchmark.name}.py", *arguments]
    print(" ".join(command), file=sys.stderr, flush=True)
    # installed packages have their bytecode; compiling a checkout again at every start says nothing
    environment = {name: v for name, v in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    done = subprocess.run(
        [sys.executable, *command[1:]],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    printed = [
        line.rstrip() for line in done.stdout.splitlines() if not line.startswith("pybullet build time")
    ]
    if done.returncode != 0 and not printed:
        raise SystemExit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr[-2000:]}")
    is_table = any(line.startswith("|") for line in printed)
    body = printed if is_table else ["```", *printed, "```"]
    return [f"## {benchmark.title}", "", f"`{' '.join(command)}`", "", benchmark.reading, "", *body, ""]


def main(arguments: Sequence[str]) -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", default="", help="benchmarks, by name")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "benchmarks.md")
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    given = parser.parse_args(arguments)
    chosen = [name for name in given.only.split(",") if name] or [one.name for one in BENCHMARKS]
    unknown = sorted(set(chosen) - {one.name for one in BENCHMARKS})
    if unknown:
        parser.error(f"no benchmark {unknown[0]!r}; there are {', '.join(one.name for one in BENCHMARKS)}")
    lines = [
        "# Benchmarks",
        "",
        "Side by side with other programs in one run, in turns, written by `make bench`. "
        "[Moving from PyBullet](pybullet.md) says what the figures mean for whole programs.",
        "",
    ]
    body: list[str] = []
    for benchmark in BENCHMARKS:
        if benchmark.name in chosen:
            body += section(benchmark, quick=given.quick)
    lines += [*machine(), "", *body]
    given.out.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")
    print(f"wrote {given.out}", file=sys.stderr)


if __name__ == "__main__":
    main(sys.argv[1:])
