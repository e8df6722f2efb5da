"""Transforms, slerp and quaternion differences, which PyBullet computes with 32-bit floats.

Arguments and results are rounded to 32 bits, the arithmetic has 64, so that results agree with PyBullet's to
its own rounding error (1e-7), including its special cases. Each function has a core of plain numbers, which
is also compiled in front of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, asin, atan2, cos, isfinite, nan, pi, sin, sqrt
from struct import Struct, error

import numpy as np

from roboyard.native.fronts import fronted
from roboyard.pybullet.bullet_rules.single_precision import rounded
from roboyard.pybullet.face.errors import failure

Vector = Sequence[float]
Numbers = tuple[float, ...]
_EPSILON = 1.1920929e-07  # of a 32-bit float
_BAD_PAIR = "Require start and end quaternion, each with 4 components [x,y,z,w]."
_SEVEN, _EIGHT = Struct("7f"), Struct("8f")
_PACK, _UNPACK = _SEVEN.pack, _SEVEN.unpack
_POSES = Struct("14f")
_PACK_POSES, _UNPACK_POSES = _POSES.pack, _POSES.unpack
_NONE_OF_3, _NONE_OF_4, _NONE_OF_7 = (nan,) * 3, (nan,) * 4, (nan,) * 7


def _joined(message: str, *vectors_and_lengths: tuple[Vector, int]) -> Numbers:
    """Return all vectors in one flat 32-bit tuple; `message` is the text of the error for a wrong length."""
    flat: list[float] = []
    for vector, length in vectors_and_lengths:
        try:
            part = tuple(vector)
        except TypeError:
            raise failure(message) from None
        if len(part) != length:
            raise failure(message)
        flat += part
    return rounded(*flat)


def _pair(message: str, first: Vector, second: Vector, pack: Struct, length: int) -> Numbers:
    """Return two vectors, the first of this length, in one flat 32-bit tuple."""
    try:
        if len(first) == length:
            return pack.unpack(pack.pack(*first, *second))
    except (error, TypeError, OverflowError):
        pass
    return _joined(message, (first, length), (second, pack.size // 4 - length))


def _single(x):
    """Return a number rounded to 32 bits; infinite if it is too large."""
    return float(np.float32(x))


def _sign(x, y, z, w, length):
    """Return the length with the sign of the number that `canonical` makes positive."""
    leading = x
    if 4.0 * w * w > length * length:
        leading = w
    else:
        if abs(y) > abs(leading):
            leading = y
        if abs(z) > abs(leading):
            leading = z
    return -length if leading < 0.0 else length


def _moved(x, y, z, ax, ay, az, aw, vx, vy, vz, bx, by, bz, bw):
    """Return position and quaternion of a pose times another, both a position and a quaternion."""
    qx = aw * bx + ax * bw + ay * bz - az * by
    qy = aw * by - ax * bz + ay * bw + az * bx
    qz = aw * bz + ax * by - ay * bx + az * bw
    qw = aw * bw - ax * bx - ay * by - az * bz
    norm = ax * ax + ay * ay + az * az + aw * aw
    length = sqrt(qx * qx + qy * qy + qz * qz + qw * qw)
    if norm == 0.0:
        return _NONE_OF_7
    length = _sign(qx, qy, qz, qw, length) if length != 0.0 else nan
    s = 2.0 / norm  # as `_turned`
    cx, cy, cz = s * (ay * vz - az * vy), s * (az * vx - ax * vz), s * (ax * vy - ay * vx)
    return (
        x + (vx + aw * cx + ay * cz - az * cy),
        y + (vy + aw * cy + az * cx - ax * cz),
        z + (vz + aw * cz + ax * cy - ay * cx),
        qx / length,
        qy / length,
        qz / length,
        qw / length,
    )


@fronted(_moved, "f4:3 f4:4 f4:3 f4:4 -> f4:3 f4:4", ignored="physicsClientId")
def multiplyTransforms(
    positionA: Vector, orientationA: Vector, positionB: Vector, orientationB: Vector, physicsClientId: int = 0
) -> tuple[Numbers, Numbers]:
    """Return position (m) and quaternion of the product A · B: pose B in frame A, expressed in A's parent.

    Raises:
        error: a vector has the wrong length.
    """
    try:
        if not len(positionA) == len(positionB) == 3 == len(orientationA) - 1:
            raise TypeError
        given = _UNPACK_POSES(_PACK_POSES(*positionA, *orientationA, *positionB, *orientationB))
    except (error, TypeError, OverflowError):
        message = (
            "Invalid input: expected positionA [x,y,z], orientationA [x,y,z,w], positionB, orientationB."
        )
        given = _joined(message, (positionA, 3), (orientationA, 4))
        given += _joined(message, (positionB, 3), (orientationB, 4))
    return _pose(_moved(*given))


def _pose(numbers: Numbers) -> tuple[Numbers, Numbers]:
    """Return position and quaternion in 32 bits."""
    try:
        out = _UNPACK(_PACK(*numbers))
    except OverflowError:
        out = _NONE_OF_7
    return out[:3], out[3:]


def _inverse(vx, vy, vz, x, y, z, w):
    """Return position and quaternion of the inverse of a pose."""
    x, y, z = -x, -y, -z
    norm = x * x + y * y + z * z + w * w
    if norm == 0.0:
        return _NONE_OF_7
    length = _sign(x, y, z, w, sqrt(norm))
    s = 2.0 / norm  # as `_turned`
    cx, cy, cz = s * (y * vz - z * vy), s * (z * vx - x * vz), s * (x * vy - y * vx)
    return (
        -(vx + w * cx + y * cz - z * cy),
        -(vy + w * cy + z * cx - x * cz),
        -(vz + w * cz + x * cy - y * cx),
        x / length,
        y / length,
        z / length,
        w / length,
    )


@fronted(_inverse, "f4:3 f4:4 -> f4:3 f4:4", ignored="physicsClientId")
def invertTransform(
    position: Vector, orientation: Vector, physicsClientId: int = 0
) -> tuple[Numbers, Numbers]:
    """Return position (m) and quaternion of the inverse of a pose.

    Raises:
        error: a vector has the wrong length.
    """
    try:
        if len(position) != 3:
            raise TypeError
        given = _UNPACK(_PACK(*position, *orientation))
    except (error, TypeError, OverflowError):
        message = "Invalid input: expected position [x,y,z] and orientation [x,y,z,w]."
        given = _joined(message, (position, 3), (orientation, 4))
    return _pose(_inverse(*given))


def _scaled_turn(x, y, z, w, vx, vy, vz):
    """Return a vector rotated by a quaternion, times the quaternion's squared length."""
    norm = x * x + y * y + z * z + w * w
    vx, vy, vz = _turned(x, y, z, w, vx, vy, vz)
    return norm * vx, norm * vy, norm * vz


