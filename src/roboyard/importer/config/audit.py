"""What `roboyard audit CONFIG.yaml` asks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from roboyard.importer.config.load import load_config


def check_config(file: Path | str, *, packages: Mapping[str, Path] | None = None) -> tuple[str, ...]:
    """Check a configuration without importing; returns what is odd but usable.

    Raises:
        ConfigError: something is wrong; one line for each problem, with file and line.
    """
    return load_config(file, packages=packages).notes
