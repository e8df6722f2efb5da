"""Folders in which imported robots are stored.

    <data>/<dataset>/objects/robot/<name>/   an imported robot with all its files
    <data>/<dataset>/models/<name>/          a copy with its definition, found by the registry

The layout is that of an OmniGibson data folder, so that each tool finds the other's robots.
"""

from __future__ import annotations

import os
import sys
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


def writable_data_folder(given: Path | str | None = None) -> Path:
    """Return the data folder for writing.

    As `data_folder`; where nothing is named and the user's data folder cannot be made, as in containers,
    it is `roboyard-data` in the working folder, and a line says so.
    """
    folder = data_folder(given)
    if given is not None or os.environ.get(DATA_VARIABLE, ""):
        return folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
        reason = "it is read-only"
    except OSError as error:
        reason = error.strerror or str(error)
    here = Path("roboyard-data").absolute()
    if sys.stderr is not None:
        print(
            f"roboyard: the data folder {folder} cannot be written ({reason}), so {here} is used; "
            f"set {DATA_VARIABLE}={here} to find it again",
            file=sys.stderr,
        )
    return here


def objects_folder(data: Path, dataset: str, name: str) -> Path:
    """Return the folder of an imported robot."""
    return data / dataset / "objects" / "robot" / name


def models_folder(data: Path, dataset: str, name: str) -> Path:
    """Return the folder of a registered robot."""
    return data / dataset / "models" / name