@fronted(_scaled_turn, "f4:4 f4:3 -> f4:3", ignored="physicsClientId")
def rotateVector(quaternion: Vector, vector: Vector, physicsClientId: int = 0) -> Numbers:
    """Return `vector` rotated by a quaternion, times the quaternion's squared length.

    Raises:
        error: a vector has the wrong length.
    """
    message = "Require quaternion with 4 components [x,y,z,w] and a vector [x,y,z]."
    return rounded(*_scaled_turn(*_pair(message, quaternion, vector, _SEVEN, 4)))


def _between(ax, ay, az, aw, bx, by, bz, bw, t):
    """Return the spherical interpolation of two quaternions at the fraction t."""
    dot = ax * bx + ay * by + az * bz + aw * bw
    length = sqrt((ax * ax + ay * ay + az * az + aw * aw) * (bx * bx + by * by + bz * bz + bw * bw))
    if length == 0.0:
        return _NONE_OF_4
    cosine = _single(dot / length)
    if abs(cosine) >= 1.0:
        return ax, ay, az, aw
    sign = -1.0 if cosine < 0.0 else 1.0
    theta = acos(sign * cosine)
    s0, s1, d = sin((1.0 - t) * theta), sin(sign * t * theta), 1.0 / sin(theta)
    s0, s1 = s0 * d, s1 * d
    return ax * s0 + bx * s1, ay * s0 + by * s1, az * s0 + bz * s1, aw * s0 + bw * s1


@fronted(_between, "f4:4 f4:4 f4 -> f4:4", ignored="physicsClientId")
def getQuaternionSlerp(
    quaternionStart: Vector, quaternionEnd: Vector, interpolationFraction: float, physicsClientId: int = 0
) -> Numbers:
    """Return the spherical interpolation on the shorter arc: the start at fraction 0, the end at 1.

    Raises:
        error: a quaternion does not have four numbers.
    """
    both = _pair(_BAD_PAIR, quaternionStart, quaternionEnd, _EIGHT, 4)
    return rounded(*_between(*both, *rounded(interpolationFraction)))


def _about(x, y, z, angle):
    """Return the quaternion of an angle (rad) about an axis of any length."""
    half = angle * 0.5 if isfinite(angle) else nan
    length = sqrt(x * x + y * y + z * z)
    if length < _EPSILON:
        x, y, z, length = 1.0, 0.0, 0.0, 1.0
    s = sin(half) / length
    return x * s, y * s, z * s, cos(half)


@fronted(_about, "f4:3 f4 -> f4:4", ignored="physicsClientId")
def getQuaternionFromAxisAngle(axis: Vector, angle: float, physicsClientId: int = 0) -> Numbers:
    """Return the quaternion of a rotation by `angle` (rad) about an axis of any length; x for length 0.

    It is NaN for an infinite angle.

    Raises:
        error: the axis does not have three numbers.
    """
    given = _joined("Require axis [x,y,z] and angle.", (axis, 3))
    return rounded(*_about(*given, *rounded(angle)))


def _axis_and_angle(x, y, z, w):
    """Return axis and angle (rad) of a unit quaternion."""
    angle = 2.0 * acos(min(1.0, max(-1.0, w)))
    squared = 1.0 - w * w
    if squared < 10.0 * _EPSILON:
        return 1.0, 0.0, 0.0, angle
    s = 1.0 / sqrt(squared)
    return x * s, y * s, z * s, angle


