"""Many meshes taken apart at once, so that CoACD has one core while the other makes what needs no CoACD.

One thread makes every mesh's hull and own parts, which must be there anyway; as soon as a mesh has them CoACD
may be asked for it, in a process of its own. When the time for CoACD is up each mesh that is left has its own
parts already, so that nothing but the last of CoACD's processes is waited for.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from queue import PriorityQueue, SimpleQueue

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
"""Seconds after which CoACD is not asked any more for any of the meshes; these keep their own parts."""


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
    """`decompose` for several meshes, in their order, `workers` at a time: the largest first, and CoACD for
    those first of whose own parts most is air.

    Args:
        total_limit: seconds after which CoACD is not asked any more, and the processes that run are ended.
        progress: called after each as (index of the mesh, how many are done, its result), from this thread.

    An interrupt ends the child processes before it goes on.
    """
    settings = Settings(method, hull_count, max_vertices, time_limit, use_cache)
    deadline = time.monotonic() + total_limit
    crew = _Crew(meshes, settings, deadline, max(1, workers))
    results: dict[int, Decomposition] = {}
    with ThreadPoolExecutor(max_workers=crew.workers, thread_name_prefix="decompose") as pool:
        try:
            for _ in range(crew.workers):
                pool.submit(crew.work)
            while len(results) < len(meshes):
                index, made = crew.done.get()
                if isinstance(made, BaseException):
                    raise made
                results[index] = made
                if progress is not None:
                    progress(index, len(results), made)
        except BaseException:
            crew.stopped.set()
            raise
    return [results[index] for index in range(len(meshes))]


class _Crew:
    """What the threads share."""

    def __init__(
        self, meshes: Sequence[TriangleMesh], settings: Settings, deadline: float, workers: int
    ) -> None:
        self.meshes, self.settings, self.deadline, self.workers = meshes, settings, deadline, workers
        self.stopped = threading.Event()
        self.done: SimpleQueue[tuple[int, Decomposition | BaseException]] = SimpleQueue()
        self._lock = threading.Lock()
        self._todo = sorted(range(len(meshes)), key=lambda index: len(meshes[index].faces))
        # own parts are made under Python's lock: a second thread would only keep CoACD from its core
        self._beginners = 1 if settings.method == "coacd" else workers
        self._beginning = self._beginners
        self._begun: PriorityQueue[tuple[float, int, PendingDecomposition | None]] = PriorityQueue()

    def work(self) -> None:
        """Make own parts as long as there are meshes and not enough threads at it, then ask CoACD."""
        with self._lock:
            begins = self._beginners > 0
            self._beginners -= 1
        if begins:
            self._begin_all()
        while not self.stopped.is_set():
            _, index, begun = self._begun.get()
            if begun is None:
                return
            self._do(
                index, lambda begun=begun: wait_decomposition(begun, self.settings, self._stop, self.deadline)
            )

    def _begin_all(self) -> None:
        while not self.stopped.is_set():
            with self._lock:
                if not self._todo:
                    break
                index = self._todo.pop()
            self._do(
                index, lambda index=index: start_decomposition(self.meshes[index], self.settings, self._stop)
            )
        with self._lock:
            self._beginning -= 1
            if self._beginning == 0:
                for thread in range(self.workers):
                    self._begun.put((math.inf, len(self.meshes) + thread, None))

    def _do(self, index: int, task: Callable[[], Decomposition | PendingDecomposition]) -> None:
        try:
            made = task()
        except BaseException as error:  # told to the thread that waits
            self.done.put((index, error))
            return
        if isinstance(made, PendingDecomposition):
            self._begun.put((-made.air, index, made))
        else:
            self.done.put((index, made))

    def _stop(self) -> bool:
        return self.stopped.is_set()
