"""Constraints on a link along a whole path: keep a cup upright, stay on a line or a plane.

A constraint is a region of poses around a frame, as bounds of x, y, z and of a rotation vector in that frame
(task space regions, Berenson et al. 2011).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from roboyard._arrays import ArrayLike, NDArray
from roboyard.errors import ConfigError, unknown_name
from roboyard.kinematics import forward_kinematics, jacobian
from roboyard.planning.trajectory import Outcome
from roboyard.transforms import Array, inverse_pose

if TYPE_CHECKING:
    from roboyard.planning.spheres.sphere_model import SphereRobot

FREE = np.inf
DEEPER = 0.6
"""Share of a tolerance that projected configurations keep, so that motions between them stay inside."""
ITERATIONS = 30


@dataclass(frozen=True, kw_only=True, eq=False)
class PathConstraint:
    """Poses that a link may have along a path."""

    link: str
    frame: Array | None = None
    """(4, 4) frame in the world frame (m); the link's pose at the start by default."""
    position: ArrayLike = (FREE, FREE, FREE)
    """(3,) largest distances along the frame's axes, or one number (m); inf for free."""
    rotation: ArrayLike = (FREE, FREE, FREE)
    """(3,) largest rotations about the frame's axes, or one number (rad); inf for free."""
    axis: ArrayLike | None = None
    """(3,) direction in the link's frame that stays as it is, up to `tilt`, in place of `rotation`."""
    tilt: float = 0.1
    """Largest angle between `axis` and its direction in `frame` (rad)."""


def keep_upright(link: str, tilt: float = 0.1, up: ArrayLike | None = None) -> PathConstraint:
    """Return a constraint that keeps a link's direction `up` (3,), in its frame, as it is at the start.

    Args:
        link: the link.
        tilt: largest angle to that direction (rad).
        up: by default what points up in the world at the start.
    """
    return PathConstraint(link=link, axis=(0.0, 0.0, 0.0) if up is None else up, tilt=tilt)


def on_line(
    link: str, start: ArrayLike, end: ArrayLike, tolerance: float = 0.005, turn: float = FREE
) -> PathConstraint:
    """Return a constraint that keeps a link's origin near the line through two points (3,) of the world (m).

    Args:
        link: the link.
        start: (3,) first point.
        end: (3,) second point.
        tolerance: largest distance from the line, along each of two directions across it (m).
        turn: largest rotation from the orientation at the start (rad); free by default.

    Raises:
        ConfigError: the points are equal.
    """
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = float(np.linalg.norm(b - a))
    if not length > 0:
        raise ConfigError(f"a line from {a.tolist()} to {b.tolist()} has no direction; give two points")
    x = (b - a) / length
    y = np.cross((0.0, 0.0, 1.0) if abs(x[2]) < 0.9 else (0.0, 1.0, 0.0), x)
    y /= np.linalg.norm(y)
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = np.stack([x, y, np.cross(x, y)], axis=1), a
    return PathConstraint(link=link, frame=frame, position=(FREE, tolerance, tolerance), rotation=turn)


