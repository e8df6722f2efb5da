"""Goals of a motion: joint positions, poses of a link, and sets of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.errors import ConfigError, unknown_name
from roboyard.kinematics.chain import ChainArrays
from roboyard.transforms import Array, inverse_pose, multiply, pose_matrix, quaternion_from_axis_angle

if TYPE_CHECKING:
    from roboyard.planning.spheres.sphere_model import SphereRobot

TOLERANCE_POSITION, TOLERANCE_ORIENTATION = 1e-4, 1e-3
"""Largest errors of an inverse kinematics solution (m, rad)."""
ORIENTATION_WEIGHT = 0.5
"""Weight of rotations beside positions in a descent (1/rad)."""
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


@dataclass(frozen=True, kw_only=True, slots=True)
class PosesGoal:
    """Poses that several links are to reach at the same time, such as those of two hands."""

    poses: Sequence[PoseGoal]
    """One pose for each link."""


Goal = ArrayLike | PoseGoal | PosesGoal
"""(n,) joint positions (rad or m), a pose, or poses of several links."""


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
    robot: SphereRobot,
    goal: PoseGoal | PosesGoal,
    root: Array,
    near: Array,
    *,
    seeds: int = 64,
    seed: int = 0,
) -> list[PostureSolution]:
    """Return distinct postures within the limits that reach a pose, or poses of several links, nearest to
    `near` first; not checked for collisions.

    Args:
        robot: the robot.
        goal: in the world frame.
        root: (4, 4) pose of the robot's root link in the world frame (m).
        near: (n,) posture that the first descent starts from, and to which distances are measured.
        seeds: number of descents.
        seed: seed of the random starts.

    Raises:
        ConfigError: a link does not exist, is named twice or is moved by no joint of the group, or a value is
            not finite.
    """
    from roboyard.kinematics import solve_ik_batch

    chain, target, weights = pose_task(robot, goal, root)
    random = np.random.default_rng(seed)
    starts = random.uniform(robot.arrays.lower, robot.arrays.upper, (seeds, len(near)))
    starts[0] = near
    half = seeds // 3
    spread = 0.3 * (robot.arrays.upper - robot.arrays.lower)
    starts[1:half] = near + random.normal(size=(half - 1, len(near))) * np.minimum(spread, 1.0)
    starts = np.clip(starts, robot.arrays.lower, robot.arrays.upper)
    found = solve_ik_batch(
        chain,
        np.repeat(target[None], seeds, axis=0),
        starts,
        orientation_weights=weights,
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
                orientation_error=float(found.orientation_error[k]) if weights.any() else 0.0,
                is_free=True,
            )
        )
    return solutions


def pose_task(
    robot: SphereRobot, goal: PoseGoal | PosesGoal, root: Array
) -> tuple[ChainArrays, Array, Array]:
    """Return a chain with a goal's links as tips, and its targets and weights of orientations for `solve_ik`.

    Args:
        robot: the robot.
        goal: in the world frame.
        root: (4, 4) pose of the robot's root link in the world frame (m).

    Raises:
        ConfigError: a link does not exist, is named twice or is moved by no joint of the group, or a value is
            not finite.
    """
    poses = (goal,) if isinstance(goal, PoseGoal) else tuple(goal.poses)
    links = [one.link for one in poses]
    twice = next((link for k, link in enumerate(links) if link in links[:k]), None)
    if twice is not None:
        raise ConfigError(f'goal: link "{twice}" has two poses; give one, or a list of goals to choose from')
    if not poses:
        raise ConfigError("goal: a PosesGoal without poses; give one for each link")
    chain = tips_chain(robot, links)
    targets = np.stack([inverse_pose(root) @ _matrix(one) for one in poses])
    if all(one.quaternion is None for one in poses):
        targets = targets[:, :3, 3]
    weights = np.array([0.0 if one.quaternion is None else ORIENTATION_WEIGHT for one in poses])
    return chain, targets if len(poses) > 1 else targets[0], np.repeat(weights[:, None], 3, axis=1)


def _matrix(goal: PoseGoal) -> Array:
    turn = (0.0, 0.0, 0.0, 1.0) if goal.quaternion is None else goal.quaternion
    if np.shape(goal.position) != (3,) or np.shape(turn) != (4,):
        raise ConfigError(
            f'goal of link "{goal.link}": position {goal.position}, quaternion {goal.quaternion}: must have '
            "3 and 4 numbers"
        )
    if not np.isfinite(np.concatenate([goal.position, turn])).all():
        raise ConfigError(f'goal of link "{goal.link}": {goal.position}, {goal.quaternion} is not finite')
    return pose_matrix(goal.position, turn)


def why_unreachable(
    robot: SphereRobot, goal: PoseGoal | PosesGoal, root: Array, near: Array, *, seed: int = 0
) -> str:
    """Return which pose no posture reaches, how near its link comes, and what would help.

    Args:
        robot: the robot.
        goal: in the world frame.
        root: (4, 4) pose of the robot's root link in the world frame (m).
        near: (n,) posture that the first descent starts from (rad or m).
        seed: seed of the random starts.
    """
    if isinstance(goal, PosesGoal):
        if len(goal.poses) == 1:
            return why_unreachable(robot, goal.poses[0], root, near, seed=seed)
        for one in goal.poses:
            if not postures_for(robot, one, root, near, seed=seed):
                return why_unreachable(robot, one, root, near, seed=seed)
        links = " and ".join(f'"{one.link}"' for one in goal.poses)
        return (
            f"no posture within the limits brings links {links} to their poses at once, though each is "
            "reached alone; move one of them, or plan for more joints"
        )
    place = ", ".join(f"{x:.4g}" for x in np.asarray(goal.position, dtype=float))
    turned = "" if goal.quaternion is None else " in that orientation"
    return (
        f'no posture within the limits brings link "{goal.link}" to ({place}){turned}; '
        f"{_nearest_approach(robot, goal, root, near, seed)}"
    )


def _nearest_approach(robot: SphereRobot, goal: PoseGoal, root: Array, near: Array, seed: int) -> str:
    from roboyard.kinematics import forward_kinematics, solve_ik

    chain = tips_chain(robot, [goal.link])
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


def tips_chain(robot: SphereRobot, links: Sequence[str]) -> ChainArrays:
    """Return the chain of a robot with these links as its tips.

    Raises:
        ConfigError: a link does not exist, or no joint of the group moves it.
    """
    chain, name = robot.chain, robot.model.description.name
    tips = []
    for link in links:
        if link not in chain.links:
            raise ConfigError(f"{name}: {unknown_name('link', link, chain.links)}")
        index = chain.link(link)
        if chain.link_node[index] < 0:
            raise ConfigError(
                f'{name}: link "{link}" is moved by none of the joints {", ".join(robot.joint_names)}; '
                "choose another link or group"
            )
        tips.append(index)
    return replace(chain, tips=np.array(tips, dtype=np.int64))


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
