"""The importer: a vendor's URDF (and a configuration) in, a robot package out.

`roboyard.import_robot` is what users call: it builds the package here, tries the robot out and
reports.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

_HOMES = {
    "ImportResult": "roboyard.importer.build",
    "RobotModel": "roboyard.description.robot_model",
    "audit_config": "roboyard.importer.config.load",
    "build_package": "roboyard.importer.build",
    "load_config": "roboyard.importer.config.load",
}

__all__ = ["ImportResult", "RobotModel", "audit_config", "build_package", "load_config"]

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel
    from roboyard.importer.build import ImportResult, build_package
    from roboyard.importer.config.load import audit_config, load_config


def __getattr__(name: str) -> Any:
    """Load a public name on first use: writers read `model` without the whole importer."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'roboyard.importer' has no attribute {name!r}")
