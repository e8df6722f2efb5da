"""Files beside a robot's description: those that belong to it, and those named nearly like missing ones."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

MOST_ENTRIES = 2000
"""Most entries of a folder that are looked at."""
MOST_FILES = 100
"""Most files that are returned for a folder."""
_NO_MESHES = (".mtl", ".bin", ".png", ".jpg", ".jpeg", ".txt", ".md")
"""Endings of files beside meshes that share their names."""


def matching_files(folder: Path, pattern: str) -> list[Path]:
    """Return the files of a folder that match a pattern, by name; empty where it cannot be read."""
    try:
        entries = sorted(entry for entry in islice(folder.iterdir(), MOST_ENTRIES) if entry.match(pattern))
        return [entry for entry in entries if entry.is_file()][:MOST_FILES]
    except OSError:
        return []


def moveit_configurations(package: Path) -> list[Path]:
    """Return `config/` of the MoveIt configuration packages beside a package, by name."""
    try:
        beside = sorted(
            entry
            for entry in islice(package.parent.iterdir(), MOST_ENTRIES)
            if "moveit" in entry.name.lower() and (entry / "package.xml").is_file()
        )
        return [entry / "config" for entry in beside if (entry / "config").is_dir()]
    except OSError:
        return []


def nearest_name(folder: Path, name: str) -> str | None:
    """Return the file of a folder whose name is most like a missing one's; None where none is alike.

    A material or picture is like another one alone.
    """
    ending = Path(name).suffix.lower()
    others = {kind for kind in _NO_MESHES if kind != ending}
    try:
        entries = [entry for entry in islice(folder.iterdir(), MOST_ENTRIES) if entry.is_file()]
        names = {entry.name.lower(): entry.name for entry in entries if entry.suffix.lower() not in others}
    except OSError:
        return None
    from difflib import SequenceMatcher, get_close_matches

    found = get_close_matches(name.lower(), list(names), n=1, cutoff=0.75)
    if not found or SequenceMatcher(None, Path(found[0]).stem, Path(name.lower()).stem).ratio() < 0.7:
        return None
    return names[found[0]]
