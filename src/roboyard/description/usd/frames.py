"""Rigid poses of prims and of the frames of joints, in metres, z up."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from roboyard.description.usd.library import UsdGeom, UsdPhysics
from roboyard.description.usd.stage import OpenStage
from roboyard.errors import DescriptionError
from roboyard.transforms import Array, matrix_from_quaternion

SAME = 2e-6
"""Differences that single precision leaves, as a share of the distance (or of one radian)."""


@dataclass(kw_only=True, eq=False)
class Frames:
    """Poses of the prims of one stage."""

    opened: OpenStage
    cache: Any = field(default_factory=UsdGeom.XformCache)
    poses: dict[str, Array] = field(default_factory=dict)

    def affine(self, prim: Any | None) -> Array:
        """Return the (4, 4) transform of a prim's coordinates to the world (m); None: the stage itself."""
        T_world_stage = self.opened.T_world_stage
        if prim is None:
            return T_world_stage
        local = np.array(self.cache.GetLocalToWorldTransform(prim)).T
        if not np.isfinite(local).all() or abs(np.linalg.det(local[:3, :3])) < 1e-18:
            raise DescriptionError(
                f"{prim.GetPath()}: its transform is not finite or has no volume; correct its xformOps",
                element=str(prim.GetPath()),
            )
        return T_world_stage @ local

    def rigid(self, prim: Any | None) -> Array:
        """Return the (4, 4) pose of a prim's frame in the world (m), without its scale."""
        key = "" if prim is None else str(prim.GetPath())
        if key not in self.poses:
            T = self.affine(prim)
            out = np.eye(4)
            out[:3, :3], out[:3, 3] = _rotation(T[:3, :3]), T[:3, 3]
            self.poses[key] = out
        return self.poses[key]

    def joint_frame(self, joint: Any, number: int, target: Any | None, body: Any | None) -> Array:
        """Return the (4, 4) frame of a joint in its body's frame (m).

        Args:
            joint: the joint's prim.
            number: 0 or 1, of the body.
            target: the prim that the joint names; None for the world.
            body: the rigid body that the target belongs to; None for the world.
        """
        api = UsdPhysics.Joint(joint)
        position = (api.GetLocalPos0Attr() if number == 0 else api.GetLocalPos1Attr()).Get()
        turn = (api.GetLocalRot0Attr() if number == 0 else api.GetLocalRot1Attr()).Get()
        out = np.eye(4)
        p = np.zeros(3) if position is None else vector_of(position)
        q = np.array([0, 0, 0, 1.0]) if turn is None else quaternion_of(turn)
        if p is None or q is None:
            raise DescriptionError(
                f"{joint.GetPath()}: the frame in body {number} is not made of finite numbers; correct it",
                element=str(joint.GetPath()),
            )
        out[:3, :3] = self.rigid(target)[:3, :3] @ matrix_from_quaternion(q)
        out[:3, 3] = (self.affine(target) @ [*p, 1.0])[:3]
        base = self.rigid(body) if body is not None else np.eye(4)
        return np.asarray(np.linalg.inv(base) @ out, dtype=float)


def vector_of(value: Any) -> Array | None:
    """Return a Gf vector as (3,) numbers; None where it is anything else, or not finite."""
    try:
        vector = np.array(value, dtype=float)
    except (TypeError, ValueError):  # an attribute of another type than its schema says
        return None
    return vector if vector.shape == (3,) and np.isfinite(vector).all() else None


def quaternion_of(turn: Any) -> Array | None:
    """Return a Gf quaternion as a unit (4,) x, y, z, w; the identity where it has no length.

    None where it is no quaternion, or not finite.
    """
    try:
        q = np.array([*turn.GetImaginary(), turn.GetReal()], dtype=float)
    except (AttributeError, TypeError, ValueError):
        return None
    if q.shape != (4,) or not np.isfinite(q).all() or np.abs(q).max() > 1e100:
        return None
    length = float(np.linalg.norm(q))
    return q / length if length > 1e-9 else np.array([0.0, 0.0, 0.0, 1.0])


def at_zero(T_parent_first: Array, T_child_second: Array, drawn: Array) -> Array:
    """Return the (4, 4) pose of the child in the parent where the two frames of a joint coincide.

    Frames of joints are written in single precision: where the pose in which the stage draws the bodies is
    the same to that precision, it is the more exact one.

    Args:
        T_parent_first: (4, 4) frame in the parent (m).
        T_child_second: (4, 4) frame in the child (m).
        drawn: (4, 4) pose of the child in the parent as drawn (m).
    """
    stated = T_parent_first @ np.linalg.inv(T_child_second)
    reach = 1 + max(np.abs(part[:3, 3]).max() for part in (T_parent_first, T_child_second, drawn))
    near = np.abs(stated[:3, 3] - drawn[:3, 3]).max() < SAME * reach
    return drawn if near and np.abs(stated[:3, :3] - drawn[:3, :3]).max() < SAME else stated


def _rotation(A: Array) -> Array:
    """Return the rotation nearest to a (3, 3) matrix whose columns are scaled, and perhaps mirrored."""
    columns = A / np.linalg.norm(A, axis=0)
    if np.linalg.det(columns) < 0:
        columns = -columns
    if np.abs(columns.T @ columns - np.eye(3)).max() < 1e-12:
        return columns
    u, _, v = np.linalg.svd(columns)
    return np.asarray(u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v, dtype=float)
