"""All public functions by name, created from the table of commands and the free functions."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import roboyard.pybullet.calling_forms as calling_forms
import roboyard.pybullet.connections as connections
from roboyard.pybullet.api.math import camera_matrices, rotations, transforms
from roboyard.pybullet.client import install_commands
from roboyard.pybullet.face.calling import builtin, public
from roboyard.pybullet.face.commands import COMMANDS

_TOPICS = (
    "articulated",
    "bodies",
    "camera",
    "shapes.collision_shapes",
    "constraints",
    "contact_points",
    "control",
    "debug",
    "dynamics",
    "filters",
    "forces",
    "inverse_kinematics",
    "joints",
    "links",
    "loading",
    "logs",
    "shapes.meshes",
    "shapes.multibody",
    "parameters",
    "raycasts",
    "saved_files",
    "stepping",
    "shapes.textures",
    "plugins",
    "soft_bodies",
    "user_data",
    "shapes.visual_shapes",
    "virtual_reality",
    "visualizer",
)

FREE_FUNCTIONS: tuple[Callable[..., Any], ...] = (
    connections.connect,
    connections.disconnect,
    connections.getAPIVersion,
    connections.getConnectionInfo,
    connections.isConnected,
    connections.isNumpyEnabled,
    calling_forms.setJointMotorControl,
    calling_forms.loadURDF,
    calling_forms.renderImage,
    camera_matrices.computeProjectionMatrix,
    camera_matrices.computeProjectionMatrixFOV,
    camera_matrices.computeViewMatrix,
    camera_matrices.computeViewMatrixFromYawPitchRoll,
    rotations.getEulerFromQuaternion,
    rotations.getMatrixFromQuaternion,
    rotations.getQuaternionFromEuler,
    transforms.calculateVelocityQuaternion,
    transforms.getAxisAngleFromQuaternion,
    transforms.getAxisDifferenceQuaternion,
    transforms.getDifferenceQuaternion,
    transforms.getQuaternionFromAxisAngle,
    transforms.getQuaternionSlerp,
    transforms.invertTransform,
    transforms.multiplyTransforms,
    transforms.rotateVector,
)
"""Functions with their own `physicsClientId`: mathematics, connections and irregular calling forms."""


def public_functions() -> dict[str, Callable[..., Any]]:
    """Return every function of the API as a built-in, by name."""
    for topic in _TOPICS:
        import_module(
            f"roboyard.pybullet.api.{topic}" if "state" not in topic else f"roboyard.pybullet.{topic}"
        )
    install_commands()
    found: dict[str, Any] = {function.__name__: function for function in FREE_FUNCTIONS}
    for name, entry in COMMANDS.items():
        if entry.is_public:
            found[name] = public(entry.function, connections.CLIENTS, entry.aliases, __name__)
            globals()[name] = found[name]
    return {name: builtin(found[name]) for name in sorted(found)}
