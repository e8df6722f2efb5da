"""View and projection matrices: 16 numbers, column-major, in OpenGL's convention and 32-bit precision."""

from __future__ import annotations

from collections.abc import Sequence
from math import copysign, cos, inf, isfinite, nan, pi, sin, sqrt, tan
from struct import Struct, error

from roboyard.pybullet.face.arguments import number
from roboyard.pybullet.face.errors import failure

Vector = Sequence[float]
Numbers = tuple[float, ...]
_SIXTEEN = Struct("16f")


def computeViewMatrix(
    cameraEyePosition: Vector, cameraTargetPosition: Vector, cameraUpVector: Vector, physicsClientId: int = 0
) -> Numbers:
    """Return the view matrix of a camera from eye and target position (m) and up vector.

    Raises:
        error: a vector does not have three numbers.
    """
    message = "Error in computeViewMatrix."
    return look_at(
        _three(cameraEyePosition, message),
        _three(cameraTargetPosition, message),
        _three(cameraUpVector, message),
    )


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
    target = _three(cameraTargetPosition, "Cannot convert cameraTargetPosition.")
    if upAxisIndex not in (1, 2):
        raise failure(
            "Error in computeViewMatrix.", f"upAxisIndex must be 1 (y) or 2 (z), got {upAxisIndex!r}"
        )
    eye, up = orbit(target, distance, yaw, pitch, roll, upAxisIndex)
    return look_at(eye, target, up)


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
    width, height, depth = right - left, top - bottom, farVal - nearVal
    near = 2.0 * nearVal
    return _rounded(
        *(_ratio(near, width), 0.0, 0.0, 0.0),
        *(0.0, _ratio(near, height), 0.0, 0.0),
        *(_ratio(right + left, width), _ratio(top + bottom, height), -_ratio(farVal + nearVal, depth), -1.0),
        *(0.0, 0.0, -_ratio(near * farVal, depth), 0.0),
    )


def computeProjectionMatrixFOV(
    fov: float, aspect: float, nearVal: float, farVal: float, physicsClientId: int = 0
) -> Numbers:
    """Return the projection matrix of a vertical field of view (degrees) and aspect = width / height.

    It is NaN for an angle that is not finite.
    """
    scale = _ratio(1.0, tan(fov * pi / 360.0)) if isfinite(fov) else nan
    depth = nearVal - farVal
    return _rounded(
        *(_ratio(scale, aspect), 0.0, 0.0, 0.0),
        *(0.0, scale, 0.0, 0.0),
        *(0.0, 0.0, _ratio(nearVal + farVal, depth), -1.0),
        *(0.0, 0.0, _ratio(2.0 * farVal * nearVal, depth), 0.0),
    )


def orbit(
    target: Vector, distance: float, yaw: float, pitch: float, roll: float, up_axis: int
) -> tuple[Numbers, Numbers]:
    """Return eye (m) and up vector of a camera at `distance` (m) from the target, angles in degrees.

    Both are NaN for an angle that is not finite.
    """
    y, p, r = (angle * pi / 180.0 if isfinite(angle) else nan for angle in (yaw, pitch, roll))
    if up_axis == 1:
        columns = _euler_matrix(-p, y, r)
        back, up = columns[2], columns[1]
    else:
        columns = _euler_matrix(p, r, y)
        back, up = columns[1], columns[2]
    return tuple(t - distance * b for t, b in zip(target, back, strict=True)), up


def look_at(eye: Vector, target: Vector, up: Vector) -> Numbers:
    """Return the view matrix in 32-bit numbers; NaN if eye and target coincide or `up` is along the view."""
    f = _unit([t - e for t, e in zip(target, eye, strict=True)])
    s = _unit(_cross(f, _unit(up)))
    u = _cross(s, f)
    return _rounded(
        *(s[0], u[0], -f[0], 0.0),
        *(s[1], u[1], -f[1], 0.0),
        *(s[2], u[2], -f[2], 0.0),
        *(-_dot(s, eye), -_dot(u, eye), _dot(f, eye), 1.0),
    )


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


def _ratio(a: float, b: float) -> float:
    """Return a / b, infinite for b = 0."""
    if b:
        return a / b
    return copysign(inf, a) if a else nan


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Numbers:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(vector: Vector) -> Numbers:
    x, y, z = vector
    length = sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length) if length else (nan, nan, nan)


def _euler_matrix(roll: float, pitch: float, yaw: float) -> tuple[Numbers, Numbers, Numbers]:
    """Return the columns of the rotation by roll, pitch, yaw (rad) about the fixed axes x, y, z."""
    sr, cr, sp, cp, sy, cy = sin(roll), cos(roll), sin(pitch), cos(pitch), sin(yaw), cos(yaw)
    return (
        (cp * cy, cp * sy, -sp),
        (sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, sr * cp),
        (cr * sp * cy + sr * sy, cr * sp * sy - sr * cy, cr * cp),
    )
