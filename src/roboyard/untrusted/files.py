"""Read a file from any source: regular files only, and no more than a given size."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterable
from pathlib import Path


class FileRefusedError(OSError):
    """A file is not read; `strerror` has the reason and the remedy."""

    def __init__(self, reason: str, file: Path | str) -> None:
        super().__init__(errno.EINVAL, reason, str(file))


def read_file(file: Path | str, max_bytes: int) -> bytes:
    """Return the content of a regular file.

    The file is opened without waiting, so that a named pipe cannot block, and its kind and size are those of
    the open file, so that exchanging the file meanwhile changes nothing.

    Args:
        file: its path.
        max_bytes: largest content that is accepted (bytes).

    Raises:
        FileRefusedError: it is a folder, a pipe, a device or a socket, or it is too large.
        OSError: it does not exist or cannot be read.
        ValueError: its name has a null character.
    """
    with open(file, "rb", opener=_open_without_waiting) as stream:
        size = os.fstat(stream.fileno()).st_size
        if size > max_bytes:
            raise FileRefusedError(f"{_amount(size)} is too large (at most {_amount(max_bytes)})", file)
        data = stream.read(max_bytes + 1)
    if len(data) > max_bytes:  # it grew, or its size is not known beforehand
        raise FileRefusedError(f"it is too large (at most {_amount(max_bytes)})", file)
    return data


def read_head(file: Path | str, count: int) -> bytes:
    """Return the first bytes of a regular file of any size, at most `count`.

    Raises:
        FileRefusedError: it is a folder, a pipe, a device or a socket.
        OSError: it does not exist or cannot be read.
        ValueError: its name has a null character.
    """
    with open(file, "rb", opener=_open_without_waiting) as stream:
        return stream.read(count)


def check_file(file: Path | str, max_bytes: int) -> int:
    """Return the size (bytes) of a file that another library is about to open.

    Raises:
        FileRefusedError: it is no regular file, or it is too large.
        OSError: it does not exist.
        ValueError: its name has a null character.
    """
    state = os.stat(file)  # noqa: PTH116 - also for str
    _check_kind(state.st_mode, file)
    if state.st_size > max_bytes:
        size = _amount(state.st_size)
        raise FileRefusedError(f"{size} is too large (at most {_amount(max_bytes)})", file)
    return state.st_size


def is_inside(file: Path, folders: Iterable[Path]) -> bool:
    """Return whether a file, symbolic links resolved, is in one of the folders, theirs resolved as well.

    A path that cannot be resolved (links in a ring) is in none.
    """
    try:
        real = file.resolve()
        return any(real.is_relative_to(folder.resolve()) for folder in folders)
    except (OSError, RuntimeError, ValueError):
        return False


def _open_without_waiting(path: str, flags: int) -> int:
    handle = os.open(path, flags | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0))
    try:
        _check_kind(os.fstat(handle).st_mode, path)
    except OSError:
        os.close(handle)
        raise
    return handle


def _check_kind(mode: int, file: Path | str) -> None:
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a folder; give a file", str(file))
    if not stat.S_ISREG(mode):
        raise FileRefusedError("it is no regular file; give a file", file)


def _amount(size: int) -> str:
    return f"{size / 2**20:.0f} MiB" if size >= 2**20 else f"{size} bytes"
