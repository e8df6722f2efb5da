"""Data that the steps of an import share beside the robot."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from roboyard.description.urdf.parse import UrdfElements
from roboyard.importer.config.schema import ImportConfig
from roboyard.importer.import_log import ImportLog
from roboyard.importer.machine_paths import portable_texts


@dataclass(frozen=True, kw_only=True, slots=True)
class ImportContext:
    """Configuration, source, folder and log of one import."""

    config: ImportConfig
    urdf: Path
    """The vendor's file."""
    source: UrdfElements
    """The vendor's file, parsed."""
    build: Path
    """Folder in which the package is built; `build/urdf` holds the description and its meshes."""
    log: ImportLog
    has_config: bool = True
    """False where everything is a default because the user gave only a URDF."""
    packages: Mapping[str, Path] = field(default_factory=dict)
    workers: int = 2
    started: float = field(default_factory=time.monotonic)
    """`time.monotonic()` at the beginning."""

    @property
    def urdf_folder(self) -> Path:
        """Folder of the new URDF and its meshes."""
        return self.build / "urdf"

    @property
    def portable(self) -> Callable[[Any], Any]:
        """Function of texts and plain data for files of the package: it takes the machine's folders out."""
        return portable_texts(self.urdf, self.build, self.packages)
