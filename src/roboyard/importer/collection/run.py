"""Import every robot of a folder; a run that is killed continues where it was."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from roboyard.errors import ConfigError
from roboyard.importer.collection.page import write_tables
from roboyard.importer.collection.pool import local_results
from roboyard.importer.collection.tasks import Journal, Task, TaskResult, named_files
from roboyard.importer.source import name_from_text
from roboyard.paths import DEFAULT_DATASET, writable_data_folder

TIMEOUT = 900.0
"""Longest time of one robot (s)."""
Progress = Callable[[TaskResult, int, int], None]
"""Called with each result, the number of robots that are done, and the number of all."""


@dataclass(frozen=True, kw_only=True)
class CollectionResult:
    """A finished run."""

    folder: Path
    """Of the tables, the page and the pictures."""
    results: tuple[TaskResult, ...]
    """Of all robots, by path."""
    reused: int
    """Results that an earlier run left."""

    @property
    def page(self) -> Path:
        """The page with all robots."""
        return self.folder / "index.html"


def import_collection(
    folder: Path | str,
    *,
    out: Path | str | None = None,
    dataset: str | None = None,
    jobs: int | None = None,
    ray: str | None = None,
    timeout: float = TIMEOUT,
    retry: bool = False,
    overwrite: bool = False,
    validate: bool = True,
    report: bool = True,
    missing_meshes: Literal["warn", "error"] | None = None,
    progress: Progress | None = None,
) -> CollectionResult:
    """Import all robots of a folder, each in a process of its own.

    Args:
        folder: of the robots (see `description.files.robot_files`).
        out: data folder; see `roboyard.paths.data_folder`.
        dataset: dataset folder below it; `omnigibson-robot-assets` by default.
        jobs: robots at a time; as many as there are cores by default.
        ray: address of a Ray cluster that imports them instead of processes of this machine.
        timeout: longest time of one robot (s); its process is killed then.
        retry: import again what an earlier run could not.
        overwrite: replace robots that other imports made; those of an earlier run are ours.
        validate: whether to run `roboyard.validation` on each.
        report: whether to write a page for each.
        missing_meshes: as in `import_robot`.
        progress: called with each result.

    Raises:
        ConfigError: there is no robot in the folder, or no cluster at the address.
        MissingExtraError: a cluster is named and Ray is not installed.
    """
    place = Path(folder).absolute()
    if not place.is_dir():
        raise ConfigError(f"{folder}: there is no such folder; check the path")
    files = named_files(place)
    if not files:
        raise ConfigError(f"{folder}: there is no robot file in this folder; check the path")
    if timeout <= 0 or (jobs is not None and jobs < 1):
        raise ConfigError(f"--jobs and --timeout must be above 0, got {jobs} and {timeout:g}")
    data, chosen = writable_data_folder(out).absolute(), dataset or DEFAULT_DATASET
    digest = hashlib.sha256(str(place).encode()).hexdigest()[:8]
    state = data / chosen / "collections" / f"{name_from_text(place.name)}-{digest}"
    journal = Journal(state)
    done: dict[str, TaskResult] = {}
    todo: list[Task] = []
    for name, file in files.items():
        task = Task(
            name=name,
            file=str(file),
            shown=file.relative_to(place).as_posix(),
            out=str(data),
            dataset=chosen,
            picture=str(state / "pictures" / f"{name}.png"),
            validate=validate,
            report=report,
            missing_meshes=missing_meshes,
        )
        known = journal.result(task)
        if known is not None and (known.outcome == "imported" or not retry):
            done[name] = known
        else:
            todo.append(replace(task, overwrite=overwrite or journal.was_begun(task)))
    reused = len(done)
    for task, result in _results(todo, ray, jobs, timeout, journal) if todo else ():
        journal.store(task, result)
        done[task.name] = result
        if progress is not None:
            progress(result, len(done), len(files))
    results = tuple(done[name] for name in files)
    write_tables(state, place, results)
    return CollectionResult(folder=state, results=results, reused=reused)


def _results(
    todo: list[Task], ray: str | None, jobs: int | None, timeout: float, journal: Journal
) -> Iterator[tuple[Task, TaskResult]]:
    """Return the iterator of results of this machine, or of a cluster."""
    if ray is None:
        return local_results(todo, jobs or os.cpu_count() or 1, timeout, journal.begin)
    from roboyard.importer.collection.ray_pool import ray_results

    return ray_results(todo, ray, jobs, timeout, journal.begin)
