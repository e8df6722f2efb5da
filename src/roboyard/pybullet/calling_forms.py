"""renderImage, the old way to take a picture, in its five calling forms."""

from __future__ import annotations

from typing import Any

from roboyard.pybullet.api.math.camera_matrices import (
    computeProjectionMatrix,
    computeProjectionMatrixFOV,
    computeViewMatrix,
    computeViewMatrixFromYawPitchRoll,
)
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face.arguments import number, vector3, whole
from roboyard.pybullet.face.errors import failure

_FORMS = (2, 4, 7, 8, 11)


def renderImage(*args: Any) -> tuple[Any, ...]:
    """Take a picture with client 0; getCameraImage is the way today.

    renderImage(width, height),
    renderImage(width, height, viewMatrix, projectionMatrix),
    renderImage(width, height, cameraPosition, target, up, near, far[, fov in degrees]) or
    renderImage(width, height, target, distance, yaw, pitch, roll, upAxisIndex, near, far, fov).
    """
    client: Any = CLIENTS[0]
    if len(args) not in _FORMS:
        raise failure(
            "Invalid number of args passed to renderImage.", f"got {len(args)}; 2, 4, 7, 8 or 11 are taken"
        )
    width, height = whole(args[0]), whole(args[1])
    view, projection = _matrices(width / max(height, 1), args[2:])
    return client.getCameraImage(width, height, view, projection)


def _matrices(aspect: float, rest: tuple[Any, ...]) -> tuple[Any, Any]:
    if not rest:
        return None, None
    if len(rest) == 2:
        return rest
    if len(rest) == 9:
        target, distance, yaw, pitch, roll, up_axis, near, far, fov = rest
        view = computeViewMatrixFromYawPitchRoll(target, distance, yaw, pitch, roll, up_axis)
        return view, computeProjectionMatrixFOV(fov, aspect, near, far)
    message = "Error parsing camera target pos"
    position, target, up = (vector3(value, message) for value in rest[:3])
    view = computeViewMatrix(position, target, up)
    near, far = number(rest[3]), number(rest[4])
    if len(rest) == 6:
        return view, computeProjectionMatrixFOV(rest[5], aspect, near, far)
    return view, computeProjectionMatrix(-aspect, aspect, -1.0, 1.0, near, far)
