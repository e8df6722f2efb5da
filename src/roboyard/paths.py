"""Folders in which imported robots are stored.

    <data>/<dataset>/objects/robot/<name>/   an imported robot with all its files
    <data>/<dataset>/models/<name>/          a copy with its definition, found by the registry

The layout is that of an OmniGibson data folder, so that each tool finds the other's robots.
"""

from __future__ import annotations

import os
from pathlib import Path

DATA_VARIABLE = "ROBOYARD_DATA"
DEFAULT_DATASET = "omnigibson-robot-assets"


def data_folder(given: Path | str | None = None) -> Path:
    """Return the data folder: `given`, else that of the variable ROBOYARD_DATA, else the user's data folder.

    It may not exist yet.
    """
    if given is not None:
        return Path(given).expanduser()
    named = os.environ.get(DATA_VARIABLE, "")
    if named:
        return Path(named).expanduser()
    from platformdirs import user_data_path

    return user_data_path("roboyard", appauthor=False)


def objects_folder(data: Path, dataset: str, name: str) -> Path:
    """Return the folder of an imported robot."""
    return data / dataset / "objects" / "robot" / name


def models_folder(data: Path, dataset: str, name: str) -> Path:
    """Return the folder of a registered robot."""
    return data / dataset / "models" / name