class BoundConstraint:
    """A constraint on the joints of a robot, with its reference taken from a start."""

    def __init__(self, constraint: PathConstraint, robot: SphereRobot, root: Array, start: Array) -> None:
        """Bind a constraint to a robot at (n,) start, in depth-first order.

        Raises:
            ConfigError: the link does not exist, or a tolerance is not positive.
        """
        self.robot, self.link = robot, constraint.link
        chain = robot.chain
        if self.link not in chain.links:
            raise ConfigError(f"keep: {unknown_name('link', self.link, chain.links)}")
        self.inverse = inverse_pose(root)
        now = root @ forward_kinematics(chain, start, self.link)
        frame = now if constraint.frame is None else np.asarray(constraint.frame, dtype=float)
        self.frame = self.inverse @ frame
        self.turned = (inverse_pose(frame) @ now)[:3, :3]
        self._to_frame = inverse_pose(self.frame)
        self.bound = np.concatenate([_three(constraint.position), _three(constraint.rotation)])
        self.axis: Array | None = None
        self.tilt = constraint.tilt
        if constraint.axis is not None:
            axis = np.asarray(constraint.axis, dtype=float)
            if not axis.any():
                axis = now[2, :3]  # what is up in the world, in the link's frame
            self.axis = axis / np.linalg.norm(axis)
            self.up = (now[:3, :3] @ self.axis) @ root[:3, :3]
            self.bound[3:] = FREE
        if not (self.bound > 0).all() or not self.tilt > 0:
            raise ConfigError(
                f"keep: tolerances of link {self.link!r} must be positive, got {self.bound.tolist()}"
            )

    def errors(self, q: Array) -> Array:
        """Return (..., k) deviations as shares of their tolerances; inside where all are at most 1."""
        poses = forward_kinematics(self.robot.chain, q, self.link)
        parts = [self._within(poses) / self.bound[self._bounded]]
        if self.axis is not None:
            now = poses[..., :3, :3] @ self.axis
            parts.append(np.arccos(np.clip(now @ self.up, -1.0, 1.0))[..., None] / self.tilt)
        return np.concatenate(parts, axis=-1)

    @cached_property
    def _bounded(self) -> NDArray[np.int64]:
        """Entries of `bound` that are not free."""
        return np.flatnonzero(np.isfinite(self.bound))

    def _within(self, poses: Array) -> Array:
        """Return (..., k) what is not free of positions and rotation vectors in the region's frame, for
        (..., 4, 4) poses in the root link's (m, rad).
        """
        bounded = self._bounded
        if not len(bounded):
            return np.zeros((*poses.shape[:-2], 0))
        within = self._to_frame @ poses
        values = within[..., :3, 3]
        if bounded[-1] >= 3:
            turns = _rotation_vectors(within[..., :3, :3] @ self.turned.T)
            values = np.concatenate([values, turns], axis=-1)
        return values[..., bounded]

    def inside(self, q: Array, share: float = 1.0) -> NDArray[np.bool_]:
        """Return (...) booleans: whether configurations (..., n) are inside that share of the tolerances."""
        return np.abs(self.errors(q)).max(axis=-1, initial=0.0) <= share

    def project(self, q: Array) -> Array | None:
        """Return the configuration near (n,) q that is inside the region, or None."""
        lower, upper = self.robot.arrays.lower, self.robot.arrays.upper
        q = np.array(q)
        for _ in range(ITERATIONS):
            rows, wrong = self._linear(q)
            if not len(wrong):
                return q
            gram = rows @ rows.T + 1e-6 * np.eye(len(wrong))
            step = rows.T @ (wrong / gram[0] if len(wrong) == 1 else np.linalg.solve(gram, wrong))
            length = float(np.abs(step).max())
            q = np.clip(q - step * min(1.0, 0.3 / max(length, 1e-12)), lower, upper)
        return None

    def _linear(self, q: Array) -> tuple[Array, Array]:
        """Return the (k, n) derivatives of what is outside, and by how much (k,) it is."""
        pose = forward_kinematics(self.robot.chain, q, self.link)
        beyond = [
            (int(k), float(np.copysign(abs(value) - DEEPER * self.bound[k], value)))
            for k, value in zip(self._bounded, self._within(pose), strict=True)
            if abs(value) > DEEPER * self.bound[k]
        ]
        angle, now = 0.0, np.zeros(3)
        if self.axis is not None:
            now = pose[:3, :3] @ self.axis
            angle = math.acos(min(max(float(now @ self.up), -1.0), 1.0))
        tilted = angle > DEEPER * self.tilt
        if not beyond and not tilted:
            return np.zeros((0, len(q))), np.zeros(0)
        jac = jacobian(self.robot.chain, q, link=self.link)
        turn = self.frame[:3, :3]
        rows = [turn[:, k % 3] @ (jac[:3] if k < 3 else jac[3:]) for k, _ in beyond]
        wrong = [amount for _, amount in beyond]
        if tilted:
            (a, b, c), (x, y, z) = self.up, now
            about = np.array((b * z - c * y, c * x - a * z, a * y - b * x))
            rows.append(about @ jac[3:] / max(math.sqrt(about @ about), 1e-12))
            wrong.append(angle - DEEPER * self.tilt)
        return np.array(rows), np.array(wrong)


def _three(values: ArrayLike) -> Array:
    return np.broadcast_to(np.asarray(values, dtype=float), (3,)).copy()


def _rotation_vectors(rotations: Array) -> Array:
    from scipy.spatial.transform import Rotation

    flat = rotations.reshape(-1, 3, 3)
    return Rotation.from_matrix(flat).as_rotvec().reshape(*rotations.shape[:-2], 3)


def why_outside(
    region: BoundConstraint, start: Array, goals: Array
) -> tuple[Outcome, str, NDArray[np.bool_]]:
    """Return an outcome and a reason where start (n,) or all goals (g, n) are outside a region; and (g,)
    booleans of the goals inside. The outcome is "solved" where there is nothing to object to.
    """
    inside = region.inside(goals)
    if not region.inside(start):
        worst = float(np.abs(region.errors(start)).max())
        reason = (
            f'link "{region.link}" is at {worst:.1f} times the tolerance that it has to keep to; move it '
            "there first, or widen the tolerance"
        )
        return "start outside constraint", reason, inside
    if not inside.any():
        worst = float(np.abs(region.errors(goals)).max(axis=1).min())
        reason = (
            f'link "{region.link}" would be at {worst:.1f} times the tolerance that it has to keep to; '
            "choose another goal, or widen the tolerance"
        )
        return "goal outside constraint", reason, inside
    return "solved", "", inside
