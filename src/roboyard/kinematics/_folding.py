"""Rigid transforms that chain building folds together."""

from __future__ import annotations

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._records import dataclass
from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Transform:
    """A rigid transform; `a @ b` applies b, then a."""

    position: Array
    """(3,) translation (m)."""
    rotation: Array
    """(3, 3) rotation."""

    @classmethod
    def identity(cls) -> Transform:
        """Return the identity."""
        return cls(position=np.zeros(3), rotation=np.eye(3))

    @classmethod
    def of(cls, position: ArrayLike, rotation: ArrayLike) -> Transform:
        """Return a transform of a (3,) position (m) and a (3, 3) rotation."""
        return cls(position=np.asarray(position, dtype=float), rotation=np.asarray(rotation, dtype=float))

    def __matmul__(self, other: Transform) -> Transform:
        return Transform(
            position=self.position + self.rotation @ other.position, rotation=self.rotation @ other.rotation
        )

    def inverse(self) -> Transform:
        """Return the inverse."""
        return Transform(position=-self.rotation.T @ self.position, rotation=self.rotation.T)


def about_z(angle: float) -> Transform:
    """Return a rotation about z (rad)."""
    c, s = np.cos(angle), np.sin(angle)
    return Transform.of(np.zeros(3), [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def along_z(distance: float) -> Transform:
    """Return a translation along z (m)."""
    return Transform.of([0.0, 0.0, distance], np.eye(3))


def z_to(axis: ArrayLike) -> Transform:
    """Return the smallest rotation that maps z to the unit (3,) `axis` (about x for -z)."""
    a = np.asarray(axis, dtype=float)
    if a[2] < -1.0 + 1e-12:
        return Transform.of(np.zeros(3), np.diag([1.0, -1.0, -1.0]))
    v = np.array([-a[1], a[0], 0.0])  # z × axis
    skew = np.array([[0.0, 0.0, v[1]], [0.0, 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return Transform.of(np.zeros(3), np.eye(3) + skew + skew @ skew / (1.0 + a[2]))