@fronted(_axis_and_angle, "f4:4 -> f4:3 f4", ignored="physicsClientId")
def getAxisAngleFromQuaternion(quaternion: Vector, physicsClientId: int = 0) -> tuple[Numbers, float]:
    """Return axis and angle (0 to 2 pi rad) of a unit quaternion; axis x for the identity.

    Raises:
        error: there are not four numbers.
    """
    given = _joined("Require a quaternion with 4 components [x,y,z,w].", (quaternion, 4))
    out = rounded(*_axis_and_angle(*given))
    return out[:3], out[3]


def _difference(x, y, z, w, bx, by, bz, bw):
    """Return end · start⁻¹, with the sign of the end that is closer to the start."""
    if x * bx + y * by + z * bz + w * bw <= 0.0:
        bx, by, bz, bw = -bx, -by, -bz, -bw
    return _product(bx, by, bz, bw, -x, -y, -z, w)


@fronted(_difference, "f4:4 f4:4 -> f4:4", ignored="physicsClientId")
def getDifferenceQuaternion(
    quaternionStart: Vector, quaternionEnd: Vector, physicsClientId: int = 0
) -> Numbers:
    """Return the rotation from the start to the end, on the shorter arc.

    Raises:
        error: a quaternion does not have four numbers.
    """
    return rounded(*_difference(*_pair(_BAD_PAIR, quaternionStart, quaternionEnd, _EIGHT, 4)))


def _rate(ax, ay, az, aw, bx, by, bz, bw, dt):
    """Return the angular velocity (rad/s) that rotates a quaternion to another within dt (s)."""
    if ax == bx and ay == by and az == bz and aw == bw:
        return 0.0, 0.0, 0.0
    x, y, z, w = _difference(ax, ay, az, aw, bx, by, bz, bw)
    x, y, z, w = _single(x), _single(y), _single(z), _single(w)
    length = sqrt(x * x + y * y + z * z)
    if length < _EPSILON:
        x, y, z, length = 1.0, 0.0, 0.0, 1.0
    angle = 2.0 * acos(min(1.0, max(-1.0, w)))
    rate = angle / (length * dt) if dt != 0.0 else nan
    return x * rate, y * rate, z * rate


@fronted(_rate, "f4:4 f4:4 f4 -> f4:3", ignored="physicsClientId")
def calculateVelocityQuaternion(
    quaternionStart: Vector, quaternionEnd: Vector, deltaTime: float, physicsClientId: int = 0
) -> Numbers:
    """Return the angular velocity (rad/s) that rotates the start to the end within `deltaTime` (s).

    Raises:
        error: a quaternion does not have four numbers.
    """
    both = _pair(_BAD_PAIR, quaternionStart, quaternionEnd, _EIGHT, 4)
    return rounded(*_rate(*both, *rounded(deltaTime)))


def _turn_about_axes(ax, ay, az, aw, x, y, z, w):
    """Return the angles (rad) about rotating axes x, y, z of a quaternion relative to another."""
    x, y, z, w = _product(-x, -y, -z, w, ax, ay, az, aw)
    norm = x * x + y * y + z * z + w * w
    if norm == 0.0:
        return _NONE_OF_3
    s = 2.0 / norm
    sine = s * x * z + s * w * y
    m3, m4 = s * x * y + s * w * z, 1.0 - s * x * x - s * z * z
    if sine >= 1.0:
        return atan2(m3, m4), pi / 2, 0.0
    if sine <= -1.0:
        return -atan2(m3, m4), -pi / 2, 0.0
    m0, m1 = 1.0 - s * y * y - s * z * z, s * x * y - s * w * z
    m5, m8 = s * y * z - s * w * x, 1.0 - s * x * x - s * y * y
    return atan2(-m5, m8), asin(sine), atan2(-m1, m0)


@fronted(_turn_about_axes, "f4:4 f4:4 -> f4:3", ignored="physicsClientId")
def getAxisDifferenceQuaternion(
    quaternionStart: Vector, quaternionEnd: Vector, physicsClientId: int = 0
) -> Numbers:
    """Return the angles (rad) about rotating axes x, y, z of the start relative to the end.

    Raises:
        error: a quaternion does not have four numbers.
    """
    return rounded(*_turn_about_axes(*_pair(_BAD_PAIR, quaternionStart, quaternionEnd, _EIGHT, 4)))


def _product(ax, ay, az, aw, bx, by, bz, bw):
    """Return the Hamilton product: rotation `b`, then `a`."""
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def _turned(x, y, z, w, vx, vy, vz):
    """Return a vector rotated by a quaternion of any length; NaN for length 0."""
    norm = x * x + y * y + z * z + w * w
    if norm == 0.0:
        return _NONE_OF_3
    s = 2.0 / norm
    cx, cy, cz = s * (y * vz - z * vy), s * (z * vx - x * vz), s * (x * vy - y * vx)
    return (
        vx + w * cx + y * cz - z * cy,
        vy + w * cy + z * cx - x * cz,
        vz + w * cz + x * cy - y * cx,
    )
