"""The robots of a collection, and what is kept of each import."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from roboyard._version import __version__
from roboyard.description.files.robot_files import robot_files
from roboyard.description.xacro.expand import robot_stem
from roboyard.importer.source import name_from_text
from roboyard.untrusted.json_reading import read_json

Outcome = Literal["imported", "refused", "failed", "timed out", "died"]
"""Refused: Roboyard says why. Failed: an error that it did not expect. Died: the process ended."""
_MAX_BYTES = 16 << 20


@dataclass(frozen=True, kw_only=True, slots=True)
class Task:
    """One robot to import; plain data, which goes to other processes as JSON."""

    name: str
    file: str
    """Absolute path."""
    shown: str
    """Path below the collection's folder."""
    out: str
    dataset: str
    picture: str
    """File of the picture to make."""
    overwrite: bool = False
    validate: bool = True
    report: bool = True
    missing_meshes: Literal["warn", "error"] | None = None

    @property
    def key(self) -> str:
        """Hash of what a result depends on: the file as it is, the options, the version of Roboyard."""
        status = Path(self.file).stat()
        options = {key: value for key, value in asdict(self).items() if key not in ("overwrite", "picture")}
        parts = [options, status.st_mtime_ns, status.st_size, __version__]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True, kw_only=True, slots=True)
class TaskResult:
    """The end of one import."""

    name: str
    shown: str
    outcome: Outcome
    message: str = ""
    """First line of an error, or the first failed gate."""
    seconds: float = 0.0
    facts: Mapping[str, Any] = field(default_factory=dict)
    """Of an imported robot: links, joints, mass (kg), kind, warnings, gates, report, picture."""


def named_files(folder: Path, files: Iterable[Path] | None = None) -> dict[str, Path]:
    """Return the robot files of a folder by names, each once: the file's, its folders' before it if taken.

    Args:
        folder: of the collection.
        files: those to name; all robot files below the folder by default.
    """
    found: dict[str, Path] = {}
    for file in robot_files(folder) if files is None else files:
        parts = [*file.relative_to(folder).parts[:-1], robot_stem(file)]
        kept = [name_from_text("_".join(parts[-count:])) for count in range(1, len(parts) + 1)]
        free = [name for name in kept if name not in found]
        number, name = 2, free[0] if free else ""
        while not name or name in found:
            name, number = f"{kept[-1]}_{number}", number + 1
        found[name] = file
    return found


class Journal:
    """Results on the disk, one file each, written when a robot is done; a killed run leaves whole ones.

    Args:
        folder: of the run; `results/` below it has the files.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "results"

    def result(self, task: Task) -> TaskResult | None:
        """Return the result of a task that was finished with the same file and options."""
        try:
            data = read_json(self._file(task, "json"), _MAX_BYTES)
            same = data.pop("key") == task.key
            return TaskResult(**data) if same else None
        except (OSError, ValueError, TypeError, KeyError, AttributeError):
            return None

    def was_begun(self, task: Task) -> bool:
        """Return whether an earlier run began the robot and was not refused it: then its package is ours."""
        return self._file(task, "begun").exists()

    def begin(self, task: Task) -> None:
        """Note that a robot is begun; the note stays unless it is refused."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self._file(task, "begun").touch()

    def store(self, task: Task, result: TaskResult) -> None:
        """Store a result whole."""
        self.folder.mkdir(parents=True, exist_ok=True)
        draft = self._file(task, f"draft{os.getpid()}")
        draft.write_text(json.dumps({**asdict(result), "key": task.key}), encoding="utf-8")
        draft.replace(self._file(task, "json"))
        if result.outcome == "refused":
            self._file(task, "begun").unlink(missing_ok=True)

    def _file(self, task: Task, ending: str) -> Path:
        return self.folder / f"{task.name}.{ending}"
