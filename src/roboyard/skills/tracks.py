"""Postures of base, trunk and arm with which a gripper passes given poses, clear of everything.

A track is a row of gripper poses: before a handle, at it, along the drawer's way, away from it. Many tracks
are drawn at once (which grasp, where the base stands, how far it moves with the gripper), their postures
follow from inverse kinematics of the arm, and those that touch something are dropped.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from roboyard._arrays import NDArray
from roboyard.kinematics import forward_kinematics, solve_ik_batch
from roboyard.planning.checking import CollisionChecker
from roboyard.planning.obstacles import Obstacles
from roboyard.planning.planner import Planner
from roboyard.planning.spheres.sphere_model import SphereModel, SphereRobot, sphere_robot
from roboyard.skills.worker import Worker
from roboyard.transforms import Array, inverse_pose

JUMP = 0.9
"""Largest change of an arm joint from one pose of a track to the next (rad)."""
DRAWS, DRAWN = 700, 10
"""Tracks drawn in one round, and numbers that each is made of."""
ROUNDS, ENOUGH = 12, 4
"""Rounds at most, and tracks that end the search."""
VARIED, SPREAD, FRESH = 46, 0.06, 100
"""Draws that came farthest and are varied, by how much, and how many of each round are new instead."""
CLEAR = 0.015
"""Distance that a robot keeps where it parks (m)."""
NEAREST, FARTHEST = 0.30, 1.05
"""Distances of the base's middle from where the gripper works (m)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Drawn:
    """Tracks drawn at random: s tracks of k poses."""

    grips: Array
    """(s, k, 4, 4) poses of the gripper frame in the world frame (m)."""
    bases: Array
    """(s, k, 3) base joints (m, m, rad)."""
    cost: Array
    """(s,) cost of what was drawn."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Track:
    """Postures along one row of gripper poses."""

    arm: str
    names: tuple[str, ...]
    """Joints of base, trunk and arm."""
    postures: Array
    """(k, n) rad or m."""
    grips: Array
    """(k, 4, 4) poses of the gripper frame in the world frame (m)."""
    cost: float

    @property
    def base(self) -> Array:
        """(3,) base joints at the first pose."""
        return self.postures[0, :3]


class Stage:
    """Robot and obstacles that a track's postures are checked with at one of its poses."""

    def __init__(self, robot: SphereRobot, obstacles: Obstacles) -> None:
        """Create a stage; several may share obstacles."""
        self.checker = CollisionChecker(robot, obstacles)

    def free(self, postures: Array, margin: float = 0.0) -> NDArray[np.bool_]:
        """Return (s,) booleans for postures (s, n) in `robot.joint_names` order, clear by a margin (m)."""
        return self.checker.free(postures, margin)


def whole_group(worker: Worker, arm: str) -> tuple[str, ...]:
    """Return the joints of base, trunk and one arm."""
    return (*worker.base_joints, *worker.trunk_joints, *worker.arm_joints(arm))


def without(model: SphereModel, links: Sequence[str]) -> SphereModel:
    """Return a model without the spheres of links that are to touch something."""
    return replace(model, spheres={name: own for name, own in model.spheres.items() if name not in links})


def stage_robot(
    worker: Worker, planner: Planner, arm: str | None, *, bare: Sequence[str] = ()
) -> SphereRobot:
    """Return the spheres of the whole robot, moved by base, trunk and one arm.

    Wheels and feet, which stand on the floor, and the links `bare` have no spheres.
    """
    names = worker.base_joints if arm is None else whole_group(worker, arm)
    state = worker.state()
    held = {name: value for name, value in state.items() if name not in names}
    model = without(planner.robot.model, (*worker.standing, *bare))
    return sphere_robot(model, names, held, around=state)


def bases_around(worker: Worker, points: Array, facing: Array, draws: Array) -> Array:
    """Return (s, 3) base joints from which the gripper may reach (s, 3) points (m).

    Args:
        worker: the robot; without a base that drives, all are zero.
        points: where the gripper works, in the world frame.
        facing: (s,) directions of approach around the vertical (rad), NaN for any.
        draws: (s, 4) numbers from 0 to 1. A fifth of the bases stay where they are.
    """
    count = len(points)
    if not worker.base_joints:
        return np.zeros((count, 3))
    middle = (draws[:, 0] - 0.5) * 3.0
    angle = np.where(np.isnan(facing), (draws[:, 0] - 0.5) * 2 * np.pi, facing + middle)
    distance = NEAREST + draws[:, 1] * (FARTHEST - NEAREST)
    yaw = angle + (draws[:, 2] - 0.5) * 2.0
    away = distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    out = worker.bases_at(points[:, :2] - away, yaw)
    out[draws[:, 3] < 0.2] = worker.base
    return out


