"""Joint models: sizes of positions, motion of the child frame, one-DOF coordinates and mimic chains.

Both implementations of forward kinematics use this file. They differ in their inputs, not in the joints:

- `description_poses.forward_kinematics` takes every joint type as the description has it, with quaternions
  for spherical and floating joints, and returns all links. It is plain NumPy, for readers, writers and
  reports that need a few poses and should not load numba.
- `ChainArrays` and `forward.forward_kinematics` take minimal coordinates, fold fixed joints away and are
  compiled, for inverse kinematics and planning, which need many thousands of poses.
"""

from __future__ import annotations

from collections.abc import Container

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._records import dataclass
from roboyard.description.model import Joint, RobotDescription
from roboyard.errors import DescriptionError, unknown_name
from roboyard.transforms import Array, normalized, pose_matrix, quaternion_from_axis_angle

POSITION_SIZE: dict[str, int] = {
    "fixed": 0,
    "revolute": 1,
    "continuous": 1,
    "prismatic": 1,
    "spherical": 4,
    "planar": 3,
    "floating": 7,
}
"""Joint type to the number of entries of its position; units in `position_size`."""
VELOCITY_SIZE: dict[str, int] = {**POSITION_SIZE, "spherical": 3, "floating": 6}
"""Joint type to the number of entries of its velocity: its degrees of freedom."""

_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def position_size(joint: Joint) -> int:
    """Return the number of entries of the joint's position.

    1 for revolute, continuous (rad) and prismatic (m); planar 3 (x, y in m, angle about the axis in rad);
    spherical 4 (quaternion x, y, z, w); floating 7 (position in m, then quaternion x, y, z, w); fixed 0.
    """
    return POSITION_SIZE[joint.type]


def joint_transform(joint: Joint, position: ArrayLike) -> Array:
    """Return the pose of the moved child frame in the child frame at position zero.

    Args:
        joint: any joint; its axis is a unit vector.
        position: (..., k) with k = `position_size(joint)`; rad, m and quaternions (x, y, z, w).

    Returns:
        (..., 4, 4) homogeneous matrices; translations in m.
    """
    q = np.asarray(position, dtype=float)
    axis = np.asarray(joint.axis)
    match joint.type:
        case "revolute" | "continuous":
            return pose_matrix(np.zeros(3), quaternion_from_axis_angle(axis, q[..., 0]))
        case "prismatic":
            return pose_matrix(axis * q)
        case "planar":
            first, second = plane_axes(axis)
            shift = first * q[..., 0:1] + second * q[..., 1:2]
            return pose_matrix(shift, quaternion_from_axis_angle(axis, q[..., 2]))
        case "spherical":
            return pose_matrix(np.zeros(3), normalized(q))
        case "floating":
            return pose_matrix(q[..., :3], normalized(q[..., 3:]))
        case _:
            return np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4))


def plane_axes(normal: ArrayLike) -> tuple[Array, Array]:
    """Return two (3,) unit axes that span the plane of a planar joint, right-handed with its unit normal.

    They are (x, y) for the normal z, (y, z) for x and (z, x) for y. Other normals start from the nearest of
    those three; the first axis is projected onto the plane.
    """
    n = np.asarray(normal, dtype=float)
    k = int(np.argmax(np.abs(n)))
    first = np.eye(3)[(k + 1) % 3]
    first = first - n * (first @ n)
    first /= np.linalg.norm(first)
    return first, np.cross(n, first)


@dataclass(frozen=True, kw_only=True, slots=True)
class Coordinate:
    """One degree of freedom of a joint."""

    name: str
    """The joint's name; with `:x`, `:y`, `:z`, `:rx`, `:ry` or `:rz` where the joint has several."""
    axis: tuple[float, float, float]
    """Unit vector in the joint frame."""
    is_prismatic: bool
    """True for a translation along the axis, False for a rotation about it."""
    lower: float = -np.inf
    """Smallest position (rad or m)."""
    upper: float = np.inf
    """Largest position (rad or m)."""
    velocity: float = np.inf
    """Largest speed (rad/s or m/s)."""


