"""Rotation vectors and matrices of single rotations, fast enough for every control step."""

from __future__ import annotations

import math

import numpy as np

from roboyard.transforms import Array


def matrix_of_vector(vector: Array) -> Array:
    """Return the (3, 3) rotation matrix of a (3,) rotation vector (rad), by Rodrigues' formula."""
    x, y, z = (float(v) for v in vector)
    angle = math.sqrt(x * x + y * y + z * z)
    if angle < 1e-12:
        return np.array([[1.0, -z, y], [z, 1.0, -x], [-y, x, 1.0]])
    x, y, z = x / angle, y / angle, z / angle
    c, s = math.cos(angle), math.sin(angle)
    t = 1.0 - c
    return np.array(
        [
            [t * x * x + c, t * x * y - s * z, t * x * z + s * y],
            [t * x * y + s * z, t * y * y + c, t * y * z - s * x],
            [t * x * z - s * y, t * y * z + s * x, t * z * z + c],
        ]
    )


def vector_of_matrix(rotation: Array) -> Array:
    """Return the (3,) rotation vector (rad, length 0 to π) of a (3, 3) rotation matrix."""
    (a, b, c), (d, e, f), (g, h, i) = rotation.tolist()
    x, y, z = h - f, c - g, d - b
    sine = math.sqrt(x * x + y * y + z * z)
    trace = a + e + i
    if sine < 1e-6 and trace < 0.0:
        # half a turn: the axis is the largest column of R + 1
        column = int(np.argmax([a, e, i]))
        axis = rotation[:, column].copy()
        axis[column] += 1.0
        return axis * (math.pi / float(np.linalg.norm(axis)))
    if sine < 1e-12:
        return np.array([x, y, z]) / 2.0
    return np.array([x, y, z]) * (math.atan2(sine, trace - 1.0) / sine)


def inverse(pose: Array) -> Array:
    """Return the (4, 4) inverse of a (4, 4) rigid transform."""
    out = np.zeros((4, 4))
    turned = pose[:3, :3].T
    out[:3, :3] = turned
    out[:3, 3] = -(turned @ pose[:3, 3])
    out[3, 3] = 1.0
    return out
