"""The visualizer: camera, switches, and keyboard and mouse events (none without a window)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from math import hypot, pi, tan
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.api.math.camera_matrices import (
    computeProjectionMatrixFOV,
    computeViewMatrixFromYawPitchRoll,
)
from roboyard.pybullet.bullet_rules.single_precision import rounded
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import Vector3, number, vector3, vector3_or, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.fast.fast_commands import replace_settings
from roboyard.pybullet.state.frames import cross
from roboyard.pybullet.state.visualizer_camera import FIELD_OF_VIEW, WINDOW_METHODS

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

_NEAR, _FAR = 0.01, 1000.0  # m
_RAY_LENGTH = 10000.0  # m: length of the window's ray vectors
_UNSET, _ORIGIN = -1, (0.0, 0.0, 0.0)
_NO_MATRIX = (0.0,) * 16
_NO_CAMERA = (
    *(0, 0, _NO_MATRIX, _NO_MATRIX, _ORIGIN, _ORIGIN, _ORIGIN, _ORIGIN),
    *(0.0, 0.0, 0.0, _ORIGIN),
)
"""The camera of a client without a window."""


@command()
def getDebugVisualizerCamera(client: Client) -> tuple[Any, ...]:
    """Return the visualizer's camera.

    Returns:
        Width, height (pixels), view matrix, projection matrix, up vector, forward vector, horizontal and
        vertical extent of the far image plane (m), yaw, pitch (degrees), distance and target (m). All are 0
        without a window, as in PyBullet.
    """
    if client.method not in WINDOW_METHODS:
        return _NO_CAMERA
    camera = client.visualizer
    return _described(
        *(camera.width, camera.height, camera.up_axis),
        *(camera.yaw, camera.pitch, camera.distance, camera.target),
    )


@lru_cache(maxsize=16)
def _described(
    pixels: int, lines: int, up_axis: int, yaw: float, pitch: float, distance: float, target: Vector3
) -> tuple[Any, ...]:
    """Return the fields of getDebugVisualizerCamera."""
    view = computeViewMatrixFromYawPitchRoll(target, distance, yaw, pitch, 0.0, up_axis)
    aspect = pixels / lines
    projection = computeProjectionMatrixFOV(FIELD_OF_VIEW, aspect, _NEAR, _FAR)
    height = 2.0 * _RAY_LENGTH * tan(FIELD_OF_VIEW * pi / 360.0)
    width = height * aspect
    up = (0.0, 1.0, 0.0) if up_axis == 1 else (0.0, 0.0, 1.0)
    forward = (-view[2], -view[6], -view[10])
    across = cross(forward, up)
    length = hypot(*across) or 1.0
    horizontal = rounded(*(width * value / length for value in across))
    vertical = rounded(*(height * value / length for value in cross(across, forward)))
    return (
        *(pixels, lines, view, projection, up, forward, horizontal, vertical),
        *(yaw, pitch, distance, target),
    )


@command()
def resetDebugVisualizerCamera(
    client: Client,
    cameraDistance: float,
    cameraYaw: float,
    cameraPitch: float,
    cameraTargetPosition: Sequence[float],
) -> None:
    """Set the visualizer's camera: distance (m), yaw and pitch (degrees) and target (m).

    Raises:
        error: the target does not have three numbers.
    """
    camera = client.visualizer
    camera.distance, camera.yaw, camera.pitch = rounded(cameraDistance, cameraYaw, cameraPitch)
    target = vector3_or(cameraTargetPosition, camera.target)
    x, y, z = rounded(*target)
    camera.target = (x, y, z)


@command()
def configureDebugVisualizer(
    client: Client,
    flag: int = _UNSET,
    enable: int = -1,
    lightPosition: Sequence[float] | None = None,
    shadowMapResolution: int = _UNSET,
    shadowMapWorldSize: int = _UNSET,
    remoteSyncTransformInterval: float = -1.0,
    shadowMapIntensity: float = -1.0,
    rgbBackground: Sequence[float] | None = None,
) -> None:
    """Enable or disable a feature of the visualizer (flag: COV_...), or set its light and background.

    Raises:
        error: a vector does not have three numbers.
    """
    camera = client.visualizer
    if flag is not _UNSET and whole(flag) >= 0:
        camera.switches[flag] = whole(enable)
        if flag == c.COV_ENABLE_Y_AXIS_UP:
            camera.up_axis = 1 if enable else 2
    if shadowMapResolution is not _UNSET and whole(shadowMapResolution) >= 0:
        camera.settings["shadowMapResolution"] = shadowMapResolution
    if shadowMapWorldSize is not _UNSET and whole(shadowMapWorldSize) >= 0:
        camera.settings["shadowMapWorldSize"] = shadowMapWorldSize
    if remoteSyncTransformInterval != -1.0 and number(remoteSyncTransformInterval) >= 0:
        camera.settings["remoteSyncTransformInterval"] = remoteSyncTransformInterval
    if shadowMapIntensity != -1.0 and number(shadowMapIntensity) >= 0:
        camera.settings["shadowMapIntensity"] = shadowMapIntensity
    if lightPosition is not None:
        camera.settings["lightPosition"] = vector3_or(lightPosition, _ORIGIN)
    if rgbBackground is not None:
        camera.settings["rgbBackground"] = vector3(rgbBackground, "Error converting rgbBackground[3]")


@command()
def getKeyboardEvents(client: Client) -> dict[int, int]:
    """Return key codes with their KEY_... bits (down, triggered, released) since the last call.

    Without a window there are no events.
    """
    return client.keyboard.take()


@command()
def getMouseEvents(client: Client) -> tuple[tuple[Any, ...], ...]:
    """Return the mouse events in the visualizer since the last call; none without a window.

    Returns:
        For each event its type (1: moved, 2: a button), x and y (pixels from the upper left), the button (0
        left, 1 middle, 2 right, -1 none) and its KEY_... bits.
    """
    return client.mouse.take()


for _name in ("configureDebugVisualizer", "resetDebugVisualizerCamera"):
    START.later(partial(replace_settings, _name), _name)
