"""View and projection matrices in the OpenGL convention: +x right, +y up, viewing direction -z."""

from __future__ import annotations

import math

import numpy as np

from roboyard import transforms
from roboyard._arrays import ArrayLike, NDArray

Array = NDArray[np.float64]


def perspective(fovy: float, aspect: float, near: float, far: float) -> Array:
    """Return the (4, 4) OpenGL perspective projection.

    Args:
        fovy: vertical opening angle (rad).
        aspect: width / height of the picture.
        near: depth of the near clipping plane (m).
        far: depth of the far clipping plane (m).

    Raises ValueError for an angle outside (0, pi), an aspect that is not positive, and invalid depths.
    """
    check_range(near, far)
    if not 0.0 < fovy < math.pi or not aspect > 0.0:
        raise ValueError(f"fovy must be between 0 and pi (rad) and aspect above 0, got {fovy} and {aspect}")
    scale = 1.0 / math.tan(0.5 * fovy)
    out = np.zeros((4, 4))
    out[0, 0] = scale / aspect
    out[1, 1] = scale
    out[2, 2], out[2, 3] = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    out[3, 2] = -1.0
    return out


def look_at_view(eye: ArrayLike, target: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """Return the (4, 4) transform from the world frame to a camera at `eye` aimed at `target`, both (3,) (m).

    `up` is a (3,) direction in the world frame that points up in the picture. Raises ValueError where `eye`
    and `target` coincide.
    """
    e, t = np.asarray(eye, dtype=float), np.asarray(target, dtype=float)
    forward = t - e
    length = np.linalg.norm(forward)
    if e.shape != (3,) or t.shape != (3,) or not length > 1e-12:
        raise ValueError(f"eye and target must be two different (3,) points, got {eye} and {target}")
    forward = forward / length
    for reference in (np.asarray(up, dtype=float), np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])):
        right = np.cross(forward, reference)
        size = np.linalg.norm(right)
        if size > 1e-6 * max(float(np.linalg.norm(reference)), 1e-300):
            break
    right = right / size
    turn = np.stack([right, np.cross(right, forward), -forward])
    out = np.eye(4)
    out[:3, :3] = turn
    out[:3, 3] = -turn @ e
    return out


def orbit_view(target: ArrayLike, distance: float, yaw: float, pitch: float, roll: float = 0.0) -> Array:
    """Return the (4, 4) view matrix of a camera on an orbit; see `Camera.from_yaw_pitch`."""
    if not distance > 0:
        raise ValueError(f"distance must be positive, got {distance}")
    q_yaw = transforms.quaternion_from_axis_angle((0, 0, 1), yaw)
    q_pitch = transforms.quaternion_from_axis_angle((1, 0, 0), pitch)
    q_roll = transforms.quaternion_from_axis_angle((0, 1, 0), roll)
    turn = transforms.matrix_from_quaternion(transforms.multiply(transforms.multiply(q_yaw, q_pitch), q_roll))
    pose = np.eye(4)
    pose[:3, :3] = turn @ np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    pose[:3, 3] = np.asarray(target, dtype=float) - distance * turn[:, 1]
    return transforms.inverse_pose(pose)


def is_rotation(matrix: Array) -> bool:
    """Return whether a (3, 3) matrix turns, within the rounding of view matrices, and does nothing else."""
    return bool(np.abs(matrix @ matrix.T - np.eye(3)).max() <= 1e-3 and np.linalg.det(matrix) > 0.0)


def with_rigid_view(to_camera: Array, to_clip: Array) -> tuple[Array, Array]:
    """Return both (4, 4) matrices with scale, shear and mirror of the first one moved into the second.

    The pictures are the same: `to_camera` is factored into an upper triangular matrix, whose last row keeps
    the viewing direction, times a rotation; clip coordinates are scaled until w is the depth (m), or 1. A
    matrix that flattens space is returned as it is.
    """
    turn = to_camera[:3, :3]
    if is_rotation(turn) or not np.isfinite(to_camera).all() or abs(np.linalg.det(turn)) < 1e-12:
        return to_camera, _with_plain_w(to_clip)
    orthogonal, triangular = np.linalg.qr(turn[::-1].T)
    rotation, factor = orthogonal.T[::-1], triangular.T[::-1, ::-1]
    signs = np.sign(np.diag(factor))
    signs[0] *= np.sign(np.linalg.det(signs[:, None] * rotation))
    rotation, factor = signs[:, None] * rotation, factor * signs
    rigid, rest = np.eye(4), np.eye(4)
    rigid[:3, :3], rigid[:3, 3] = rotation, np.linalg.solve(factor, to_camera[:3, 3])
    rest[:3, :3] = factor
    return rigid, _with_plain_w(to_clip @ rest)


def _with_plain_w(to_clip: Array) -> Array:
    """Return the (4, 4) projection with a last row of (0, 0, -1, 0) or (0, 0, 0, 1), if it is a multiple."""
    factor = to_clip[3, 3] or -to_clip[3, 2]
    return to_clip / factor if factor > 0.0 and factor != 1.0 else to_clip


def check_range(near: float, far: float) -> None:
    """Raise ValueError unless both depths (m) are positive and `near` is below `far`."""
    if not 0.0 < near < far:
        raise ValueError(f"depths must satisfy 0 < near < far, got near {near} and far {far}")


def inverse_3x3(matrix: Array) -> Array:
    """Return the inverse of a (3, 3) matrix that has one, without the threads that LAPACK may start."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    first, second, third = e * i - f * h, f * g - d * i, d * h - e * g
    rows = (
        (first, c * h - b * i, b * f - c * e),
        (second, a * i - c * g, c * d - a * f),
        (third, b * g - a * h, a * e - b * d),
    )
    return np.array(rows) / (a * first + b * second + c * third)
