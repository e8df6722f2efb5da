"""Rigid transforms that chain building folds together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Transform:
    """A rigid transform; `a @ b` applies b, then a."""

    position: Array
    rotation: Array

    @classmethod
    def identity(cls) -> Transform:
        return cls(position=np.zeros(3), rotation=np.eye(3))

    @classmethod
    def of(cls, position: ArrayLike, rotation: ArrayLike) -> Transform:
        return cls(position=np.asarray(position, dtype=float), rotation=np.asarray(rotation, dtype=float))

    def __matmul__(self, other: Transform) -> Transform:
        return Transform(
            position=self.position + self.rotation @ other.position, rotation=self.rotation @ other.rotation
        )

    def inverse(self) -> Transform:
        return Transform(position=-self.rotation.T @ self.position, rotation=self.rotation.T)


def about_z(angle: float) -> Transform:
    c, s = np.cos(angle), np.sin(angle)
    return Transform.of(np.zeros(3), [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def along_z(distance: float) -> Transform:
    return Transform.of([0.0, 0.0, distance], np.eye(3))


def z_to(axis: ArrayLike) -> Transform:
    """Smallest rotation that brings z onto the unit `axis` (about x for -z)."""
    a = np.asarray(axis, dtype=float)
    if a[2] < -1.0 + 1e-12:
        return Transform.of(np.zeros(3), np.diag([1.0, -1.0, -1.0]))
    v = np.array([-a[1], a[0], 0.0])  # z × axis
    skew = np.array([[0.0, 0.0, v[1]], [0.0, 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return Transform.of(np.zeros(3), np.eye(3) + skew + skew @ skew / (1.0 + a[2]))