def find_tracks(
    worker: Worker,
    arm: str,
    draw: Callable[[Array], Drawn],
    trunks: Sequence[Array],
    stages: Sequence[Stage],
    random: np.random.Generator,
) -> list[Track]:
    """Return tracks whose postures exist and touch nothing, cheapest first; empty where none was found.

    Draws that came far are varied in later rounds.

    Args:
        worker: the robot.
        arm: the arm that moves.
        draw: returns tracks for (s, 10) numbers from 0 to 1.
        trunks: postures (n,) of the trunk, in the order in which they are tried (rad or m).
        stages: what is checked at each pose.
        random: source of the draws.
    """
    for trunk in trunks:
        draws = random.random((DRAWS, DRAWN))
        best, came = np.empty((0, DRAWN)), np.empty(0)
        found: list[Track] = []
        for _ in range(ROUNDS):
            more, depth = postures_of(worker, arm, draw(draws), trunk, stages)
            found = sorted([*found, *more], key=lambda track: track.cost)
            if len(found) >= ENOUGH:
                break
            best, came = np.concatenate([best, draws[depth > 0]]), np.concatenate([came, depth[depth > 0]])
            far = np.argsort(-came, kind="stable")[:VARIED]
            best, came = best[far], came[far]
            draws = random.random((DRAWS, DRAWN))
            if len(best):
                near = best[random.integers(len(best), size=DRAWS - FRESH)]
                draws[FRESH:] = np.clip(near + random.normal(size=near.shape) * SPREAD, 0.0, 1.0)
        if found:
            return found
    return []


def postures_of(
    worker: Worker, arm: str, drawn: Drawn, trunk: Array, stages: Sequence[Stage], *, parked: bool = True
) -> tuple[list[Track], Array]:
    """Return the tracks whose postures exist and touch nothing, cheapest first, and how far each came.

    Args:
        worker: the robot.
        arm: the arm that moves.
        drawn: gripper poses and bases.
        trunk: positions (n,) of the trunk's joints during the track (rad or m).
        stages: one for each pose.
        parked: the first base must also be free with arm and trunk as they are now; otherwise the robot is at
            the first pose already, and postures go on from where the arm is.
    """
    names = whole_group(worker, arm)
    order = _order(names, stages[0].checker.robot)
    arms = worker.arm_joints(arm)
    kept, depth = np.arange(len(drawn.cost)), np.zeros(len(drawn.cost))
    if parked and worker.base_joints:
        now = np.concatenate([worker.base, worker.positions(names[len(worker.base_joints) :])])
        rows = np.repeat(now[None], len(kept), axis=0)
        rows[:, :3] = drawn.bases[:, 0]
        here = np.abs(drawn.bases[:, 0] - worker.base).max(axis=1) < 0.01
        kept = kept[stages[0].free(rows[:, order], CLEAR) | here]
    held = worker.state() | dict.fromkeys(worker.base_joints, 0.0)
    held |= dict(zip(worker.trunk_joints, trunk, strict=True))
    robot = sphere_robot(
        stages[0].checker.robot.model,
        arms,
        {k: v for k, v in held.items() if k not in arms},
        tips=[worker.gripper(arm).tool],
    )
    chain, into = robot.chain, [arms.index(name) for name in robot.chain.joint_names]
    rest = worker.robot.reset_joint_pos[[worker.robot.joint_names.index(n) for n in chain.joint_names]]
    present = worker.positions(chain.joint_names)
    tools = worker.gripper(arm).tool_pose(drawn.grips)
    found: list[Array] = []
    for k, stage in enumerate(stages):
        if not len(kept):
            return [], depth
        motion = worker.root @ worker.base_matrix(drawn.bases[kept, k])
        targets = np.linalg.inv(motion) @ tools[kept, k]
        if found:
            q0, restarts = found[-1], 0
        elif parked:  # one half from either posture
            q0, restarts = np.where(np.arange(len(kept))[:, None] % 2, present, rest), 3
        else:  # the arm is there: another elbow would be a jump
            q0, restarts = np.repeat(present[None], len(kept), axis=0), 0
        result = solve_ik_batch(chain, targets, q0, iterations=40, restarts=restarts, seed=k)
        good = result.converged.copy()
        if found:
            good &= np.abs(result.q - found[-1]).max(axis=1) < JUMP
        rows = np.empty((len(kept), len(names)))
        base, mid = len(worker.base_joints), len(names) - len(arms)
        rows[:, :base] = drawn.bases[kept, k][:, :base]
        rows[:, base:mid] = trunk
        for i, j in enumerate(into):
            rows[:, mid + j] = result.q[:, i]
        good[good] = stage.free(rows[good][:, order], CLEAR if k == 0 and parked else 0.0)
        kept = kept[good]
        depth[kept] = k + 1
        found = [q[good] for q in found] + [result.q[good]]
    cost = drawn.cost[kept] + _posture_cost(found, chain.lower, chain.upper, rest)
    cost = cost + _drive_cost(worker, drawn.bases[kept])
    tracks = []
    for row in np.argsort(cost):
        postures = np.empty((len(stages), len(names)))
        base, mid = len(worker.base_joints), len(names) - len(arms)
        postures[:, :base] = drawn.bases[kept[row]][:, :base]
        postures[:, base:mid] = trunk
        for i, j in enumerate(into):
            postures[:, mid + j] = [q[row, i] for q in found]
        tracks.append(
            Track(
                arm=arm, names=names, postures=postures, grips=drawn.grips[kept[row]], cost=float(cost[row])
            )
        )
    return tracks, depth


