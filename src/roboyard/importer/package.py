"""Build a package beside its target folder, and move it in at the end.

    <data>/<dataset>/.import-<name>-<random>/object/    -> <data>/<dataset>/objects/robot/<name>/
    <data>/<dataset>/.import-<name>-<random>/model/     -> <data>/<dataset>/models/<name>/

Until the move nothing of the old import changes. The move itself exchanges folders (one system call each
where the system has it); a mark written before makes the next import finish a move that was cut short. A
lock that the system drops with the process keeps two imports of one name apart.
"""

from __future__ import annotations

import ctypes
import errno
import json
import os
import secrets
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from roboyard.errors import ConfigError
from roboyard.paths import models_folder, objects_folder
from roboyard.untrusted.files import read_file

READY = "ready"
"""File in a build folder whose parts are whole: they may be moved in. It holds the file system's number of
each new part, since a part's place in the build folder holds the old one once the two were exchanged.
"""


@dataclass(frozen=True, kw_only=True, slots=True)
class PackageFolders:
    """Where a robot's package goes."""

    data: Path
    dataset: str
    name: str

    @property
    def root(self) -> Path:
        """Folder of the dataset."""
        return self.data / self.dataset

    @property
    def object(self) -> Path:
        """Folder of the import."""
        return objects_folder(self.data, self.dataset, self.name)

    @property
    def model(self) -> Path:
        """Folder of the registered robot."""
        return models_folder(self.data, self.dataset, self.name)

    def moves(self, build: Path) -> tuple[tuple[Path, Path], ...]:
        """Part of a build folder, and where it goes."""
        return ((build / "object", self.object), (build / "model", self.model))


@contextmanager
def building(place: PackageFolders, *, overwrite: bool) -> Iterator[Path]:
    """A fresh build folder with `object/` and `model/`; what is in them is moved in if the block ends well.

    Raises:
        ConfigError: the robot exists and may not be overwritten, or another import of it is under way.
    """
    made = _missing_folders(place)
    try:
        place.root.mkdir(parents=True, exist_ok=True)
        with _locked(place):
            _finish_cut_short(place)
            if not overwrite:
                _refuse_existing(place)
            # named before it is made, so that an interrupt in between leaves no folder behind
            build = place.root / f".import-{place.name}-{secrets.token_hex(4)}"
            try:
                build.mkdir(mode=0o700)
                (build / "object").mkdir()
                (build / "model").mkdir()
                yield build
                try:
                    _mark_ready(place, build)
                    _move_in(place, build)
                except BaseException:
                    if _marked(build) is not None:
                        _move_in(place, build)  # half moved in is neither the old package nor the new one
                    raise
            finally:
                _clear(build)
    except BaseException:
        for folder in made:
            with suppress(OSError):
                folder.rmdir()  # only where it is empty
        raise


def _missing_folders(place: PackageFolders) -> list[Path]:
    """Folders above the package that do not exist yet, deepest first."""
    parents = [place.object.parent, place.object.parent.parent, place.model.parent, place.root]
    for folder in (place.data, *place.data.parents):
        parents.append(folder)
    return [folder for folder in dict.fromkeys(parents) if not folder.exists()]


def _refuse_existing(place: PackageFolders) -> None:
    for folder in (place.object, place.model):
        if folder.exists():
            raise ConfigError(
                f"robot {place.name!r} exists already in {folder}; "
                "give --overwrite (or overwrite: true), or another name"
            )


# ------------------------------------------------------------------------------------------------- moving in


def _mark_ready(place: PackageFolders, build: Path) -> None:
    numbers = {part.name: part.stat().st_ino for part, _ in place.moves(build)}
    draft = build / f"{READY}.draft"
    with draft.open("w", encoding="utf-8") as stream:
        stream.write(json.dumps(numbers))
        stream.flush()
        os.fsync(stream.fileno())  # the name must not reach the disk before the content
    draft.replace(build / READY)
    _sync_folder(build)


def _sync_folder(folder: Path) -> None:
    """Write a folder's entries to the disk, where the system has that."""
    if sys.platform == "win32":
        return
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _marked(build: Path) -> dict[str, int] | None:
    """The numbers in a mark; None without one. A mark that is empty, cut or of other content is none."""
    try:
        numbers = json.loads(read_file(build / READY, 1 << 16))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(numbers, dict) or set(numbers) != {"object", "model"}:
        return None
    return numbers if all(type(number) is int for number in numbers.values()) else None


def _move_in(place: PackageFolders, build: Path) -> None:
    """Put the parts in their places; what was there goes to the build folder. Done again it goes on."""
    numbers = _marked(build)
    if numbers is None:
        return
    for part, target in place.moves(build):
        if part.exists() and part.stat().st_ino == numbers[part.name]:
            target.parent.mkdir(parents=True, exist_ok=True)
            _put(part, target)
    (build / READY).unlink()


def _put(part: Path, target: Path) -> None:
    if target.exists() and not _exchange(part, target):
        target.rename(part.with_name(f"{part.name}.old"))
    if not target.exists():
        part.rename(target)


def _exchange(a: Path, b: Path) -> bool:
    """Swap two folders in one step; False where the system cannot."""
    if not sys.platform.startswith("linux"):
        return False
    at_cwd, exchange = -100, 2
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError):
        return False
    if rename(at_cwd, os.fsencode(a), at_cwd, os.fsencode(b), exchange) == 0:
        return True
    if ctypes.get_errno() in (errno.ENOSYS, errno.EINVAL, errno.EPERM):
        return False
    raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()), str(b))


def _clear(build: Path) -> None:
    """Remove a build folder, unless it is marked: then the next import has a move to finish."""
    try:
        _remove_unmarked(build)
    except BaseException:  # an interrupt leaves nothing behind either
        _remove_unmarked(build)
        raise


def _remove_unmarked(build: Path) -> None:
    if _marked(build) is None:
        shutil.rmtree(build, ignore_errors=True)


def _finish_cut_short(place: PackageFolders) -> None:
    """Finish the move of an import that was killed in it, and clear away what others left."""
    for build in sorted(place.root.glob(f".import-{place.name}-*")):
        if not _is_build_of(build, place.name):
            continue
        _move_in(place, build)
        shutil.rmtree(build, ignore_errors=True)


def _is_build_of(build: Path, name: str) -> bool:
    """`.import-r1-abc` is r1's; `.import-r1-x-abc` cannot be, as names hold no `-`."""
    rest = build.name.removeprefix(f".import-{name}-")
    return build.is_dir() and not build.is_symlink() and "-" not in rest


# --------------------------------------------------------------------------------------------------- locking


@contextmanager
def _locked(place: PackageFolders) -> Iterator[None]:
    path = place.root / f".import-{place.name}.lock"
    handle = _take_lock(path)
    if handle is None:
        raise ConfigError(
            f"another import of {place.name!r} is under way in {place.root}; wait for it to end"
        )
    try:
        yield
    finally:
        with suppress(OSError):
            path.unlink()
        os.close(handle)


def _take_lock(path: Path) -> int | None:
    """An open, locked file, or None where another process holds it."""
    for _ in range(100):
        handle = os.open(path, os.O_CREAT | os.O_RDWR, 0o600)
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
