"""Goals of a motion: joint positions, poses of a link, and sets of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from roboyard.errors import ConfigError, unknown_name
from roboyard.kinematics.chain import ChainArrays
from roboyard.transforms import Array, inverse_pose, multiply, pose_matrix, quaternion_from_axis_angle

if TYPE_CHECKING:
    from roboyard.planning.spheres.sphere_model import SphereRobot

TOLERANCE_POSITION, TOLERANCE_ORIENTATION = 1e-4, 1e-3
"""Largest errors of an inverse kinematics solution (m, rad)."""
DISTINCT = 0.05
"""Largest difference of a joint between two solutions that count as one (rad or m)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PoseGoal:
    """A pose that a link is to reach."""

    link: str
    position: ArrayLike
    """(3,) in the world frame (m)."""
    quaternion: ArrayLike | None = None
    """(4,) x, y, z, w in the world frame; None leaves the orientation free."""


Goal = ArrayLike | PoseGoal
"""(n,) joint positions (rad or m), or a pose."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PostureSolution:
    """One posture that reaches a pose."""

    q: Array
    """(n,) joint positions (rad or m)."""
    position_error: float
    """m"""
    orientation_error: float
    """rad; 0 where the orientation is free."""
    is_free: bool
    """Whether the posture touches nothing."""


def postures_for(
    robot: SphereRobot, goal: PoseGoal, root: Array, near: Array, *, seeds: int = 64, seed: int = 0
) -> list[PostureSolution]:
    """Return distinct postures within the limits that reach a pose, nearest to `near` first; not checked for
    collisions.

    Args:
        robot: the robot.
        goal: the pose in the world frame.
        root: (4, 4) pose of the robot's root link in the world frame (m).
        near: (n,) posture that the first descent starts from, and to which distances are measured.
        seeds: number of descents.
        seed: seed of the random starts.

    Raises:
        ConfigError: the link does not exist or no joint of the group moves it, or a value is not finite.
    """
    from roboyard.kinematics import solve_ik_batch

    chain = tip_chain(robot, goal.link)
    turn = (0.0, 0.0, 0.0, 1.0) if goal.quaternion is None else goal.quaternion
    if np.shape(goal.position) != (3,) or np.shape(turn) != (4,):
        raise ConfigError(
            f'goal of link "{goal.link}": position {goal.position}, quaternion {goal.quaternion}: must have '
            "3 and 4 numbers"
        )
    if not np.isfinite(np.concatenate([goal.position, turn])).all():
        raise ConfigError(f'goal of link "{goal.link}": {goal.position}, {goal.quaternion} is not finite')
    target = inverse_pose(root) @ pose_matrix(goal.position, turn)
    random = np.random.default_rng(seed)
    starts = random.uniform(robot.arrays.lower, robot.arrays.upper, (seeds, len(near)))
    starts[0] = near
    half = seeds // 3
    spread = 0.3 * (robot.arrays.upper - robot.arrays.lower)
    starts[1:half] = near + random.normal(size=(half - 1, len(near))) * np.minimum(spread, 1.0)
    starts = np.clip(starts, robot.arrays.lower, robot.arrays.upper)
    free = goal.quaternion is None
    targets = np.repeat((target[:3, 3] if free else target)[None], seeds, axis=0)
    found = solve_ik_batch(
        chain,
        targets,
        starts,
        tolerance_position=TOLERANCE_POSITION,
        tolerance_orientation=TOLERANCE_ORIENTATION,
        iterations=60,
        restarts=0,
        seed=seed,
    )
    q = _nearest_turns(found.q, near, robot)
    inside = np.all((q >= robot.arrays.lower - 1e-9) & (q <= robot.arrays.upper + 1e-9), axis=1)
    solutions: list[PostureSolution] = []
    for k in np.argsort(np.linalg.norm(q - near, axis=1)):
        if not (found.converged[k] and inside[k]):
            continue
        if any(np.abs(q[k] - other.q).max() < DISTINCT for other in solutions):
            continue
        solutions.append(
            PostureSolution(
                q=q[k],
                position_error=float(found.position_error[k]),
                orientation_error=0.0 if free else float(found.orientation_error[k]),
                is_free=True,
            )
        )
    return solutions


def nearest_approach(robot: SphereRobot, goal: PoseGoal, root: Array, near: Array, *, seed: int = 0) -> str:
    """Return how near a link comes to a pose that it does not reach, and what would help.

    Args:
        robot: the robot.
        goal: the pose in the world frame.
        root: (4, 4) pose of the robot's root link in the world frame (m).
        near: (n,) posture that the first descent starts from (rad or m).
        seed: seed of the random starts.
    """
    from roboyard.kinematics import forward_kinematics, solve_ik

    chain = tip_chain(robot, goal.link)
    target = inverse_pose(root) @ pose_matrix(goal.position)
    found = solve_ik(chain, target[:3, 3], near, restarts=20, seed=seed)
    gap = float(np.linalg.norm(target[:3, 3] - forward_kinematics(chain, found.q, goal.link)[:3, 3]))
    if gap > 2 * TOLERANCE_POSITION:
        return f"it comes within {gap:.2f} m; move the goal or the base, or plan for more joints"
    if goal.quaternion is not None:
        return "it reaches the position in another orientation; leave the orientation free or turn the goal"
    return "move it or the base"


def turned_goals(goal: PoseGoal, axis: ArrayLike, count: int = 12) -> list[PoseGoal]:
    """Return a pose turned about an axis (3,) of its own in `count` even steps: a set of poses for `plan`.

    Raises:
        ConfigError: the orientation of the goal is free.
    """
    if goal.quaternion is None:
        raise ConfigError(f'goal of link "{goal.link}": its orientation is free already; give a quaternion')
    angles = np.arange(count) * 2 * np.pi / count
    return [
        replace(goal, quaternion=multiply(goal.quaternion, quaternion_from_axis_angle(axis, angle)))
        for angle in angles
    ]


def tip_chain(robot: SphereRobot, link: str) -> ChainArrays:
    """Return the chain of a robot with one link as its tip.

    Raises:
        ConfigError: the link does not exist, or no joint of the group moves it.
    """
    chain = robot.chain
    if link not in chain.links:
        raise ConfigError(f"{robot.model.description.name}: {unknown_name('link', link, chain.links)}")
    index = chain.link(link)
    if chain.link_node[index] < 0:
        raise ConfigError(
            f'{robot.model.description.name}: link "{link}" is moved by none of the joints '
            f"{', '.join(robot.joint_names)}; choose another link or group"
        )
    return replace(chain, tips=np.array([index], dtype=np.int64))


def _nearest_turns(q: Array, near: Array, robot: SphereRobot) -> Array:
    """Return (b, n) postures with continuous joints a whole number of turns from where they were."""
    period = robot.chain.period
    turning = (period > 0) & ~np.isfinite(robot.chain.lower) & ~np.isfinite(robot.chain.upper)
    out = q.copy()
    for j in np.flatnonzero(turning):
        out[:, j] -= np.round((out[:, j] - near[j]) / period[j]) * period[j]
        low, high = robot.arrays.lower[j], robot.arrays.upper[j]
        out[:, j] = np.where(out[:, j] < low, out[:, j] + period[j], out[:, j])
        out[:, j] = np.where(out[:, j] > high, out[:, j] - period[j], out[:, j])
    return out
