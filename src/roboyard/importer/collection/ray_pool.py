"""Run tasks on a Ray cluster, whose machines share the folders of robots and packages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from roboyard.errors import ConfigError, MissingExtraError
from roboyard.importer.collection.pool import WorkerProcess
from roboyard.importer.collection.tasks import Task, TaskResult

try:
    import ray  # pyright: ignore[reportMissingImports]
    from ray.exceptions import RayError  # pyright: ignore[reportMissingImports]
except ModuleNotFoundError as error:
    raise MissingExtraError("ray", "cluster", "imports on a cluster") from error

_RETRIES = 2
"""Further attempts where a machine is lost; a robot that ends its own process is not tried again."""


def ray_results(
    tasks: Sequence[Task], address: str, jobs: int | None, timeout: float, begin: Callable[[Task], None]
) -> Iterator[tuple[Task, TaskResult]]:
    """Yield each task with its result, as they are done.

    Args:
        tasks: the robots.
        address: of the cluster, as `ray.init` takes it; "local" starts one on this machine.
        jobs: robots at a time; as many as the cluster has cores by default.
        timeout: longest time of one robot (s).
        begin: called before each robot.

    Raises:
        ConfigError: there is no cluster at the address.
    """
    try:
        if not ray.is_initialized():
            ray.init(address=address, include_dashboard=False, log_to_driver=False)
    except (ConnectionError, RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split())[:200]
        raise ConfigError(f"--ray {address}: there is no cluster ({reason}); check the address") from None
    remote = ray.remote(num_cpus=1, max_retries=_RETRIES)(_run_alone)
    limit = jobs or max(int(ray.cluster_resources().get("CPU", 1)), 1)
    waiting, running = list(reversed(tasks)), dict[Any, Task]()
    try:
        while waiting or running:
            while waiting and len(running) < limit:
                task = waiting.pop()
                begin(task)
                running[remote.remote(task, timeout)] = task
            (ready, *_), _ = ray.wait(list(running))
            task = running.pop(ready)
            try:
                yield task, ray.get(ready)
            except RayError as error:
                text = (str(error).splitlines() or [""])[0][:300]
                yield task, TaskResult(name=task.name, shown=task.shown, outcome="died", message=text)
    finally:
        for reference in running:
            ray.cancel(reference, force=True)


def _run_alone(task: Task, timeout: float) -> TaskResult:
    worker = WorkerProcess()
    try:
        return worker.run(task, timeout)
    finally:
        worker.close()
