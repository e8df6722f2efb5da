"""Files that belong to a robot's description and stand beside it, as an SRDF does."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

MOST_ENTRIES = 2000
"""Most entries of a folder that are looked at."""
MOST_FILES = 100
"""Most files that are returned for a folder."""


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
