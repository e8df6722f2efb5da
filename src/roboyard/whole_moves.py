"""Folders that are built whole and then moved to their places together, also where the process is killed.

A build folder `<dataset>/.import-<name>-<random>/` holds the new parts `object/` and `model/`. A mark in it,
written when both are whole and on the disk, says that they may be moved in: the next import of that
name, or the next reader of the data folder, finishes the move. The move exchanges folders (one
system call each where the system has it). A lock that the system drops with the process keeps two apart.
"""

from __future__ import annotations

import ctypes
import errno
import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path

from roboyard.paths import models_folder, objects_folder
from roboyard.untrusted.json_reading import read_json

READY = "ready"
"""File in a build folder whose parts are whole: they may be moved in. It holds the file system's number of
each new part, since a part's place in the build folder holds the old one once the two were exchanged.
"""
_MAX_MARK = 1 << 16
_THREADS = 16
_PARTS = ("object", "model")

Move = tuple[Path, Path]
"""Part of a build folder, and where it goes."""


def mark_ready(build: Path) -> None:
    """Mark a build folder, after its parts are on the disk."""
    numbers = {name: (build / name).stat().st_ino for name in _PARTS}
    for name in _PARTS:
        sync_tree(build / name)
    draft = build / f"{READY}.draft"
    with draft.open("w", encoding="utf-8") as stream:
        stream.write(json.dumps(numbers))
        stream.flush()
        os.fsync(stream.fileno())  # the name must not reach the disk before the content
    draft.replace(build / READY)
    sync_folder(build)


def sync_tree(folder: Path) -> None:
    """Write all files below a folder to the disk, where the system can."""
    paths: list[Path] = []
    for place, _, files in os.walk(folder):
        paths += [Path(place) / name for name in files]
        paths += [Path(place)] if sys.platform != "win32" else []
    with ThreadPoolExecutor(_THREADS) as pool:  # the system writes what waits together in one go
        list(pool.map(_sync, paths))


def sync_folder(folder: Path) -> None:
    """Write a folder's entries to the disk, where the system has that."""
    if sys.platform != "win32":
        _sync(folder)


def _sync(path: Path) -> None:
    with suppress(OSError):
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0))
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def marked(build: Path) -> Mapping[str, int] | None:
    """The numbers in a mark; None without one. A mark that is empty, cut or of other content is none."""
    try:
        numbers = read_json(build / READY, _MAX_MARK)
    except (OSError, ValueError):
        return None
    if not isinstance(numbers, dict) or set(numbers) != set(_PARTS):
        return None
    return numbers if all(type(number) is int for number in numbers.values()) else None


def exchange(a: Path, b: Path) -> bool:
    """Swap two folders in one step; False where the system cannot.

    Raises:
        OSError: one does not exist, or the disk is full or read-only.
    """
    if not sys.platform.startswith("linux"):
        return False
    at_cwd, flag = -100, 2
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError):
        return False
    if rename(at_cwd, os.fsencode(a), at_cwd, os.fsencode(b), flag) == 0:
        return True
    if ctypes.get_errno() in (errno.ENOSYS, errno.EINVAL, errno.EPERM):
        return False
    raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()), str(b))


def put(part: Path, target: Path, *, swap: Callable[[Path, Path], bool] = exchange) -> None:
    """Put a part in its place; what was there goes to the part's folder."""
    if target.exists() and not swap(part, target):
        target.rename(part.with_name(f"{part.name}.old"))
    if not target.exists():
        part.rename(target)


def move_in(build: Path, moves: Iterable[Move], *, put_part: Callable[[Path, Path], None] = put) -> None:
    """Put the parts of a marked build folder in their places. Done again after an interruption it goes on."""
    numbers = marked(build)
    if numbers is None:
        return
    parents: list[Path] = []
    for part, target in moves:
        parents.append(target.parent)
        if part.exists() and part.stat().st_ino == numbers[part.name]:
            target.parent.mkdir(parents=True, exist_ok=True)
            put_part(part, target)
    for parent in parents:
        sync_folder(parent)  # the mark must not go before the moves are on the disk
    (build / READY).unlink()


def moves_of(data: Path, dataset: str, name: str, build: Path) -> tuple[Move, ...]:
    """Return where the parts of a robot's build folder go."""
    return (
        (build / "object", objects_folder(data, dataset, name)),
        (build / "model", models_folder(data, dataset, name)),
    )


def is_build_of(build: Path, name: str) -> bool:
    """`.import-r1-abc` is r1's; `.import-r1-x-abc` cannot be, as names hold no `-`."""
    rest = build.name.removeprefix(f".import-{name}-")
    return build.is_dir() and not build.is_symlink() and "-" not in rest


def finish_moves(data: Path) -> None:
    """Finish the moves of imports that were killed in them, so that no reader finds half of two imports.

    Where another process holds the lock, or nothing can be written, they are left alone.
    """
    for mark in data.glob(f"*/.import-*/{READY}"):
        build = mark.parent
        root, name = build.parent, build.name.removeprefix(".import-").partition("-")[0]
        if not name or not is_build_of(build, name):
            continue
        with suppress(OSError), locked(root, name) as is_ours:
            if is_ours:
                move_in(build, moves_of(data, root.name, name, build))


@contextmanager
def locked(root: Path, name: str) -> Iterator[bool]:
    """Hold the lock of a robot's name in a dataset's folder; False where another process holds it.

    Raises:
        OSError: the lock cannot be made.
    """
    path = root / f".import-{name}.lock"
    handle = _take_lock(path)
    if handle is None:
        yield False
        return
    try:
        yield True
    finally:
        with suppress(OSError):
            path.unlink()
        os.close(handle)


def _take_lock(path: Path) -> int | None:
    """An open, locked file, or None where another process holds it."""
    for _ in range(100):
        handle = os.open(path, os.O_CREAT | os.O_RDWR | getattr(os, "O_NOFOLLOW", 0), 0o600)
        if not _lock(handle):
            os.close(handle)
            return None
        try:
            if os.path.samestat(os.fstat(handle), path.stat()):
                return handle
        except FileNotFoundError:
            pass  # its last holder removed it between our opening and locking it
        os.close(handle)
    return None


def _lock(handle: int) -> bool:
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
