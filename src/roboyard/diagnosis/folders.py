"""Whether robots and compiled loops can be stored."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import roboyard.shapes
from roboyard.diagnosis.check import Check
from roboyard.paths import DATA_VARIABLE, data_folder

LEAST_FREE = 1_000_000_000
"""Free space below which a large import may not fit (bytes)."""


def folder_checks() -> Iterator[Check]:
    """Yield the data folder, its free space, and the folder of compiled loops."""
    data = data_folder()
    nearest = next(folder for folder in (data, *data.parents) if folder.exists())
    writable = os.access(nearest, os.W_OK)
    yield Check(
        name="data folder",
        status="ok" if writable else "failed",
        detail=f"{data}{'' if data.exists() else ' (made by the first import)'}"
        f"{'' if writable else ' cannot be written'}",
        remedy="" if writable else f"set {DATA_VARIABLE} to a folder that can be written",
    )
    free = shutil.disk_usage(nearest).free
    yield Check(
        name="free space",
        status="ok" if free >= LEAST_FREE else "slow",
        detail=f"{free / 1e9:.1f} GB",
        remedy="" if free >= LEAST_FREE else "make space, or move the data folder",
    )
    yield _compiled()


def _compiled() -> Check:
    """Return whether loops are compiled once or in every process."""
    from platformdirs import user_cache_path

    beside = Path(roboyard.shapes.__file__).parent
    others = [Path(named) for named in [os.environ.get("NUMBA_CACHE_DIR", "")] if named]
    places = [*others, beside, user_cache_path("roboyard", appauthor=False)]
    for place in places:
        nearest = next(folder for folder in (place, *place.parents) if folder.exists())
        if os.access(nearest, os.W_OK):
            return Check(name="compiled loops", status="ok", detail=f"stored in {place}")
    return Check(
        name="compiled loops",
        status="slow",
        detail="no folder to store them can be written: they are compiled in every process",
        remedy="set NUMBA_CACHE_DIR to a folder that can be written",
    )
