"""Roboyard: turn any robot description into a robot you can drive.

Importing the package loads nothing heavy; MuJoCo, numba and trimesh load where they are first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from roboyard._version import __version__
from roboyard.errors import RoboyardError

_HOMES = {
    "Camera": "roboyard.rendering",
    "RobotDescription": "roboyard.description",
    "World": "roboyard.sim",
    "import_robot": "roboyard.importer.pipeline",
    "load_description": "roboyard.description",
}

__all__ = [
    "Camera",
    "RobotDescription",
    "RoboyardError",
    "World",
    "__version__",
    "import_robot",
    "load_description",
]

if TYPE_CHECKING:
    from roboyard.description import RobotDescription, load_description
    from roboyard.importer.pipeline import import_robot
    from roboyard.rendering import Camera
    from roboyard.sim import World


def __getattr__(name: str) -> Any:
    """Load a public name from the room it lives in on first use."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'roboyard' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
