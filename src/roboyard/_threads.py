"""How many threads one task uses."""

from __future__ import annotations

import os

VARIABLE = "ROBOYARD_THREADS"
"""Environment variable with the most threads of a task; other processes are to have the other cores."""


def thread_count(most: int) -> int:
    """Return the number of threads for a task that can use `most`: at most one a core, or `VARIABLE`."""
    given = os.environ.get(VARIABLE, "")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(most, cores, int(given) if given.isdecimal() else most))
