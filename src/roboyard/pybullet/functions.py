"""All public functions by name, each created on first use from the table of commands or a free function."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from typing import Any

from roboyard._lazy import paused_collection
from roboyard._libraries import stored_libraries
from roboyard._numpy import load_numpy
from roboyard.pybullet.face.calling import builtin, counted, kept, of_first_client, public, refusing
from roboyard.pybullet.face.commands import COMMANDS

_FREE: Mapping[str, tuple[str, ...]] = {
    "connections": (
        "connect",
        "disconnect",
        "getAPIVersion",
        "getConnectionInfo",
        "isConnected",
        "isNumpyEnabled",
    ),
    "calling_forms": ("setJointMotorControl", "loadURDF", "renderImage"),
    "api.math.camera_matrices": (
        "computeProjectionMatrix",
        "computeProjectionMatrixFOV",
        "computeViewMatrix",
        "computeViewMatrixFromYawPitchRoll",
    ),
    "api.math.rotations": ("getEulerFromQuaternion", "getMatrixFromQuaternion", "getQuaternionFromEuler"),
    "api.math.transforms": (
        "calculateVelocityQuaternion",
        "getAxisAngleFromQuaternion",
        "getAxisDifferenceQuaternion",
        "getDifferenceQuaternion",
        "getQuaternionFromAxisAngle",
        "getQuaternionSlerp",
        "invertTransform",
        "multiplyTransforms",
        "rotateVector",
    ),
}
"""Functions with their own `physicsClientId`: mathematics, connections and irregular calling forms."""

_REFUSING = frozenset(("connect", "disconnect", *_FREE["calling_forms"]))
"""Those of them that the world may refuse."""

PRELOADED = (
    "roboyard.pybullet.connections",
    "roboyard.pybullet.calling_forms",
    "roboyard.pybullet.state.physics_scene",
    "roboyard.pybullet.api.loading",
    "roboyard.pybullet.api.bodies",
    "roboyard.pybullet.api.joints",
    "roboyard.pybullet.api.control",
    "roboyard.pybullet.api.stepping",
    "roboyard.pybullet.api.parameters",
)
"""Modules that almost every program with a client needs, imported together."""

_KEPT = frozenset(("getAPIVersion", "isConnected", "isNumpyEnabled"))
"""Those of them that return the same for each client in this process."""

_FIRST_CLIENT = frozenset(("setJointMotorControl",))
"""Those of them that have a command of client 0, without keywords."""

_FREE_HOMES = {name: f"roboyard.pybullet.{module}" for module, names in _FREE.items() for name in names}

NAMES = tuple(sorted({*COMMANDS, *_FREE_HOMES}))
"""Names of all functions of the API."""


@cache
def public_function(name: str) -> Callable[..., Any]:
    """Return a function of the API as a built-in.

    Raises:
        AttributeError: the API has no function of this name.
    """
    function: Any
    if name in _FREE_HOMES:
        with _quick_imports():
            function = getattr(import_module(_FREE_HOMES[name]), name)
            if name == "connect":
                for needed in PRELOADED:
                    import_module(needed)
        if name in _REFUSING:
            function = refusing(function)
        if name in _FIRST_CLIENT:
            from roboyard.pybullet.calling_forms import FIRST_CLIENT

            function = of_first_client(function, *FIRST_CLIENT[name])
        if name in _KEPT:
            function = kept(function, 1 if name == "isConnected" else function())
        if hasattr(function, "front"):
            function = counted(function)
        function.__module__ = __name__  # pickled by this module, whose attributes make the built-in, too
    elif name in COMMANDS:
        with _quick_imports():
            from roboyard.pybullet.connections import CLIENTS

        entry = COMMANDS[name]
        function = public(entry.function, CLIENTS, entry.aliases, __name__)
    else:
        raise AttributeError(f"module 'roboyard.pybullet' has no attribute {name!r}")
    globals()[name] = function
    return builtin(function)


@contextmanager
def _quick_imports() -> Iterator[None]:
    """Import as `roboyard run` does: libraries by stored bytecode, NumPy without what few programs need."""
    with paused_collection(), stored_libraries():
        load_numpy()
        yield


def __getattr__(name: str) -> Any:
    """Return the Python function of a built-in; built-ins are pickled through it."""
    public_function(name)
    return globals()[name]
