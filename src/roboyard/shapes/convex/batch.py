"""Decompose many meshes in parallel: own parts on one core while CoACD runs on the other.

Every mesh first gets its hull and its own parts in a thread, which needs no CoACD; then CoACD may run for it
in a child process. When the time for CoACD is over, each remaining mesh has its own parts already, and only
the last child processes have to end.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from heapq import heappop, heappush
from typing import Any

from roboyard.shapes.convex.decomposition import (
    TIME_LIMIT,
    Decomposition,
    Method,
    PendingDecomposition,
    Settings,
    start_decomposition,
    wait_decomposition,
)
from roboyard.shapes.mesh import TriangleMesh

TOTAL_LIMIT = 35.0
"""Time for CoACD over all meshes (s); those that it has not reached by then keep their own parts."""


def decompose_many(
    meshes: Sequence[TriangleMesh],
    method: Method | None = "coacd",
    *,
    workers: int = 2,
    progress: Callable[[int, int, Decomposition], None] | None = None,
    hull_count: int = 8,
    max_vertices: int = 60,
    time_limit: float = TIME_LIMIT,
    total_limit: float = TOTAL_LIMIT,
    use_cache: bool = True,
) -> list[Decomposition]:
    """Return the convex parts of several meshes in their order, `workers` at a time.

    The largest meshes start first. CoACD runs first for the meshes whose own parts have the largest excess
    volume.

    Args:
        meshes: any triangles, open or closed (m).
        method: as of `decompose`, like the other arguments not listed here.
        workers: most threads, each with at most one child process.
        progress: called in this thread after each mesh with its index, the number of finished meshes and
            its result.
        total_limit: time (s) after which CoACD is not started any more and running child processes are ended.

    Raises:
        ConfigError: an unknown method, or a limit below what a hull needs.
        MeshError: a mesh has no finite vertex.

    An exception, an interrupt included, ends the child processes before it propagates.
    """
    settings = Settings(method, hull_count, max_vertices, time_limit, use_cache)
    deadline = time.monotonic() + total_limit
    stopped = threading.Event()
    workers = max(1, workers)
    # own parts are made under Python's lock: a second thread would only slow CoACD down
    most_starting = 1 if method == "coacd" else workers
    waiting = sorted(range(len(meshes)), key=lambda index: len(meshes[index].faces))
    pending: list[tuple[float, int, PendingDecomposition]] = []
    starting: dict[Future[Any], int] = {}
    running: dict[Future[Any], int] = {}
    results: dict[int, Decomposition] = {}
    with ThreadPoolExecutor(max_workers=workers, thread_name_prefix="decompose") as pool:
        try:
            while len(results) < len(meshes):
                while len(starting) < most_starting and len(starting) + len(running) < workers and waiting:
                    index = waiting.pop()
                    task = pool.submit(start_decomposition, meshes[index], settings, stopped.is_set)
                    starting[task] = index
                while len(starting) + len(running) < workers and pending:
                    _, index, item = heappop(pending)
                    task = pool.submit(wait_decomposition, item, settings, stopped.is_set, deadline)
                    running[task] = index
                for task in wait([*starting, *running], return_when=FIRST_COMPLETED).done:
                    index = starting.pop(task) if task in starting else running.pop(task)
                    made: Decomposition | PendingDecomposition = task.result()
                    if isinstance(made, PendingDecomposition):
                        heappush(pending, (-made.excess_volume, index, made))
                        continue
                    results[index] = made
                    if progress is not None:
                        progress(index, len(results), made)
        except BaseException:
            stopped.set()
            raise
    return [results[index] for index in range(len(meshes))]
