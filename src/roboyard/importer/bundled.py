"""Bundled robots that come as a vendor ships them: imported once into the data folder, when first asked for.

<data>/.bundled/<version of Roboyard>/...    laid out as a data folder; the registry does not look into it
"""

from __future__ import annotations

from pathlib import Path

from roboyard._version import __version__
from roboyard.assets import asset_path
from roboyard.paths import DEFAULT_DATASET, data_folder, models_folder

SOURCE_CONFIGS = {"r1": "r1/r1_description/urdf/r1_source_config.yaml"}
"""Import configuration of each such robot, in the assets folder."""


def imported_urdf(name: str) -> Path:
    """Where the URDF of such a robot lies once it is imported."""
    return models_folder(_cache(), DEFAULT_DATASET, name) / "urdf" / f"{name}.urdf"


def bundled_urdf(name: str) -> Path | None:
    """The imported URDF of a bundled robot; None for one that is not shipped that way."""
    if name not in SOURCE_CONFIGS:
        return None
    file = imported_urdf(name)
    if not file.is_file():
        from roboyard.importer import build_package

        build_package(asset_path(SOURCE_CONFIGS[name]), data=_cache(), overwrite=True)
    return file


def _cache() -> Path:
    return data_folder() / ".bundled" / __version__
