"""Transforms, slerp and quaternion differences, which PyBullet computes with 32-bit floats.

Arguments and results are rounded to 32 bits, the arithmetic has 64, so that results agree with PyBullet's to
its own rounding error (1e-7), including its special cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, asin, atan2, cos, isfinite, nan, pi, sin, sqrt
from struct import Struct, error

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
        x, y, z, ax, ay, az, aw, vx, vy, vz, bx, by, bz, bw = _UNPACK_POSES(
            _PACK_POSES(*positionA, *orientationA, *positionB, *orientationB)
        )
    except (error, TypeError, OverflowError):
        message = (
            "Invalid input: expected positionA [x,y,z], orientationA [x,y,z,w], positionB, orientationB."
        )
        x, y, z, ax, ay, az, aw = _joined(message, (positionA, 3), (orientationA, 4))
        vx, vy, vz, bx, by, bz, bw = _joined(message, (positionB, 3), (orientationB, 4))
    qx = aw * bx + ax * bw + ay * bz - az * by
    qy = aw * by - ax * bz + ay * bw + az * bx
    qz = aw * bz + ax * by - ay * bx + az * bw
    qw = aw * bw - ax * bx - ay * by - az * bz
    norm = ax * ax + ay * ay + az * az + aw * aw
    length = sqrt(qx * qx + qy * qy + qz * qz + qw * qw)
    if norm == 0.0:
        return (nan,) * 3, (nan,) * 4
    if length == 0.0:
        length = nan
    elif (qw if 4.0 * qw * qw > length * length else max(qx, qy, qz, key=abs)) < 0.0:
        length = -length  # as `canonical`
    s = 2.0 / norm  # as `_turned`
    cx, cy, cz = s * (ay * vz - az * vy), s * (az * vx - ax * vz), s * (ax * vy - ay * vx)
    vx = vx + aw * cx + ay * cz - az * cy
    vy = vy + aw * cy + az * cx - ax * cz
    vz = vz + aw * cz + ax * cy - ay * cx
    try:
        out = _UNPACK(_PACK(x + vx, y + vy, z + vz, qx / length, qy / length, qz / length, qw / length))
    except OverflowError:
        out = (nan,) * 7
    return out[:3], out[3:]


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
        vx, vy, vz, x, y, z, w = _UNPACK(_PACK(*position, *orientation))
    except (error, TypeError, OverflowError):
        message = "Invalid input: expected position [x,y,z] and orientation [x,y,z,w]."
        vx, vy, vz, x, y, z, w = _joined(message, (position, 3), (orientation, 4))
    x, y, z = -x, -y, -z
    norm = x * x + y * y + z * z + w * w
    if norm == 0.0:
        return (nan,) * 3, (nan,) * 4
    length = sqrt(norm)
    if (w if 4.0 * w * w > length * length else max(x, y, z, key=abs)) < 0.0:
        length = -length  # as `canonical`
    s = 2.0 / norm  # as `_turned`
    cx, cy, cz = s * (y * vz - z * vy), s * (z * vx - x * vz), s * (x * vy - y * vx)
    vx = vx + w * cx + y * cz - z * cy
    vy = vy + w * cy + z * cx - x * cz
    vz = vz + w * cz + x * cy - y * cx
    try:
        out = _UNPACK(_PACK(-vx, -vy, -vz, x / length, y / length, z / length, w / length))
    except OverflowError:
        out = (nan,) * 7
    return out[:3], out[3:]


def rotateVector(quaternion: Vector, vector: Vector, physicsClientId: int = 0) -> Numbers:
    """Return `vector` rotated by a quaternion, times the quaternion's squared length.

    Raises:
        error: a vector has the wrong length.
    """
    message = "Require quaternion with 4 components [x,y,z,w] and a vector [x,y,z]."
    x, y, z, w, vx, vy, vz = _pair(message, quaternion, vector, _SEVEN, 4)
    norm = x * x + y * y + z * z + w * w
    vx, vy, vz = _turned(x, y, z, w, vx, vy, vz)
    return rounded(norm * vx, norm * vy, norm * vz)


def getQuaternionSlerp(
    quaternionStart: Vector, quaternionEnd: Vector, interpolationFraction: float, physicsClientId: int = 0
) -> Numbers:
    """Return the spherical interpolation on the shorter arc: the start at fraction 0, the end at 1.

    Raises:
        error: a quaternion does not have four numbers.
    """
    both = _pair(_BAD_PAIR, quaternionStart, quaternionEnd, _EIGHT, 4)
    (t,) = rounded(interpolationFraction)
    a, b = both[:4], both[4:]
    length = sqrt(_dot(a, a) * _dot(b, b))
    if length == 0.0:
        return (nan,) * 4
    (cosine,) = rounded(_dot(a, b) / length)
    if abs(cosine) >= 1.0:
        return a
    sign = -1.0 if cosine < 0.0 else 1.0
    theta = acos(sign * cosine)
    s0, s1, d = sin((1.0 - t) * theta), sin(sign * t * theta), 1.0 / sin(theta)
    s0, s1 = s0 * d, s1 * d
    return rounded(*[p * s0 + q * s1 for p, q in zip(a, b, strict=True)])


def getQuaternionFromAxisAngle(axis: Vector, angle: float, physicsClientId: int = 0) -> Numbers:
    """Return the quaternion of a rotation by `angle` (rad) about an axis of any length; x for length 0.

    It is NaN for an infinite angle.

    Raises:
        error: the axis does not have three numbers.
    """
    x, y, z = _joined("Require axis [x,y,z] and angle.", (axis, 3))
    (half,) = rounded(angle)
    half = half * 0.5 if isfinite(half) else nan
    length = sqrt(x * x + y * y + z * z)
    if length < _EPSILON:
        x, y, z, length = 1.0, 0.0, 0.0, 1.0
    s = sin(half) / length
    return rounded(x * s, y * s, z * s, cos(half))


def getAxisAngleFromQuaternion(quaternion: Vector, physicsClientId: int = 0) -> tuple[Numbers, float]:
    """Return axis and angle (0 to 2 pi rad) of a unit quaternion; axis x for the identity.

    Raises:
        error: there are not four numbers.
    """
    x, y, z, w = _joined("Require a quaternion with 4 components [x,y,z,w].", (quaternion, 4))
    angle = 2.0 * acos(min(1.0, max(-1.0, w)))
    squared = 1.0 - w * w
    if squared < 10.0 * _EPSILON:
        return (1.0, 0.0, 0.0), rounded(angle)[0]
    s = 1.0 / sqrt(squared)
    out = rounded(x * s, y * s, z * s, angle)
    return out[:3], out[3]


def getDifferenceQuaternion(
    quaternionStart: Vector, quaternionEnd: Vector, physicsClientId: int = 0
) -> Numbers:
    """Return the rotation from the start to the end, on the shorter arc.

    Raises:
        error: a quaternion does not have four numbers.
    """
    both = _pair(_BAD_PAIR, quaternionStart, quaternionEnd, _EIGHT, 4)
    return rounded(*_difference(both[:4], both[4:]))


def calculateVelocityQuaternion(
    quaternionStart: Vector, quaternionEnd: Vector, deltaTime: float, physicsClientId: int = 0
) -> Numbers:
    """Return the angular velocity (rad/s) that rotates the start to the end within `deltaTime` (s).

    Raises:
        error: a quaternion does not have four numbers.
    """
    both = _pair(_BAD_PAIR, quaternionStart, quaternionEnd, _EIGHT, 4)
    (dt,) = rounded(deltaTime)
    if both[:4] == both[4:]:
        return 0.0, 0.0, 0.0
    x, y, z, w = rounded(*_difference(both[:4], both[4:]))
    length = sqrt(x * x + y * y + z * z)
    if length < _EPSILON:
        x, y, z, length = 1.0, 0.0, 0.0, 1.0
    angle = 2.0 * acos(min(1.0, max(-1.0, w)))
    rate = angle / (length * dt) if dt else nan
    return rounded(x * rate, y * rate, z * rate)


def getAxisDifferenceQuaternion(
    quaternionStart: Vector, quaternionEnd: Vector, physicsClientId: int = 0
) -> Numbers:
    """Return the angles (rad) about rotating axes x, y, z of the start relative to the end.

    Raises:
        error: a quaternion does not have four numbers.
    """
    both = _pair(_BAD_PAIR, quaternionStart, quaternionEnd, _EIGHT, 4)
    x, y, z, w = both[4:]
    m = _matrix(_product((-x, -y, -z, w), both[:4]))
    sine = m[2]
    if sine >= 1.0:
        return rounded(atan2(m[3], m[4]), pi / 2, 0.0)
    if sine <= -1.0:
        return rounded(-atan2(m[3], m[4]), -pi / 2, 0.0)
    return rounded(atan2(-m[5], m[8]), asin(sine), atan2(-m[1], m[0]))


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]


def _product(a: Vector, b: Vector) -> Numbers:
    """Return the Hamilton product: rotation `b`, then `a`."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def _matrix(quaternion: Vector) -> Numbers:
    """Return the nine entries, row-major, of the rotation of a quaternion; NaN for length 0."""
    x, y, z, w = quaternion
    norm = x * x + y * y + z * z + w * w
    if norm == 0.0:
        return (nan,) * 9
    s = 2.0 / norm
    xx, xy, xz, yy, yz, zz = s * x * x, s * x * y, s * x * z, s * y * y, s * y * z, s * z * z
    wx, wy, wz = s * w * x, s * w * y, s * w * z
    return (
        *(1.0 - yy - zz, xy - wz, xz + wy),
        *(xy + wz, 1.0 - xx - zz, yz - wx),
        *(xz - wy, yz + wx, 1.0 - xx - yy),
    )


def _turned(x: float, y: float, z: float, w: float, vx: float, vy: float, vz: float) -> Numbers:
    """Return a vector rotated by a quaternion of any length; NaN for length 0."""
    norm = x * x + y * y + z * z + w * w
    if norm == 0.0:
        return nan, nan, nan
    s = 2.0 / norm
    cx, cy, cz = s * (y * vz - z * vy), s * (z * vx - x * vz), s * (x * vy - y * vx)
    return (
        vx + w * cx + y * cz - z * cy,
        vy + w * cy + z * cx - x * cz,
        vz + w * cz + x * cy - y * cx,
    )


def _difference(start: Vector, end: Vector) -> Numbers:
    """Return end · start⁻¹, with the sign of the end that is closer to the start."""
    near = _dot(start, end)
    if near <= 0.0:
        end = [-c for c in end]
    x, y, z, w = start
    return _product(end, (-x, -y, -z, w))
