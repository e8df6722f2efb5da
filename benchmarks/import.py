"""Time and memory of an import, step by step, with an empty cache and with a full one.

    python benchmarks/import.py [ROBOT.urdf] [--method coacd] [--all-links]

The bundled R1's vendor file where no URDF is given. Each run is a process of its own, as a user's; shown are
seconds by the clock, seconds of processor time (child processes included) and peak memory. Data and cache are
in a folder that is removed at the end.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import yaml

from roboyard.assets import asset_path
from roboyard.description import load_description


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "urdf", nargs="?", default=str(asset_path("r1/r1_description/urdf/r1_pro_source.urdf"))
    )
    parser.add_argument("--method", choices=("coacd", "convex"), default="coacd")
    parser.add_argument(
        "--all-links", action="store_true", help="also links with collision shapes of their own"
    )
    arguments = parser.parse_args()
    description = load_description(arguments.urdf)
    collision: dict[str, object] = {"decompose_method": arguments.method}
    if arguments.all_links:
        collision[f"{arguments.method}_links"] = [link.name for link in description.links if link.visuals]
    print(f"{description.name}: {len(description.links)} links, {arguments.method}")
    with tempfile.TemporaryDirectory(prefix="roboyard-import-") as folder:
        config = Path(folder, "config.yaml")
        named = {"urdf_path": str(Path(arguments.urdf).absolute()), "name": "bench", "collision": collision}
        config.write_text(yaml.safe_dump(named))
        for run in ("empty cache", "full cache"):
            _run(run, config, Path(folder))


def _run(name: str, config: Path, folder: Path) -> None:
    command = [sys.executable, "-m", "roboyard", "import", "--config", str(config), "--json", "--overwrite"]
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(
        [*command, "--headless", "--data", str(folder / "data")],
        env={**os.environ, "ROBOYARD_CACHE": str(folder / "cache")},
        stdout=subprocess.PIPE,
        check=True,
    )
    seconds, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"{name}: {seconds:.1f} s, processor {used:.1f} s, peak {after.ru_maxrss / 1024:.0f} MB")
    steps = json.loads(done.stdout)["seconds"]
    print("   " + ", ".join(f"{step} {value:.2f}" for step, value in steps.items() if value >= 0.05))


if __name__ == "__main__":
    main()
