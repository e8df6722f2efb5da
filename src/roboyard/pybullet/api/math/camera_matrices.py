"""View and projection matrices: 16 numbers, column-major, in OpenGL's convention and 32-bit precision.

Each function has a core of plain numbers, which is also compiled in front of it. It rounds where PyBullet
does, so that the numbers are the same to the last bit; where angles are given in degrees, one rounding of a
sine or a cosine in two hundred differs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import copysign, cos, inf, isfinite, nan, pi, sin, tan
from struct import Struct, error
from typing import Any

import numpy as np

from roboyard.native.fronts import fronted
from roboyard.pybullet.face.arguments import number
from roboyard.pybullet.face.errors import failure

Vector = Sequence[float]
Numbers = tuple[float, ...]
_NONE_OF_16 = (nan,) * 16
_SIXTEEN = Struct("16f")
_ONE, _TWO, _HALF = np.float32(1.0), np.float32(2.0), np.float32(0.5)
_PI, _RADIANS = np.float32(pi), np.float32(pi / 180.0)


def _look_at(ex, ey, ez, tx, ty, tz, ux, uy, uz):
    """Return the view matrix from eye, target and up vector."""
    ex, ey, ez = np.float32(ex), np.float32(ey), np.float32(ez)
    tx, ty, tz = np.float32(tx), np.float32(ty), np.float32(tz)
    fx, fy, fz = _unit(tx - ex, ty - ey, tz - ez)
    ux, uy, uz = _unit(np.float32(ux), np.float32(uy), np.float32(uz))
    sx, sy, sz = _unit(fy * uz - fz * uy, fz * ux - fx * uz, fx * uy - fy * ux)
    ux, uy, uz = sy * fz - sz * fy, sz * fx - sx * fz, sx * fy - sy * fx
    return (
        *(sx, ux, -fx, 0.0),
        *(sy, uy, -fy, 0.0),
        *(sz, uz, -fz, 0.0),
        -(sx * ex + sy * ey + sz * ez),
        -(ux * ex + uy * ey + uz * ez),
        fx * ex + fy * ey + fz * ez,
        1.0,
    )


@fronted(_look_at, "f8:3 f8:3 f8:3 -> f4:16", ignored="physicsClientId")
def computeViewMatrix(
    cameraEyePosition: Vector, cameraTargetPosition: Vector, cameraUpVector: Vector, physicsClientId: int = 0
) -> Numbers:
    """Return the view matrix of a camera from eye and target position (m) and up vector.

    Raises:
        error: a vector does not have three numbers.
    """
    message = "Error in computeViewMatrix."
    vectors = (cameraEyePosition, cameraTargetPosition, cameraUpVector)
    return _rounded(_look_at, *(number for vector in vectors for number in _three(vector, message)))


def _look_from(tx, ty, tz, distance, yaw, pitch, roll, axis):
    """Return the view matrix of a camera that orbits a target; NaN about another axis than 1 and 2."""
    if axis != 1.0 and axis != 2.0:
        return _NONE_OF_16
    bx, by, bz, ux, uy, uz = _orbit(distance, yaw, pitch, roll, axis)
    ex, ey, ez = bx + np.float32(tx), by + np.float32(ty), bz + np.float32(tz)
    return _look_at(ex, ey, ez, tx, ty, tz, ux, uy, uz)


@fronted(_look_from, "f8:3 f8 f8 f8 f8 f8 -> f4:16", ignored="physicsClientId")
def computeViewMatrixFromYawPitchRoll(
    cameraTargetPosition: Vector,
    distance: float,
    yaw: float,
    pitch: float,
    roll: float,
    upAxisIndex: int,
    physicsClientId: int = 0,
) -> Numbers:
    """Return the view matrix of a camera that orbits a target.

    Args:
        cameraTargetPosition: target (m).
        distance: from the eye to the target (m).
        yaw: rotation about the up axis (degrees).
        pitch: elevation (degrees); negative looks down.
        roll: rotation about the viewing direction (degrees).
        upAxisIndex: 1 for y, 2 for z.

    Raises:
        error: the target does not have three numbers, or the axis is unknown.
    """
    x, y, z = _three(cameraTargetPosition, "Cannot convert cameraTargetPosition.")
    if upAxisIndex not in (1, 2):
        raise failure(
            "Error in computeViewMatrix.", f"upAxisIndex must be 1 (y) or 2 (z), got {upAxisIndex!r}"
        )
    return _rounded(_look_from, x, y, z, distance, yaw, pitch, roll, upAxisIndex)


def _frustum(left, right, bottom, top, near, far):
    """Return the projection matrix of a frustum."""
    left, right, near = np.float32(left), np.float32(right), np.float32(near)
    bottom, top, far = np.float32(bottom), np.float32(top), np.float32(far)
    width, height, depth = right - left, top - bottom, far - near
    twice = _TWO * near
    return (
        *(_ratio(twice, width), 0.0, 0.0, 0.0),
        *(0.0, _ratio(twice, height), 0.0, 0.0),
        *(_ratio(right + left, width), _ratio(top + bottom, height), _ratio(-(far + near), depth), -1.0),
        *(0.0, 0.0, _ratio(-(_TWO * far * near), depth), 0.0),
    )


@fronted(_frustum, "f8 f8 f8 f8 f8 f8 -> f4:16", ignored="physicsClientId")
def computeProjectionMatrix(
    left: float,
    right: float,
    bottom: float,
    top: float,
    nearVal: float,
    farVal: float,
    physicsClientId: int = 0,
) -> Numbers:
    """Return the projection matrix of a frustum with the near rectangle left, right, bottom, top (m)."""
    return _rounded(_frustum, left, right, bottom, top, nearVal, farVal)


def _cone(fov, aspect, near, far):
    """Return the projection matrix of a field of view (degrees)."""
    near, far = np.float32(near), np.float32(far)
    angle = np.float64(_PI) / 180.0 * np.float64(np.float32(fov)) / 2.0
    slope = np.float64(tan(angle)) if isfinite(angle) else nan
    scale = np.float32(1.0 / slope if slope != 0.0 else copysign(inf, slope))
    depth = near - far
    return (
        *(_ratio(scale, np.float32(aspect)), 0.0, 0.0, 0.0),
        *(0.0, scale, 0.0, 0.0),
        *(0.0, 0.0, _ratio(near + far, depth), -1.0),
        *(0.0, 0.0, _ratio(_TWO * far * near, depth), 0.0),
    )


@fronted(_cone, "f8 f8 f8 f8 -> f4:16", ignored="physicsClientId")
def computeProjectionMatrixFOV(
    fov: float, aspect: float, nearVal: float, farVal: float, physicsClientId: int = 0
) -> Numbers:
    """Return the projection matrix of a vertical field of view (degrees) and aspect = width / height.

    It is NaN for an angle that is not finite.
    """
    return _rounded(_cone, fov, aspect, nearVal, farVal)


def orbit(
    target: Vector, distance: float, yaw: float, pitch: float, roll: float, up_axis: int
) -> tuple[Numbers, Numbers]:
    """Return eye (m) and up vector of a camera at `distance` (m) from the target, angles in degrees.

    Both are NaN for an angle that is not finite.
    """
    with np.errstate(all="ignore"):
        numbers = tuple(map(float, _orbit(distance, yaw, pitch, roll, up_axis)))
    return tuple(t + b for t, b in zip(target, numbers[:3], strict=True)), numbers[3:]


def _three(vector: Vector, message: str) -> Numbers:
    try:
        x, y, z = vector
    except (TypeError, ValueError):
        raise failure(message, f"expected three numbers, got {vector!r}") from None
    return number(x), number(y), number(z)


def _rounded(core: Callable[..., tuple[Any, ...]], *numbers: float) -> Numbers:
    try:
        with np.errstate(all="ignore"):
            return _SIXTEEN.unpack(_SIXTEEN.pack(*core(*numbers)))
    except (error, TypeError, ValueError) as problem:
        raise TypeError(f"expected numbers, got {numbers}: {problem}") from None


def _ratio(a, b):
    """Return a / b, infinite for b = 0."""
    if b != 0.0:
        return a / b
    if a != 0.0:
        return np.float32(copysign(inf, a) * copysign(1.0, b))
    return np.float32(nan)


def _unit(x, y, z):
    """Return a vector with length 1, NaN for length 0."""
    length = np.sqrt(x * x + y * y + z * z)
    scale = _ratio(_ONE, length)
    return x * scale, y * scale, z * scale


def _circle(angle):
    """Return sine and cosine of an angle (rad), NaN for one that is not finite."""
    if not isfinite(angle):
        return np.float32(nan), np.float32(nan)
    return np.float32(sin(np.float64(angle))), np.float32(cos(np.float64(angle)))


def _orbit(distance, yaw, pitch, roll, axis):
    """Return the vector from the target to the eye (m) and the up vector, from angles in degrees."""
    y, p = np.float32(yaw) * _RADIANS, np.float32(pitch) * _RADIANS
    r = np.float32(roll) * _RADIANS
    if axis == 1:
        p, r, y = -p, y, r
    # The quaternion of the rotation by p, r, y about the fixed axes x, y, z, and two columns of its matrix
    (sx, cx), (sy, cy), (sz, cz) = _circle(p * _HALF), _circle(r * _HALF), _circle(y * _HALF)
    i, j = sx * cy * cz - cx * sy * sz, cx * sy * cz + sx * cy * sz
    k, w = cx * cy * sz - sx * sy * cz, cx * cy * cz + sx * sy * sz
    scale = _ratio(_ONE, np.sqrt(i * i + j * j + k * k + w * w))
    i, j, k, w = i * scale, j * scale, k * scale, w * scale
    twice = _ratio(_TWO, i * i + j * j + k * k + w * w)
    xs, ys, zs = i * twice, j * twice, k * twice
    rows = (
        (_ONE - (j * ys + k * zs), i * ys - w * zs, i * zs + w * ys),
        (i * ys + w * zs, _ONE - (i * xs + k * zs), j * zs - w * xs),
        (i * zs - w * ys, j * zs + w * xs, _ONE - (i * xs + j * ys)),
    )
    back, none = -np.float32(distance), np.float32(0.0)
    if axis == 1:
        return *_applied(rows, none, none, back), *_applied(rows, none, _ONE, none)
    return *_applied(rows, none, back, none), *_applied(rows, none, none, _ONE)


def _applied(rows, x, y, z):
    """Return a matrix times a vector."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
