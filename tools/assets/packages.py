"""Finished packages of the bundled robots that are shipped as vendor files: the results of their import.

A package ships the files that Roboyard reads: the URDF with its meshes, the MJCF (which holds the sensor
frames) and the planner files. The definition beside them is written by hand. `make_assets.py --packages`
writes these files; an import takes about ten seconds, so the plain run does not.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

FOLDERS = ("curobo", "mjcf", "urdf")
"""Folders of a package that are shipped."""


def build() -> dict[str, bytes]:
    """Return every file of every shipped package by its path under the assets folder."""
    from roboyard.assets import SOURCE_CONFIGS

    files: dict[str, bytes] = {}
    for name, config in SOURCE_CONFIGS.items():
        files.update(build_package_files(name, config))
    return files


def build_package_files(name: str, config: str) -> dict[str, bytes]:
    """Import a bundled robot by its configuration (a path under the assets folder) and return its files."""
    from roboyard.assets import asset_path
    from roboyard.importer.pipeline import import_robot

    with tempfile.TemporaryDirectory() as scratch:
        made = import_robot(asset_path(config), out=scratch, validate=False, report=False)
        return {
            f"{name}/{file.relative_to(made.folder).as_posix()}": file.read_bytes()
            for folder in FOLDERS
            for file in sorted((made.folder / folder).rglob("*"))
            if file.is_file()
        }


def is_package_file(path: Path) -> bool:
    """Return whether a path relative to the assets folder belongs to a shipped package."""
    from roboyard.assets import SOURCE_CONFIGS

    return len(path.parts) > 2 and path.parts[0] in SOURCE_CONFIGS and path.parts[1] in FOLDERS
