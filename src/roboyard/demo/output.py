"""A folder that is written whole or not at all."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from roboyard.errors import ConfigError

MARK = "roboyard demo"
"""Value of "made_by" in a summary.json: this folder is ours to replace."""


def check_target(target: Path, *, overwrite: bool) -> None:
    """Refuse a place that holds something else or where nothing can be written, before any work is done.

    Raises:
        ConfigError: it is a file, or a folder that holds other things and `overwrite` is not given, or its
            folder cannot be written to.
    """
    if target.exists() and not target.is_dir():
        raise ConfigError(f"--out {target}: is a file; name a folder")
    folder = next(one for one in target.absolute().parents if one.exists())
    try:
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise ConfigError(
            f"--out {target}: nothing can be written to {folder} ({error.strerror}); name another folder"
        ) from error
    if not target.is_dir() or overwrite or not any(target.iterdir()) or _made_before(target):
        return
    raise ConfigError(
        f"--out {target}: the folder is not empty and holds no earlier demo; "
        "name another folder, or allow it with --overwrite"
    )


def _made_before(target: Path) -> set[str]:
    """Files that an earlier demo wrote there; empty if none did."""
    try:
        summary = json.loads((target / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return set()
    if not isinstance(summary, dict) or summary.get("made_by") != MARK:
        return set()
    files = summary.get("files")
    names = set(files) if isinstance(files, list) else set()
    return {name for name in names if isinstance(name, str) and Path(name).name == name} | {"summary.json"}


@contextmanager
def whole_folder(target: Path) -> Iterator[Path]:
    """A folder to write into that becomes `target` at the end; after an error `target` is as it was.

    Into a folder that exists the new files are moved one by one, and what an earlier demo left and this one
    did not write is removed; other files stay.
    """
    parent = target.absolute().parent
    made = _make_parents(parent)
    work = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=parent))
    try:
        yield work
        _move_in(work, target)
    except BaseException:
        shutil.rmtree(work, ignore_errors=True)
        for folder in made:
            with suppress(OSError):
                folder.rmdir()
        raise


def _make_parents(parent: Path) -> list[Path]:
    """Create what is missing of a path; the folders created, innermost first."""
    missing = []
    while not parent.exists():
        missing.append(parent)
        parent = parent.parent
    for folder in reversed(missing):
        folder.mkdir(exist_ok=True)
    return missing


def _move_in(work: Path, target: Path) -> None:
    if not target.exists():
        work.chmod(0o777 & ~_umask())
        work.rename(target)
        return
    stale = _made_before(target)
    for file in sorted(work.iterdir()):
        file.replace(target / file.name)
        stale.discard(file.name)
    for name in stale:
        (target / name).unlink(missing_ok=True)
    work.rmdir()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
