"""Compile all loops of the package on all cores, so that no test waits for one.

    python tools/compile_loops.py [--reserve 1] [--last-first]

Loops that are stored already are left alone. Each process takes one module, those first that are compiled
from most source: loops of one module share the functions that they call. `--reserve` keeps cores for others;
`--last-first` begins with the shortest, so that a second run helps one that is under way.
"""

from __future__ import annotations

import argparse
import importlib
import multiprocessing
import os
import re
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import roboyard
from roboyard.native import Kernel
from roboyard.native.callbacks import Callback
from roboyard.native.called import source_of
from roboyard.native.fronts import Front

PACKAGE = Path(roboyard.__file__).parent
DECORATED = re.compile(r"^(@(compiled|fronted|kernel|called_by_c)|[A-Z]+ = Front)\(", re.MULTILINE)


def main() -> None:
    """Compile what is not stored, and say how many loops there were."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--reserve", type=int, default=0, help="cores left to other programs")
    parser.add_argument("--last-first", action="store_true", help="begin with the shortest sources")
    options = parser.parse_args()
    processes = max(1, (os.cpu_count() or 1) - options.reserve)
    start = time.monotonic()
    names = [name for name in modules_with_loops() if any(missing_of(name))]
    if options.last_first:
        names.reverse()
    # a process for each module: LLVM's code, and thereby rounding, depends on what was compiled before
    with ProcessPoolExecutor(processes, mp_context=fresh_processes(names), max_tasks_per_child=1) as pool:
        compiled = sum(pool.map(compile_module, names))
    print(f"{compiled} loops compiled in {time.monotonic() - start:.0f} s")


def fresh_processes(names: list[str]) -> Any:
    """Return how processes start: forked from one that has imported all and compiled nothing, if possible."""
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["roboyard.native.building", *names])
    return context


def modules_with_loops() -> list[str]:
    """Return the names of the modules with decorated loops, those with the longest sources first."""
    found = [path for path in PACKAGE.rglob("*.py") if DECORATED.search(path.read_text(encoding="utf-8"))]
    names = [".".join(("roboyard", *path.relative_to(PACKAGE).with_suffix("").parts)) for path in found]
    return sorted(names, key=lambda name: -length_of_sources(name))


def length_of_sources(name: str) -> int:
    """Return the length of a module and of all source files that its loops are compiled from."""
    module = importlib.import_module(name)
    loops = [value for value in vars(module).values() if isinstance(value, Kernel)]
    parts = [part for loop in loops if loop.__module__ == name for part in source_of(loop.py_func)]
    return Path(str(module.__file__)).stat().st_size + sum(len(part) for part in parts)


def missing_of(name: str) -> tuple[list[Kernel], list[Front | Callback]]:
    """Return the loops, and the fronts and callbacks, of a module that are not stored."""
    values = list(vars(importlib.import_module(name)).values())
    loops = [value for value in values if isinstance(value, Kernel) and value.__module__ == name]
    fronts = [value.front for value in values if isinstance(getattr(value, "front", None), Front)]
    callbacks = [value for value in values if isinstance(value, Callback)]
    return (
        [loop for loop in loops if not loop.is_ready],
        [front for front in (*fronts, *callbacks) if not front.is_stored],
    )


def compile_module(name: str) -> int:
    """Compile the loops of a module and return how many were not stored before."""
    loops, _ = missing_of(name)
    for loop in loops:
        loop.load()
    _, fronts = missing_of(name)  # some fronts are compiled with a loop
    for front in fronts:
        front.address()
    return len(loops) + len(fronts)


if __name__ == "__main__":
    main()
