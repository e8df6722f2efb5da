"""A drop-in for `pybullet_data`: the folder of bundled robots and scenes, and an installed original."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from roboyard.pybullet_data.merged import installed_data, merged_folder


@lru_cache(maxsize=1)
def getDataPath() -> str:
    """Return the folder of PyBullet's files, to join paths with or for `setAdditionalSearchPath`.

    Where the package `pybullet` is installed, the folder also holds each file of its `pybullet_data` that
    Roboyard has no equal of. Otherwise Roboyard's own stand-ins are there, under the names that scripts use.
    """
    ours, installed = Path(__file__).resolve().parents[1] / "assets", installed_data()
    return str(ours if installed is None else merged_folder(ours, installed))
