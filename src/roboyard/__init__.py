"""Roboyard: turn any robot description into a robot you can drive.

Importing the package loads nothing heavy: MuJoCo, numba and trimesh are loaded at the first use of a name
that needs them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard import _bootstrap as _bootstrap  # before other modules are imported
from roboyard import _bytecode as _bytecode
from roboyard._lazy import lazy_names
from roboyard._version import __version__
from roboyard.errors import RoboyardError

_MODULES = {
    "Camera": "roboyard.rendering",
    "Robot": "roboyard.robots",
    "RobotDescription": "roboyard.description",
    "RobotModel": "roboyard.description.robot_model",
    "Viewer": "roboyard.viewer",
    "World": "roboyard.sim",
    "add_robot": "roboyard.robots",
    "audit_urdf": "roboyard.audit",
    "import_robot": "roboyard.importer.pipeline",
    "list_robots": "roboyard.robots",
    "load_description": "roboyard.description",
    "load_scene": "roboyard.scenes",
    "repair_urdf": "roboyard.repair",
    "validate": "roboyard.validation",
}
"""Public name to the module that defines or exports it."""

__all__ = [
    "Camera",
    "Robot",
    "RobotDescription",
    "RobotModel",
    "RoboyardError",
    "Viewer",
    "World",
    "__version__",
    "add_robot",
    "audit_urdf",
    "import_robot",
    "list_robots",
    "load_description",
    "load_scene",
    "repair_urdf",
    "validate",
]

if TYPE_CHECKING:
    from roboyard.audit import audit_urdf
    from roboyard.description import RobotDescription, load_description
    from roboyard.description.robot_model import RobotModel
    from roboyard.importer.pipeline import import_robot
    from roboyard.rendering import Camera
    from roboyard.repair import repair_urdf
    from roboyard.robots import Robot, add_robot, list_robots
    from roboyard.scenes import load_scene
    from roboyard.sim import World
    from roboyard.validation import validate
    from roboyard.viewer import Viewer


__getattr__ = lazy_names(__name__, _MODULES)


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted(__all__)
