"""Rotations and poses: quaternions are (x, y, z, w), lengths in metres, angles in radians.

`T_world_tool` is the pose of `tool` in `world` and maps tool coordinates to world coordinates, so that
products cancel: `T_world_tool = T_world_base @ T_base_tool`. All functions broadcast over leading axes.
The only places where MuJoCo's (w, x, y, z) order appears are `to_wxyz` and `from_wxyz`.
"""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from roboyard._arrays import ArrayLike, NDArray

Array = NDArray[np.float64]

IDENTITY_QUATERNION = (0.0, 0.0, 0.0, 1.0)
_TO_WXYZ, _FROM_WXYZ = np.array([3, 0, 1, 2]), np.array([1, 2, 3, 0])


def to_wxyz(quaternion: ArrayLike) -> Array:
    """Return (..., 4) quaternions x, y, z, w in the order w, x, y, z."""
    return np.asarray(quaternion, dtype=float)[..., _TO_WXYZ]


def from_wxyz(quaternion: ArrayLike) -> Array:
    """Return (..., 4) quaternions w, x, y, z in the order x, y, z, w."""
    return np.asarray(quaternion, dtype=float)[..., _FROM_WXYZ]


def normalized(quaternion: ArrayLike) -> Array:
    """Return the (..., 4) quaternion scaled to unit length.

    Raises:
        ValueError: a quaternion has zero length or is not finite.
    """
    q = np.asarray(quaternion, dtype=float)
    if q.ndim == 1 and len(q) == 4:  # plain numbers are much faster than arrays
        x, y, z, w = q.tolist()
        length = sqrt(x * x + y * y + z * z + w * w)
        if 1e-12 < length < inf:
            return q / length
    norm = np.sqrt((q * q).sum(axis=-1, keepdims=True))
    if not ((norm > 1e-12) & (norm < np.inf)).all():
        raise ValueError(
            f"quaternion must have a finite length above 0, got {q.tolist()}; use (0, 0, 0, 1) for none"
        )
    return q / norm


def multiply(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the Hamilton product of two (..., 4) quaternions: rotation `b`, then `a`."""
    p, q = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    single = p.ndim == q.ndim == 1  # plain numbers are much faster than arrays of one
    ax, ay, az, aw = p.tolist() if single else np.moveaxis(p, -1, 0)
    bx, by, bz, bw = q.tolist() if single else np.moveaxis(q, -1, 0)
    product = [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
    return np.array(product) if single else np.stack(product, axis=-1)


def conjugate(quaternion: ArrayLike) -> Array:
    """Return the inverse of a unit (..., 4) quaternion."""
    return np.asarray(quaternion, dtype=float) * np.array([-1.0, -1.0, -1.0, 1.0])


def rotate(quaternion: ArrayLike, vector: ArrayLike) -> Array:
    """Return the (..., 3) vector rotated by a unit (..., 4) quaternion."""
    q = np.asarray(quaternion, dtype=float)
    v = np.asarray(vector, dtype=float)
    if q.ndim == v.ndim == 1:  # the same in plain numbers, thirty times faster
        (x, y, z, w), (a, b, c) = q.tolist(), v.tolist()
        d, e, f = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
        return np.array(
            [a + w * d + (y * f - z * e), b + w * e + (z * d - x * f), c + w * f + (x * e - y * d)]
        )
    t = 2.0 * _cross(q[..., :3], v)
    return v + q[..., 3:] * t + _cross(q[..., :3], t)


def _cross(a: Array, b: Array) -> Array:
    """Return the (..., 3) vector products; `np.cross` takes five times as long for hundreds of vectors."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out


def quaternion_from_rpy(rpy: ArrayLike) -> Array:
    """Return the (..., 4) quaternion of URDF's (..., 3) roll, pitch, yaw (rad) about fixed x, y, z axes."""
    half = np.asarray(rpy, dtype=float) / 2.0
    (cr, cp, cy), (sr, sp, sy) = np.moveaxis(np.cos(half), -1, 0), np.moveaxis(np.sin(half), -1, 0)
    return np.stack(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ],
        axis=-1,
    )


