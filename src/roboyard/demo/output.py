"""An output folder that is written completely or not at all."""

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
"""Value of "made_by" in the summary.json of a demo, whose files a later demo may replace."""


def check_target(target: Path, *, overwrite: bool) -> None:
    """Check that the output folder can be written, before the demo starts.

    Args:
        target: the output folder.
        overwrite: accept a folder that holds other files.

    Raises:
        ConfigError: `target` is a file, holds other files without `overwrite`, or cannot be written to.
    """
    if target.exists() and not target.is_dir():
        raise ConfigError(f"--out {target}: not a folder but a file; name a folder")
    folder = next(one for one in target.absolute().parents if one.exists())
    try:
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise ConfigError(
            f"--out {target}: cannot write to {folder} ({error.strerror}); name another folder"
        ) from error
    if not target.is_dir() or overwrite or not any(target.iterdir()) or _made_before(target):
        return
    raise ConfigError(
        f"--out {target}: the folder is not empty and holds no earlier demo; "
        "name another folder, or add --overwrite"
    )


def _made_before(target: Path) -> set[str]:
    """Return the names of the files that an earlier demo wrote there."""
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
    """Yield a temporary folder that becomes `target` at the end; after an error `target` is unchanged.

    If `target` exists, the new files are moved into it one by one, files of an earlier demo that were not
    written again are removed, and all other files stay.
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
    """Create the missing folders of a path and return them, innermost first."""
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
