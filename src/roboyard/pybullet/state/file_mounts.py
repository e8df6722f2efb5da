"""Folders and zip files in which a client also searches files: the mounts of the fileIOPlugin."""

from __future__ import annotations

import sys
import zlib
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

from roboyard.pybullet.face import constants as c
from roboyard.untrusted.files import check_file, is_inside
from roboyard.untrusted.text import one_line

_MAX_BYTES = 1 << 30
"""Largest archive, packed and unpacked (bytes)."""
_MAX_FILES = 10_000
"""Most files of an archive."""


class FileMounts:
    """The mounts of one client, by slot; slot 0 is the file system without a prefix."""

    def __init__(self) -> None:
        self._slots: dict[int, tuple[int, str]] = {0: (c.PosixFileIO, "")}
        self._unpacked: dict[str, Path] = {}
        self._count = 0
        self._folder: Any = None
        """Temporary folder of unpacked zip files, removed with the client."""

    def add(self, kind: int, place: str) -> int:
        """Mount a prefix of names (PosixFileIO) or a zip file (ZipFileIO) and return its slot, or -1.

        What is mounted already keeps its slot. A zip file is opened only when a file is searched.
        """
        if kind not in (c.PosixFileIO, c.ZipFileIO) or (kind == c.ZipFileIO and not place):
            return -1
        for slot, mount in self._slots.items():
            if slot and mount == (kind, place):
                return slot
        slot = next(i for i in range(len(self._slots) + 1) if i not in self._slots)
        self._slots[slot] = kind, place
        return slot

    def remove(self, slot: int) -> None:
        """Remove a mount; an unknown slot is ignored."""
        _, place = self._slots.pop(slot, (0, ""))
        self._unpacked.pop(place, None)

    def find(self, name: str) -> Path | None:
        """Return a file that a mount has under this name, or None; a zip file is unpacked for it."""
        for slot in sorted(self._slots):
            kind, place = self._slots[slot]
            if slot == 0:
                continue
            if kind == c.ZipFileIO:
                folder = self._unpack(place, name)
                found = folder / name if folder and is_inside(folder / name, (folder,)) else None
            else:
                found = next(
                    (path for path in (Path(place + name), Path(place) / name) if path.is_file()), None
                )
            if found is not None and found.is_file():
                return found.absolute()
        return None

    def close(self) -> None:
        """Remove all mounts and unpacked files."""
        self._slots = {}
        self._unpacked = {}
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None

    def _unpack(self, place: str, name: str) -> Path | None:
        """Return the folder of a zip file's files if it has one of this name."""
        if place in self._unpacked:
            return self._unpacked[place]
        try:
            check_file(place, _MAX_BYTES)
            with ZipFile(place) as packed:
                members = packed.infolist()
                if Path(name).as_posix() not in (member.filename for member in members):
                    return None
                if len(members) > _MAX_FILES or sum(member.file_size for member in members) > _MAX_BYTES:
                    print(
                        f"roboyard: {one_line(place)} holds more than {_MAX_FILES} files or "
                        f"{_MAX_BYTES >> 20} MiB; it is not unpacked",
                        file=sys.stderr,
                    )
                    return None
                from tempfile import TemporaryDirectory

                if self._folder is None:
                    self._folder = TemporaryDirectory(prefix="roboyard-zip-")
                self._count += 1
                target = Path(self._folder.name) / str(self._count)
                packed.extractall(target)
        except (OSError, BadZipFile, NotImplementedError, RuntimeError, ValueError, zlib.error):
            return None  # damaged, encrypted or of an unknown method
        self._unpacked[place] = target
        return target
