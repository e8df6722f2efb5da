"""Rotations in 64-bit precision: Euler angles (roll, pitch, yaw about fixed x, y, z; rad) and matrices."""

from __future__ import annotations

from collections.abc import Sequence
from math import asin, atan2, cos, nan, pi, sin

from roboyard.native.fronts import fronted
from roboyard.pybullet.face.errors import failure

Vector = Sequence[float]
_NONE_OF_9 = (nan,) * 9
_PITCH_LIMIT = 0.99999  # sine of the pitch beyond which roll and yaw are not unique


def _of_angles(roll, pitch, yaw):
    """Return the quaternion of three angles (rad)."""
    roll, pitch, yaw = roll / 2.0, pitch / 2.0, yaw / 2.0
    sr, cr, sp, cp, sy, cy = sin(roll), cos(roll), sin(pitch), cos(pitch), sin(yaw), cos(yaw)
    crcp, srsp, srcp, crsp = cr * cp, sr * sp, sr * cp, cr * sp
    return (
        srcp * cy - crsp * sy,
        crsp * cy + srcp * sy,
        crcp * sy - srsp * cy,
        crcp * cy + srsp * sy,
    )


@fronted(_of_angles, "f8:3 -> f8:4", ignored="physicsClientId")
def getQuaternionFromEuler(eulerAngles: Vector, physicsClientId: int = 0) -> tuple[float, ...]:
    """Return the quaternion (x, y, z, w) of roll, pitch and yaw (rad) about the fixed axes x, y, z.

    It is NaN for an infinite angle.

    Raises:
        error: there are not three angles.
    """
    try:
        roll, pitch, yaw = eulerAngles
    except ValueError:
        raise failure(
            "Euler angles need a 3 coordinates [roll, pitch, yaw].", f"got {eulerAngles!r}"
        ) from None
    try:
        return _of_angles(roll, pitch, yaw)
    except ValueError:  # of infinity
        return (nan,) * 4


def _angles_of(x, y, z, w):
    """Return roll, pitch and yaw (rad) of a unit quaternion."""
    sine = -2.0 * (x * z - w * y)
    if sine <= -_PITCH_LIMIT:
        return 0.0, -0.5 * pi, 2.0 * atan2(x, -y)
    if sine >= _PITCH_LIMIT:
        return 0.0, 0.5 * pi, 2.0 * atan2(-x, y)
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    return (
        atan2(2.0 * (y * z + w * x), ww - xx - yy + zz),
        asin(sine),
        atan2(2.0 * (x * y + w * z), ww + xx - yy - zz),
    )


@fronted(_angles_of, "f8:4 -> f8:3", ignored="physicsClientId")
def getEulerFromQuaternion(quaternion: Vector, physicsClientId: int = 0) -> tuple[float, ...]:
    """Return roll, pitch, yaw (rad) of a unit quaternion (x, y, z, w); roll is 0 at pitch ±90 degrees.

    Raises:
        error: there are not four numbers.
    """
    try:
        x, y, z, w = quaternion
    except ValueError:
        raise failure("Quaternion need a 4 components [x,y,z,w].", f"got {quaternion!r}") from None
    return _angles_of(x, y, z, w)


def _matrix_of(x, y, z, w):
    """Return the nine entries, row-major, of the rotation matrix of a quaternion."""
    norm = x * x + y * y + z * z + w * w
    if norm == 0.0:
        return _NONE_OF_9
    s = 2.0 / norm
    xs, ys, zs = x * s, y * s, z * s
    wx, wy, wz = w * xs, w * ys, w * zs
    xx, xy, xz = x * xs, x * ys, x * zs
    yy, yz, zz = y * ys, y * zs, z * zs
    return (
        1.0 - (yy + zz),
        xy - wz,
        xz + wy,
        xy + wz,
        1.0 - (xx + zz),
        yz - wx,
        xz - wy,
        yz + wx,
        1.0 - (xx + yy),
    )


@fronted(_matrix_of, "f8:4 -> f8:9", ignored="physicsClientId")
def getMatrixFromQuaternion(quaternion: Vector, physicsClientId: int = 0) -> tuple[float, ...]:
    """Return the nine entries, row-major, of the rotation matrix of a quaternion; NaN for length 0.

    Raises:
        error: there are not four numbers.
    """
    try:
        x, y, z, w = quaternion
    except (TypeError, ValueError):
        raise failure("Couldn't convert quaternion [x,y,z,w].", f"got {quaternion!r}") from None
    if not type(x) is type(y) is type(z) is type(w) is float:  # integers or NumPy numbers
        x, y, z, w = float(x), float(y), float(z), float(w)
    return _matrix_of(x, y, z, w)
