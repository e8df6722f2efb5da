"""Check a configuration file for `roboyard audit CONFIG.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from roboyard.importer.config.load import load_config


def check_config(file: Path | str, *, packages: Mapping[str, Path] | None = None) -> tuple[str, ...]:
    """Check a configuration without importing; returns its warnings.

    Raises:
        ConfigError: something is wrong; one line for each problem, with file and line.
    """
    return load_config(file, packages=packages).notes
