"""Where the commands of a client may write: anywhere in a script's own world, in one folder on a server."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

from roboyard._records import dataclass
from roboyard.untrusted.files import FileRefusedError, is_inside

_BUFFER = 1 << 16
"""Bytes that are written at once."""


@dataclass(frozen=True, slots=True)
class OutputFiles:
    """The rule for the files that a client writes."""

    is_free: bool = True
    """True for a script's own world: any file, relative to the working folder."""
    folder: Path | None = None
    """Otherwise the folder that nothing may leave; None where nothing may be written."""

    def open(self, name: str) -> BinaryIO:
        """Open a file of this name for writing.

        Raises:
            OSError: it cannot be opened, or may not be written.
        """
        # with a given size, Python asks for no more about the file than that it is none but a folder
        return open(name if self.is_free else self.path(name), "wb", buffering=_BUFFER)  # noqa: PTH123

    def write(self, name: str, content: bytes | memoryview) -> None:
        """Write a whole file of this name.

        Raises:
            OSError: it cannot be written, or may not be.
        """
        write_file(name if self.is_free else self.path(name), content)

    def path(self, name: str) -> Path:
        """Return where a file of this name is written.

        Raises:
            FileRefusedError: it may not be written; the message has the remedy.
        """
        if self.is_free:
            return Path(name)
        if self.folder is None:
            raise FileRefusedError(
                "this server's clients may write no files; start it with --folder FOLDER", name
            )
        file = self.folder / name
        try:
            is_special = file.exists() and not file.is_file()
        except (OSError, ValueError):
            is_special = True
        if is_special or file.name in ("", "..") or not is_inside(file, (self.folder,)):
            raise FileRefusedError(f"files are written in {self.folder} only; give a name in it", name)
        return file.resolve()


_NEW = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_BINARY", 0)


def write_file(path: str | Path, content: bytes | memoryview) -> None:
    """Write a whole file, with none of the questions to the system that Python asks about an open file.

    Raises:
        OSError: it cannot be written.
    """
    file = os.open(path, _NEW, 0o666)
    try:
        rest = memoryview(content)
        while rest:
            rest = rest[os.write(file, rest) :]
    finally:
        os.close(file)
