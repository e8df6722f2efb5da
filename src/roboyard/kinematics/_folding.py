"""One-degree coordinates of joints, and the rigid transforms that chain building folds together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from roboyard.description.model import Joint
from roboyard.errors import DescriptionError
from roboyard.transforms import Array

_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


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


@dataclass(frozen=True, kw_only=True, slots=True)
class Coordinate:
    """One degree of freedom of a joint."""

    name: str
    axis: tuple[float, float, float]
    """Unit, in the joint frame."""
    is_prismatic: bool
    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf


def coordinates(joint: Joint) -> tuple[Coordinate, ...]:
    """The joint's coordinates, from the parent to the child; none for a fixed joint."""
    name = joint.name
    match joint.type:
        case "fixed":
            return ()
        case "revolute" | "continuous" | "prismatic":
            lower, upper = joint.position_limits() or (-np.inf, np.inf)
            return (
                Coordinate(
                    name=name,
                    axis=_unit_axis(joint),
                    is_prismatic=joint.type == "prismatic",
                    lower=lower,
                    upper=upper,
                    velocity=_speed(joint),
                ),
            )
        case "spherical":
            return _turns(name)
        case "planar":
            normal = _unit_axis(joint)
            plane = z_to(normal).rotation
            across, along = tuple(plane[:, 0].tolist()), tuple(plane[:, 1].tolist())
            return (
                Coordinate(name=f"{name}:x", axis=across, is_prismatic=True),
                Coordinate(name=f"{name}:y", axis=along, is_prismatic=True),
                Coordinate(name=f"{name}:rz", axis=normal, is_prismatic=False),
            )
        case "floating":
            shifts = zip("xyz", (_X, _Y, _Z), strict=True)
            return (
                *(Coordinate(name=f"{name}:{c}", axis=axis, is_prismatic=True) for c, axis in shifts),
                *_turns(name),
            )


def _turns(name: str) -> tuple[Coordinate, ...]:
    pairs = zip(("rx", "ry", "rz"), (_X, _Y, _Z), strict=True)
    return tuple(Coordinate(name=f"{name}:{c}", axis=axis, is_prismatic=False) for c, axis in pairs)


def _unit_axis(joint: Joint) -> tuple[float, float, float]:
    x, y, z = joint.axis
    length = float(np.sqrt(x * x + y * y + z * z))
    if not (np.isfinite(length) and length > 1e-9):
        raise DescriptionError(
            f"<axis> is {joint.axis}; give a non-zero axis",
            file=joint.source.file,
            line=joint.source.line,
            element=f'joint "{joint.name}"',
        )
    return (x / length, y / length, z / length)


def _speed(joint: Joint) -> float:
    """Largest speed; a file's 0 means not given, since such a joint could never move."""
    given = None if joint.limit is None else joint.limit.velocity
    return given if given else np.inf
