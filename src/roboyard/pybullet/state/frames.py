"""Conversion of link frames to inertial frames in plain floats, for fast getters and commands."""

from __future__ import annotations

from collections.abc import Sequence

from roboyard.description.model import Pose

Numbers = tuple[float, ...]
BROADPHASE_MARGIN = 0.02
"""Margin of boxes in Bullet's broad phase (m)."""
SINGLE_READS = 16
"""Links that are read one by one in a state, until the frames of all are computed."""


def inertial_pose(
    position: Sequence[float], quaternion: Sequence[float], frame: Pose
) -> tuple[Numbers, Numbers]:
    """Return the world pose of a link's inertial frame.

    Args:
        position: (3,) position of the link frame in the world (m).
        quaternion: (4,) orientation of the link frame (x, y, z, w).
        frame: inertial frame in the link frame.
    """
    x, y, z = position
    i, j, k, w = quaternion
    fx, fy, fz = frame.position
    fi, fj, fk, fw = frame.quaternion
    # q v q* = v + w t + q x t, with t = 2 q x v
    tx, ty, tz = 2.0 * (j * fz - k * fy), 2.0 * (k * fx - i * fz), 2.0 * (i * fy - j * fx)
    return (
        (
            x + fx + w * tx + j * tz - k * ty,
            y + fy + w * ty + k * tx - i * tz,
            z + fz + w * tz + i * ty - j * tx,
        ),
        (
            w * fi + i * fw + j * fk - k * fj,
            w * fj - i * fk + j * fw + k * fi,
            w * fk + i * fj - j * fi + k * fw,
            w * fw - i * fi - j * fj - k * fk,
        ),
    )


def link_pose(position: Sequence[float], quaternion: Sequence[float], frame: Pose) -> tuple[Numbers, Numbers]:
    """Return the world pose of a link's frame.

    Args:
        position: (3,) position of the link's inertial frame in the world (m).
        quaternion: (4,) orientation of the inertial frame (x, y, z, w).
        frame: inertial frame in the link frame.
    """
    i, j, k, w = quaternion
    fi, fj, fk, fw = frame.quaternion
    turn = (
        i * fw - w * fi - j * fk + k * fj,
        i * fk - w * fj + j * fw - k * fi,
        -(w * fk) - i * fj + j * fi + k * fw,
        w * fw + i * fi + j * fj + k * fk,
    )
    (x, y, z), (a, b, c) = position, rotated(turn, frame.position)
    return (x - a, y - b, z - c), turn


def rotated(quaternion: Sequence[float], vector: Sequence[float]) -> tuple[float, float, float]:
    """Return the (3,) vector rotated by a unit quaternion (x, y, z, w)."""
    x, y, z, w = quaternion
    a, b, c = vector
    d, e, f = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * d + (y * f - z * e), b + w * e + (z * d - x * f), c + w * f + (x * e - y * d)


def cross(a: Sequence[float], b: Sequence[float]) -> tuple[float, float, float]:
    """Return the cross product of two (3,) vectors."""
    (x, y, z), (i, j, k) = a, b
    return y * k - z * j, z * i - x * k, x * j - y * i
