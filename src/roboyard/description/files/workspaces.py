"""ROS packages as `rospack` and `colcon` find them: folders with a `package.xml` anywhere below another."""

from __future__ import annotations

import os
import re
from collections import deque
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from roboyard.untrusted.files import read_file

MAX_DEPTH = 6
"""Levels below the root that are searched."""
MAX_FOLDERS = 20_000
"""Folders searched at most."""
_IGNORED = ("CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE", "rospack_nosubdirs")
_WORKSPACE_MARKS = ("devel", "install", "build", "log", ".catkin_tools", ".rosinstall")


def package_name(folder: Path) -> str | None:
    """Return the name in a folder's `package.xml`; None without one."""
    file = folder / "package.xml"
    try:
        head = read_file(file, 1 << 20).decode("utf-8", "replace")
    except OSError:
        return None
    match = re.search(r"<name>([^<]*)</name>", head)
    return match[1].strip() if match else None


@lru_cache(maxsize=64)
def packages_below(root: Path) -> dict[str, Path]:
    """Return packages below `root` by name, the one nearest to it where two share a name.

    A package is a folder with a `package.xml`; packages, hidden folders and folders with an
    ignore file are not searched. Symbolic links are not followed.
    """
    found: dict[str, Path] = {}
    todo = deque([(root, 0)])
    for _ in range(MAX_FOLDERS):
        if not todo:
            break
        folder, depth = todo.popleft()
        try:
            with os.scandir(folder) as listing:
                entries = list(listing)
        except OSError:
            continue
        names = {entry.name for entry in entries}
        if names.intersection(_IGNORED):
            continue
        if "package.xml" in names:
            for name in filter(None, (package_name(folder), folder.name)):
                found.setdefault(name, folder)
            continue
        if depth < MAX_DEPTH:
            below = sorted(e.name for e in entries if _is_plain_folder(e))
            todo.extend((folder / name, depth + 1) for name in below)
    return found


def package_folders(above: Sequence[Path]) -> tuple[Path, ...]:
    """Return folders that may hold packages at any depth, nearest first: `src`, `share` and `install` ones.

    Args:
        above: the description's folder and those above it, nearest first.
    """
    called = [folder for folder in above if folder.name in ("src", "share", "install")]
    return tuple(dict.fromkeys((*called, *workspace_sources(above))))


def workspace_sources(above: Sequence[Path]) -> tuple[Path, ...]:
    """Return the `src` of each workspace that holds the description, found by the build folders beside it.

    Installed packages are often links to files in there. A `src` that is a link counts as none, since a
    robot's archive could lead it anywhere. `above` is as for `package_folders`.
    """
    roots = [folder for folder in above if any(_exists(folder / mark) for mark in _WORKSPACE_MARKS)]
    return tuple(folder / "src" for folder in roots if _is_real_folder(folder / "src"))


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:
        return False


def _is_real_folder(path: Path) -> bool:
    """True for a folder that is no link and, links above it resolved, stands in its parent."""
    try:
        return path.is_dir() and not path.is_symlink() and path.resolve().parent == path.parent.resolve()
    except (OSError, RuntimeError):
        return False


def _is_plain_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return not entry.name.startswith(".") and entry.is_dir(follow_symlinks=False)
    except OSError:
        return False
