"""Run tasks in processes of this machine: one for each job, replaced where it hangs or dies."""

from __future__ import annotations

import json
import os
import queue
import selectors
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict
from typing import Any

from roboyard._threads import VARIABLE
from roboyard.importer.collection.tasks import Outcome, Task, TaskResult
from roboyard.importer.collection.worker import MARK

COMMAND = (sys.executable, "-m", "roboyard.importer.collection.worker")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", VARIABLE)
MAX_TASKS = 50
"""Robots that one process imports before a new one takes over, so that no memory adds up."""
_LONGEST = 64 << 20
"""Longest answer (bytes)."""


class WorkerProcess:
    """One process that imports robots, a thread each of every library, so that jobs do not share cores."""

    def __init__(self) -> None:
        self.count = 0
        self._process: subprocess.Popen[bytes] | None = None

    def run(self, task: Task, timeout: float) -> TaskResult:
        """Import one robot; never fails.

        Args:
            task: the robot.
            timeout: time after which the process is killed (s).
        """
        begin = time.monotonic()
        if self._process is None or self._process.poll() is not None or self.count >= MAX_TASKS:
            self.close()
            self._process = self._start()
        self.count += 1
        outcome, answer = self._ask(self._process, json.dumps(asdict(task)), timeout)
        if answer is not None:
            return TaskResult(**answer)
        code = self._process.poll()
        self.close()
        reason = f"it took more than {timeout:g} s" if outcome == "timed out" else f"exit code {code}"
        return TaskResult(
            name=task.name,
            shown=task.shown,
            outcome=outcome,
            message=reason,
            seconds=round(time.monotonic() - begin, 2),
        )

    def close(self) -> None:
        """Kill the process with all that it started."""
        process, self._process, self.count = self._process, None, 0
        if process is None:
            return
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL) if sys.platform != "win32" else process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with suppress(OSError):  # what was not sent is lost with the process
                    pipe.close()

    def _start(self) -> subprocess.Popen[bytes]:
        return subprocess.Popen(  # noqa: S603 - our own module
            COMMAND,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **dict.fromkeys(_THREADS, "1")},
            start_new_session=sys.platform != "win32",
        )

    def _ask(
        self, process: subprocess.Popen[bytes], text: str, timeout: float
    ) -> tuple[Outcome, dict[str, Any] | None]:
        """Send a task and wait for its result; None where there is none in time."""
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(f"{text}\n".encode())
            process.stdin.flush()
        except OSError:
            return "died", None
        end, data = time.monotonic() + timeout, b""
        with selectors.DefaultSelector() as selector:
            selector.register(process.stdout, selectors.EVENT_READ)
            while True:
                left = end - time.monotonic()
                if left <= 0 or not selector.select(left):
                    return "timed out", None
                part = os.read(process.stdout.fileno(), 1 << 16)
                data += part
                if not part or len(data) > _LONGEST:
                    process.wait() if not part else None
                    return "died", None
                if data.endswith(b"\n"):
                    last = data.decode("utf-8", "replace").splitlines()[-1]
                    return "imported", json.loads(last.removeprefix(MARK))


def local_results(
    tasks: Sequence[Task], jobs: int, timeout: float, begin: Callable[[Task], None]
) -> Iterator[tuple[Task, TaskResult]]:
    """Yield each task with its result, as they are done.

    Args:
        tasks: the robots.
        jobs: processes at a time.
        timeout: longest time of one robot (s).
        begin: called before each robot, in any thread.
    """
    waiting: queue.SimpleQueue[Task] = queue.SimpleQueue()
    for task in tasks:
        waiting.put(task)
    done: queue.SimpleQueue[tuple[Task, TaskResult]] = queue.SimpleQueue()
    workers = [WorkerProcess() for _ in range(min(jobs, len(tasks)))]
    stopped = threading.Event()

    def serve(worker: WorkerProcess) -> None:
        while not stopped.is_set():
            try:
                task = waiting.get_nowait()
            except queue.Empty:
                break
            begin(task)
            done.put((task, worker.run(task, timeout)))
        worker.close()

    threads = [threading.Thread(target=serve, args=(worker,), daemon=True) for worker in workers]
    for thread in threads:
        thread.start()
    try:
        for _ in tasks:
            yield done.get()
    finally:
        stopped.set()
        for worker in workers:
            worker.close()
