"""View and projection matrices: 16 numbers, column-major, in OpenGL's convention and 32-bit precision.

Each function has a core of plain numbers, which is also compiled in front of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import copysign, cos, inf, isfinite, nan, pi, sin, sqrt, tan
from struct import Struct, error

from roboyard.native.fronts import fronted
from roboyard.pybullet.face.arguments import number
from roboyard.pybullet.face.errors import failure

Vector = Sequence[float]
Numbers = tuple[float, ...]
_NONE_OF_16 = (nan,) * 16
_SIXTEEN = Struct("16f")


def _look_at(ex, ey, ez, tx, ty, tz, ux, uy, uz):
    """Return the view matrix from eye, target and up vector."""
    fx, fy, fz = _unit(tx - ex, ty - ey, tz - ez)
    ux, uy, uz = _unit(ux, uy, uz)
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
    return _rounded(*_look_at(*(number for vector in vectors for number in _three(vector, message))))


def _look_from(tx, ty, tz, distance, yaw, pitch, roll, axis):
    """Return the view matrix of a camera that orbits a target; NaN about another axis than 1 and 2."""
    if axis != 1.0 and axis != 2.0:
        return _NONE_OF_16
    bx, by, bz, ux, uy, uz = _orbit(yaw, pitch, roll, axis)
    return _look_at(tx - distance * bx, ty - distance * by, tz - distance * bz, tx, ty, tz, ux, uy, uz)


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
    return _rounded(*_look_from(x, y, z, distance, yaw, pitch, roll, upAxisIndex))


def _frustum(left, right, bottom, top, near, far):
    """Return the projection matrix of a frustum."""
    width, height, depth = right - left, top - bottom, far - near
    twice = 2.0 * near
    return (
        *(_ratio(twice, width), 0.0, 0.0, 0.0),
        *(0.0, _ratio(twice, height), 0.0, 0.0),
        *(_ratio(right + left, width), _ratio(top + bottom, height), -_ratio(far + near, depth), -1.0),
        *(0.0, 0.0, -_ratio(twice * far, depth), 0.0),
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
    return _rounded(*_frustum(left, right, bottom, top, nearVal, farVal))


def _cone(fov, aspect, near, far):
    """Return the projection matrix of a field of view (degrees)."""
    scale = _ratio(1.0, tan(fov * pi / 360.0)) if isfinite(fov) else nan
    depth = near - far
    return (
        *(_ratio(scale, aspect), 0.0, 0.0, 0.0),
        *(0.0, scale, 0.0, 0.0),
        *(0.0, 0.0, _ratio(near + far, depth), -1.0),
        *(0.0, 0.0, _ratio(2.0 * far * near, depth), 0.0),
    )


@fronted(_cone, "f8 f8 f8 f8 -> f4:16", ignored="physicsClientId")
def computeProjectionMatrixFOV(
    fov: float, aspect: float, nearVal: float, farVal: float, physicsClientId: int = 0
) -> Numbers:
    """Return the projection matrix of a vertical field of view (degrees) and aspect = width / height.

    It is NaN for an angle that is not finite.
    """
    return _rounded(*_cone(fov, aspect, nearVal, farVal))


def orbit(
    target: Vector, distance: float, yaw: float, pitch: float, roll: float, up_axis: int
) -> tuple[Numbers, Numbers]:
    """Return eye (m) and up vector of a camera at `distance` (m) from the target, angles in degrees.

    Both are NaN for an angle that is not finite.
    """
    numbers = _orbit(yaw, pitch, roll, up_axis)
    return tuple(t - distance * b for t, b in zip(target, numbers[:3], strict=True)), numbers[3:]


def _three(vector: Vector, message: str) -> Numbers:
    try:
        x, y, z = vector
    except (TypeError, ValueError):
        raise failure(message, f"expected three numbers, got {vector!r}") from None
    return number(x), number(y), number(z)


def _rounded(*numbers: float) -> Numbers:
    try:
        return _SIXTEEN.unpack(_SIXTEEN.pack(*numbers))
    except error as problem:
        raise TypeError(f"expected numbers, got {numbers}: {problem}") from None
    except OverflowError:
        return tuple(n if abs(n) < 3.4e38 else copysign(inf, n) for n in numbers)


def _ratio(a, b):
    """Return a / b, infinite for b = 0."""
    if b != 0.0:
        return a / b
    return copysign(inf, a) if a != 0.0 else nan


def _unit(x, y, z):
    """Return a vector with length 1, NaN for length 0."""
    length = sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return nan, nan, nan
    return x / length, y / length, z / length


def _orbit(yaw, pitch, roll, axis):
    """Return the direction from the target to the eye and the up vector, from angles in degrees."""
    y = yaw * pi / 180.0 if isfinite(yaw) else nan
    p = pitch * pi / 180.0 if isfinite(pitch) else nan
    r = roll * pi / 180.0 if isfinite(roll) else nan
    if axis == 1:
        p, r, y = -p, y, r
    # The rotation by p, r, y about the fixed axes x, y, z
    sr, cr, sp, cp, sy, cy = sin(p), cos(p), sin(r), cos(r), sin(y), cos(y)
    second = (sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, sr * cp)
    third = (cr * sp * cy + sr * sy, cr * sp * sy - sr * cy, cr * cp)
    back, up = (third, second) if axis == 1 else (second, third)
    return (*back, *up)
