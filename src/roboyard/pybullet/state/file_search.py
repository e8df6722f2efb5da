"""Finding the files that scripts name."""

from __future__ import annotations

import sys
from functools import lru_cache
from os import F_OK, access, getcwd, pardir
from os.path import expanduser, isabs, isfile, islink, join, normcase, samefile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from roboyard.pybullet.state.file_mounts import FileMounts

_MOST_TARGETS = 256
_FOLDERS_ABOVE = 4
"""Folders from that of a robot's file up below which its meshes are looked for."""
_FOLDERS = tuple(join(*([pardir] * up), "data") for up in range(5))  # noqa: PTH118
"""Where files are looked for beside the working directory: its data folder, and those above."""


class SearchPath:
    """The folder of setAdditionalSearchPath; like Bullet's, it is one for all clients of the process."""

    __slots__ = ("folder", "given")

    def __init__(self) -> None:
        """Search nowhere besides."""
        self.folder: Path | None = None
        self.given: str | None = None
        """The text that a script gave for it."""


OF_PROCESS = SearchPath()


def folders_above(file: Path) -> tuple[Path, ...]:
    """Return the folders above that of a file, the nearest first, where Bullet looks for its meshes, too."""
    above = file.absolute().parents[1:_FOLDERS_ABOVE]
    return tuple(folder for folder in above if folder != folder.parent)


def program_folders() -> tuple[Path, ...]:
    """Return the folders of this program's code and the working directory, without those around all files.

    Robots that it writes into a temporary folder, or keeps beside its code, name meshes there.
    """
    try:
        return _program_folders(getcwd(), tuple(sys.path))  # noqa: PTH109
    except FileNotFoundError:  # the working directory was removed
        return _program_folders("", tuple(sys.path))


@lru_cache(maxsize=8)
def _program_folders(working: str, searched: tuple[str, ...]) -> tuple[Path, ...]:
    home = Path(expanduser("~"))  # noqa: PTH111
    folders = [folder for folder in map(Path, dict.fromkeys((working, *searched))) if folder.is_absolute()]
    return tuple(folder for folder in folders if not home.is_relative_to(folder) and folder.is_dir())


@lru_cache(maxsize=256)
def _candidates(search_path: Path | None, name: str) -> tuple[str, ...]:
    """Return where a file is looked for, in order, kept: to put paths together takes longer than to look."""
    found = dict[str, None]()
    for given in (Path(name), *([Path(f"{search_path}/{name}")] if search_path else [])):
        place = str(given)
        relative = place.removeprefix(given.anchor) or "."
        found |= dict.fromkeys((place, relative, *(join(folder, relative) for folder in _FOLDERS)))  # noqa: PTH118
    return tuple(found)


def find_file(search_path: Path | None, name: str, mounts: FileMounts | None = None) -> Path | None:
    """Return the absolute path of a file that a script names, or None.

    Searched in order: the working directory, the data folders nearby, then the same with the search path in
    front of the name. Like Bullet, which puts these folders in front of any name, also of an absolute one
    that does not exist. Of a link it is the file that this leads to, beside which its meshes are.

    Args:
        search_path: folder of setAdditionalSearchPath.
        name: file name as the script gives it.
        mounts: mounts of the fileIOPlugin, searched last.
    """
    try:
        for place in _candidates(search_path, name):
            if access(place, F_OK) and isfile(place):  # noqa: PTH113 - many times as fast as that of the path
                file = _named(place)
                if islink(place):  # noqa: PTH114
                    return _target(place, file)
                return file if isabs(place) else file.absolute()  # noqa: PTH117
    except ValueError:  # no file can have the name
        pass
    if mounts is None:
        return None
    return mounts.find(name) or (mounts.find(str(search_path / name)) if search_path else None)


_TARGETS: dict[str, Path] = {}


def _target(place: str, link: Path) -> Path:
    """Return the file that a link leads to, which takes long to find where it is not the same as before."""
    known = _TARGETS.get(place)
    if known is None or not _is_same_file(place, known):
        _TARGETS[place] = known = link.resolve()
        while len(_TARGETS) > _MOST_TARGETS:
            del _TARGETS[next(iter(_TARGETS))]
    return known


def _is_same_file(one: str, other: Path) -> bool:
    try:
        return samefile(one, other) and not islink(other)  # noqa: PTH114, PTH121
    except OSError:
        return False


def is_as_named(path: Path, name: str) -> bool:
    """Return whether a script named an absolute path itself, not one that the search path led to."""
    named = str(_named(name))
    return normcase(path) == normcase(join(getcwd(), named))  # noqa: PTH109, PTH118 - much faster


@lru_cache(maxsize=256)
def _named(name: str) -> Path:
    return Path(name)


def is_file(path: Path) -> bool:
    """Return whether there is a regular file; False for names that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def not_found_remedy(search_path: Path | None, name: str) -> str:
    """Return where a missing file was searched, and the remedy."""
    searched = f"searched {Path.cwd()}" + (f" and {search_path.absolute()}" if search_path else "")
    from roboyard.pybullet_data.merged import missing_file_remedy

    if search_path:
        advice = missing_file_remedy(name) or "check the name"
    else:
        advice = "give an absolute path, or call setAdditionalSearchPath(pybullet_data.getDataPath()) first"
    return f"no file {name!r}: {searched}; {advice}"
