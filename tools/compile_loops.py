"""Compile all loops of the package on all cores, so that no test waits for one.

    python tools/compile_loops.py

Loops that are stored already are left alone. Each process takes one module after another, those first that
are compiled from most source: loops of one module share the functions that they call.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import re
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import roboyard
from roboyard.native import Kernel
from roboyard.native.callbacks import Callback
from roboyard.native.called import source_of
from roboyard.native.fronts import Front

PACKAGE = Path(roboyard.__file__).parent
DECORATED = re.compile(r"^(@(compiled|fronted|kernel|called_by_c)|[A-Z]+ = Front)\(", re.MULTILINE)


def main() -> None:
    """Compile what is not stored, and say how many loops there were."""
    start = time.monotonic()
    spawn = multiprocessing.get_context("spawn")
    # a process for each module: LLVM's code, and thereby rounding, depends on what was compiled before
    with ProcessPoolExecutor(os.cpu_count(), mp_context=spawn, max_tasks_per_child=1) as pool:
        compiled = sum(pool.map(compile_module, modules_with_loops()))
    print(f"{compiled} loops compiled in {time.monotonic() - start:.0f} s")


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


def compile_module(name: str) -> int:
    """Compile the loops of a module and return how many were not stored before."""
    values = list(vars(importlib.import_module(name)).values())
    loops = [value for value in values if isinstance(value, Kernel) and value.__module__ == name]
    new = [loop for loop in loops if not loop.is_ready]
    for loop in new:
        loop.load()
    fronts = [value.front for value in values if isinstance(getattr(value, "front", None), Front)]
    callbacks = [value for value in values if isinstance(value, Callback)]
    missing = [front for front in (*fronts, *callbacks) if not front.is_stored]
    for front in missing:
        front.address()
    return len(new) + len(missing)


if __name__ == "__main__":
    main()
