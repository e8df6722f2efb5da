"""Result of a writer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True, slots=True)
class ExportResult:
    """Files that were written and what could not be said in them."""

    files: tuple[Path, ...]
    """The main file first."""
    notes: tuple[str, ...] = ()
    """One line for each part of the robot that is skipped or approximated."""