def coordinates(joint: Joint) -> tuple[Coordinate, ...]:
    """Return the joint's coordinates from the parent to the child; none for a fixed joint.

    Raises:
        DescriptionError: the axis is zero or not finite.
    """
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
                    velocity=_velocity_limit(joint),
                ),
            )
        case "spherical":
            return _rotations(name)
        case "planar":
            normal = _unit_axis(joint)
            first, second = (tuple(axis.tolist()) for axis in plane_axes(normal))
            return (
                Coordinate(name=f"{name}:x", axis=first, is_prismatic=True),
                Coordinate(name=f"{name}:y", axis=second, is_prismatic=True),
                Coordinate(name=f"{name}:rz", axis=normal, is_prismatic=False),
            )
        case "floating":
            shifts = zip("xyz", (_X, _Y, _Z), strict=True)
            return (
                *(Coordinate(name=f"{name}:{c}", axis=axis, is_prismatic=True) for c, axis in shifts),
                *_rotations(name),
            )


def _rotations(name: str) -> tuple[Coordinate, ...]:
    pairs = zip(("rx", "ry", "rz"), (_X, _Y, _Z), strict=True)
    return tuple(Coordinate(name=f"{name}:{c}", axis=axis, is_prismatic=False) for c, axis in pairs)


def _unit_axis(joint: Joint) -> tuple[float, float, float]:
    x, y, z = joint.axis
    length = float(np.sqrt(x * x + y * y + z * z))
    if not (np.isfinite(length) and length > 1e-9):
        raise _error(joint, f"<axis> is {joint.axis}; give a non-zero axis")
    return (x / length, y / length, z / length)


def _velocity_limit(joint: Joint) -> float:
    """Largest speed (rad/s or m/s); a limit of 0 counts as missing, since the joint could never move."""
    given = None if joint.limit is None else joint.limit.velocity
    return given if given else np.inf


@dataclass(frozen=True, kw_only=True, slots=True)
class MimicSource:
    """Position of a mimic joint: multiplier · (position of the leader) + offset."""

    leader: Joint | None
    """The joint at the end of the mimic chain, of one degree of freedom; None where the chain is broken."""
    multiplier: float
    """Product of the multipliers along the chain."""
    offset: float
    """Position (rad or m) with the leader at zero."""
    error: DescriptionError | None = None
    """Why the chain is broken: a circle, a missing joint or one without exactly one degree of freedom."""


def mimic_source(description: RobotDescription, joint: Joint, known: Container[str] = ()) -> MimicSource:
    """Return the leader of a mimic joint through the joints that mimic each other.

    Args:
        description: the robot.
        joint: a joint that mimics another.
        known: names of joints whose positions are given; the chain ends at the first of them.
    """
    multiplier, offset = 1.0, 0.0
    path, current = [joint.name], joint
    while current.mimic is not None and (current is joint or current.name not in known):
        offset += multiplier * current.mimic.offset
        multiplier *= current.mimic.multiplier
        leader = description.joint_by_name.get(current.mimic.joint)
        error = _mimic_error(description, current, leader, path)
        if leader is None or error is not None:
            return MimicSource(leader=None, multiplier=multiplier, offset=offset, error=error)
        path.append(leader.name)
        current = leader
    return MimicSource(leader=current, multiplier=multiplier, offset=offset)


def _mimic_error(
    description: RobotDescription, joint: Joint, leader: Joint | None, path: list[str]
) -> DescriptionError | None:
    assert joint.mimic is not None
    if leader is None:
        hint = unknown_name("joint", joint.mimic.joint, description.joint_by_name)
        return _error(joint, f"<mimic> names {hint}")
    if leader.name in path:
        circle = " -> ".join((*path, leader.name))
        return _error(leader, f"<mimic> goes round in a circle ({circle}); remove one of them")
    if VELOCITY_SIZE[leader.type] != 1:
        needed = "a joint with one degree of freedom"
        return _error(joint, f'<mimic> follows "{leader.name}" ({leader.type}); it needs {needed}')
    return None


def _error(joint: Joint, message: str) -> DescriptionError:
    return DescriptionError(
        message, file=joint.source.file, line=joint.source.line, element=f'joint "{joint.name}"'
    )
