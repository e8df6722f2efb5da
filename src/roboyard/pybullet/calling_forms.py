"""Functions with irregular calling forms, which the table of commands cannot describe.

loadURDF takes a pose as vectors or as numbers; setJointMotorControl and renderImage, the oldest functions,
take positional arguments only and always use client 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from roboyard._lazy import lazy_module
from roboyard.pybullet.api.control import KP
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import number, vector3, whole
from roboyard.pybullet.face.direct_calls import DIRECT, START, forget
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import replace_old_motors

matrices = lazy_module("roboyard.pybullet.api.math.camera_matrices")

Vector = Sequence[float]
_POSE_NAMES = ("startPosX", "startPosY", "startPosZ", "startOrnX", "startOrnY", "startOrnZ", "startOrnW")
_IMAGE_FORMS = (2, 4, 7, 8, 11)
_BAD_MOTOR_CALL = "Error parsing arguments in setJointControl."


# ------------------------------------------------------------------------------------------------- loadURDF


def loadURDF(fileName: str, *args: Any, **kwargs: Any) -> int:
    """Load a robot and return its id.

    loadURDF(fileName, basePosition, baseOrientation, useMaximalCoordinates, useFixedBase, flags,
    globalScaling, physicsClientId), or in the old form loadURDF(fileName, x, y, z), optionally followed by a
    quaternion (x, y, z, w).

    Raises:
        error: the file does not exist or cannot be loaded.
        TypeError: the arguments match neither form.
    """
    if args and _is_number(args[0]):
        return _load_from_numbers(fileName, args, kwargs)
    if "startPosX" in kwargs:
        numbers = [kwargs.pop(name) for name in _POSE_NAMES if name in kwargs]
        return _load_from_numbers(fileName, (*args, *numbers), kwargs)
    return _load_urdf(fileName, *args, **kwargs)


def _is_number(value: Any) -> bool:
    return hasattr(value, "__float__") and getattr(value, "ndim", 0) == 0


def _load_from_numbers(file_name: str, numbers: tuple[Any, ...], kwargs: dict[str, Any]) -> int:
    if kwargs or len(numbers) not in (3, 7):
        raise TypeError(
            "loadURDF(fileName, x, y, z) takes three numbers, or seven with a quaternion; "
            f"got {len(numbers)} numbers and the keywords {sorted(kwargs)}"
        )
    return _load_urdf(file_name, numbers[:3], numbers[3:] or (0.0, 0.0, 0.0, 1.0))


def _load_urdf(
    fileName: str,
    basePosition: Vector = (0.0, 0.0, 0.0),
    baseOrientation: Vector = (0.0, 0.0, 0.0, 1.0),
    useMaximalCoordinates: int = -1,
    useFixedBase: int = 0,
    flags: int = 0,
    globalScaling: float = -1.0,
    physicsClientId: int = 0,
) -> int:
    client: Any = CLIENTS[physicsClientId]
    forget()
    return client.loadURDF(
        fileName, basePosition, baseOrientation, useMaximalCoordinates, useFixedBase, flags, globalScaling
    )


# ------------------------------------------------------------------------------------- setJointMotorControl


def setJointMotorControl(*args: Any) -> None:
    """Control a joint of client 0: (body, joint, mode, target[, force[, gain]]), or with all targets.

    With eight arguments they are (body, joint, mode, position, velocity, force, kp, kd). No keywords.

    Raises:
        error: another number of arguments, or an unknown mode.
    """
    _control_joint(CLIENTS[0], *args)


def _control_joint(client: Any, *args: Any) -> None:
    if len(args) not in (4, 5, 6, 8):
        raise failure(_BAD_MOTOR_CALL, f"expected 4, 5, 6 or 8 arguments, got {len(args)}")
    body, joint, mode, target, *limits = args
    if len(args) == 8:
        given = args
    elif mode == c.POSITION_CONTROL:
        given = body, joint, mode, target, 0.0, *limits
    elif mode == c.VELOCITY_CONTROL:
        given = body, joint, mode, 0.0, target, *limits[:1], *((KP, limits[1]) if len(limits) > 1 else ())
    elif mode == c.TORQUE_CONTROL and not limits:
        given = body, joint, mode, 0.0, 0.0, target
    else:
        raise failure(_BAD_MOTOR_CALL, f"control mode {mode!r} does not take {len(args)} arguments")
    command = START.replaced.get("setJointMotorControl2") if client is DIRECT.get(0) else None
    if command is not None:
        command(client, *given)
    else:
        client.setJointMotorControl2(*given)


FIRST_CLIENT: Mapping[str, tuple[Any, int, str]] = {
    "setJointMotorControl": (_control_joint, 8, "setJointMotorControl2")
}
"""Functions that always use client 0: `function(client, *arguments)`, which does it, the largest number of
arguments, and a command that changes the same answers."""
START.later(partial(replace_old_motors, _control_joint, KP), "setJointMotorControl")


# ---------------------------------------------------------------------------------------------- renderImage


def renderImage(*args: Any) -> tuple[Any, ...]:
    """Render an image with client 0; getCameraImage is the current function.

    renderImage(width, height),
    renderImage(width, height, viewMatrix, projectionMatrix),
    renderImage(width, height, cameraPosition, target, up, near, far[, fov in degrees]) or
    renderImage(width, height, target, distance, yaw, pitch, roll, upAxisIndex, near, far, fov).

    Returns:
        The images of getCameraImage.

    Raises:
        error: another number of arguments.
    """
    client: Any = CLIENTS[0]
    if len(args) not in _IMAGE_FORMS:
        raise failure(
            "Invalid number of args passed to renderImage.", f"expected 2, 4, 7, 8 or 11, got {len(args)}"
        )
    width, height = whole(args[0]), whole(args[1])
    view, projection = _camera_matrices(width / max(height, 1), args[2:])
    return client.getCameraImage(width, height, view, projection)


def _camera_matrices(aspect: float, rest: tuple[Any, ...]) -> tuple[Any, Any]:
    if not rest:
        return None, None
    if len(rest) == 2:
        return rest
    if len(rest) == 9:
        target, distance, yaw, pitch, roll, up_axis, near, far, fov = rest
        view = matrices().computeViewMatrixFromYawPitchRoll(target, distance, yaw, pitch, roll, up_axis)
        return view, matrices().computeProjectionMatrixFOV(fov, aspect, near, far)
    message = "Error parsing camera target pos"
    position, target, up = (vector3(value, message) for value in rest[:3])
    view = matrices().computeViewMatrix(position, target, up)
    near, far = number(rest[3]), number(rest[4])
    if len(rest) == 6:
        return view, matrices().computeProjectionMatrixFOV(rest[5], aspect, near, far)
    return view, matrices().computeProjectionMatrix(-aspect, aspect, -1.0, 1.0, near, far)
