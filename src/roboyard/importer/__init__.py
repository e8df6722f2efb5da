"""The importer: a vendor's URDF (and a configuration) in, a robot package out.

`roboyard.import_robot` is what users call: it builds the package here, tries the robot out and
reports.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

_HOMES = {
    "ImportResult": "roboyard.importer.run",
    "ImportedRobot": "roboyard.importer.model",
    "audit_config": "roboyard.importer.config_file",
    "build_package": "roboyard.importer.run",
    "load_config": "roboyard.importer.config_file",
}

__all__ = ["ImportResult", "ImportedRobot", "audit_config", "build_package", "load_config"]

if TYPE_CHECKING:
    from roboyard.importer.config_file import audit_config, load_config
    from roboyard.importer.model import ImportedRobot
    from roboyard.importer.run import ImportResult, build_package


def __getattr__(name: str) -> Any:
    """Load a public name on first use: writers read `model` without the whole importer."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'roboyard.importer' has no attribute {name!r}")