def _order(names: Sequence[str], robot: SphereRobot) -> list[int]:
    """Return the entries of `names` in the order of the robot's arrays."""
    return [list(names).index(name) for name in robot.joint_names]


def _posture_cost(found: Sequence[Array], lower: Array, upper: Array, rest: Array) -> Array:
    """Return (s,) costs of postures far from rest and near limits, and of moving much."""
    far = sum(np.abs(q - rest).mean(axis=1) for q in found) / len(found)
    room = np.minimum.reduce([np.minimum(q - lower, upper - q).min(axis=1) for q in found])
    moved = np.zeros(len(room))
    for a, b in pairwise(found):
        moved += np.abs(b - a).max(axis=1)
    return 0.15 * far + 0.5 * np.maximum(0.15 - room, 0.0) + 0.05 * moved


def _drive_cost(worker: Worker, bases: Array) -> Array:
    """Return (s,) costs of driving to the first base, and of driving during the track."""
    first = bases[:, 0] - worker.base
    own = np.abs(np.diff(bases, axis=1)).sum(axis=(1, 2))
    return 0.1 * np.linalg.norm(first[:, :2], axis=1) + 0.05 * np.abs(first[:, 2]) + 0.1 * own


def grip_at(worker: Worker, arm: str, robot: SphereRobot, posture: Array, names: Sequence[str]) -> Array:
    """Return the (4, 4) pose of the gripper frame in the world frame (m) for a posture of a track."""
    q = posture[_order(names, robot)]
    tool = worker.root @ forward_kinematics(robot.chain, q, worker.gripper(arm).tool)
    return tool @ worker.gripper(arm).offset


def moved_with(grips: Array, fraction: Array, turn: Array, bases: Array, worker: Worker) -> Array:
    """Return (s, k, 3) base joints that follow a share of the gripper's motion over the ground.

    Args:
        grips: (s, k, 4, 4) gripper poses in the world frame.
        fraction: (s,) share of the gripper's translation since the first pose.
        turn: (s, k) turn of the base since the first pose (rad).
        bases: (s, 3) bases at the first pose.
        worker: the robot.
    """
    out = np.repeat(bases[:, None], grips.shape[1], axis=1)
    if worker.base_joints:
        shift = (grips[:, :, :3, 3] - grips[:, :1, :3, 3]) @ worker.root[:3, :3]
        out[:, :, :2] += fraction[:, None, None] * shift[:, :, :2]
        out[:, :, 2] += turn
    return out


def relative(pose: Array, to: Array) -> Array:
    """Return a (4, 4) pose in the frame of another."""
    return inverse_pose(to) @ pose