def rpy_from_matrix(matrix: ArrayLike) -> Array:
    """Return (..., 3) roll, pitch, yaw (rad) of a (..., 3, 3) rotation; roll is 0 at pitch ±90 degrees."""
    m = np.asarray(matrix, dtype=float)
    across = np.hypot(m[..., 0, 0], m[..., 1, 0])
    pitch = np.arctan2(-m[..., 2, 0], across)
    roll = np.where(across < 1e-9, 0.0, np.arctan2(m[..., 2, 1], m[..., 2, 2]))
    s, c = np.sin(roll), np.cos(roll)
    # near ±90 degrees only roll and yaw together are determined: the yaw that belongs to this roll
    near = np.arctan2(s * m[..., 0, 2] - c * m[..., 0, 1], c * m[..., 1, 1] - s * m[..., 1, 2])
    yaw = np.where(across < 1e-3, near, np.arctan2(m[..., 1, 0], m[..., 0, 0]))
    return np.stack([roll, pitch, yaw], axis=-1)


def quaternion_from_axis_angle(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Return the (..., 4) quaternion of a rotation by `angle` (rad) about the unit (..., 3) `axis`."""
    half = np.asarray(angle, dtype=float)[..., None] / 2.0
    return np.concatenate([np.asarray(axis, dtype=float) * np.sin(half), np.cos(half) + 0.0 * half], axis=-1)


def matrix_from_quaternion(quaternion: ArrayLike) -> Array:
    """Return the (..., 3, 3) rotation matrix of a unit (..., 4) quaternion."""
    q = np.asarray(quaternion, dtype=float)
    x, y, z, w = q.tolist() if q.ndim == 1 else np.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows) if q.ndim == 1 else np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_matrix(matrix: ArrayLike) -> Array:
    """Return the (..., 4) unit quaternion, w >= 0, of a (..., 3, 3) rotation matrix."""
    m = np.asarray(matrix, dtype=float)
    flat = m.reshape(-1, 3, 3)
    out = np.empty((len(flat), 4))
    for i, r in enumerate(flat):
        trace = np.trace(r)
        diagonal = [r[0, 0], r[1, 1], r[2, 2], trace]
        k = int(np.argmax(diagonal))
        if k == 3:
            q = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1.0 + trace])
        else:
            a, b, c = k, (k + 1) % 3, (k + 2) % 3
            q = np.empty(4)
            q[a] = 1.0 + r[a, a] - r[b, b] - r[c, c]
            q[b] = r[b, a] + r[a, b]
            q[c] = r[c, a] + r[a, c]
            q[3] = r[c, b] - r[b, c]
        q /= np.linalg.norm(q)
        out[i] = -q if q[3] < 0 else q
    return out.reshape(*m.shape[:-2], 4)


def pose_matrix(position: ArrayLike = (0, 0, 0), quaternion: ArrayLike = IDENTITY_QUATERNION) -> Array:
    """Return the (..., 4, 4) homogeneous matrix of a (..., 3) position (m) and a unit (..., 4) quaternion."""
    p = np.asarray(position, dtype=float)
    r = matrix_from_quaternion(quaternion)
    shape = np.broadcast_shapes(p.shape[:-1], r.shape[:-2])
    out = np.zeros((*shape, 4, 4))
    out[..., :3, :3] = r
    out[..., :3, 3] = p
    out[..., 3, 3] = 1.0
    return out


def inverse_pose(matrix: ArrayLike) -> Array:
    """Return the inverse of a (..., 4, 4) rigid transform."""
    m = np.asarray(matrix, dtype=float)
    out = np.zeros_like(m)
    rt = np.swapaxes(m[..., :3, :3], -1, -2)
    out[..., :3, :3] = rt
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", rt, m[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out
