"""Grasping, lifting and carrying objects."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from roboyard.planning.body_points import body_points
from roboyard.sim.body import Body
from roboyard.skills.grasps import Grasp, object_grasps
from roboyard.skills.gripper_frame import heading, shifted
from roboyard.skills.outcome import SkillError
from roboyard.skills.stance import trunk_postures
from roboyard.skills.track_moves import MOST_TRACKS, approach, back, run, slide, tracks_here, whole_planner
from roboyard.skills.tracks import Drawn, Stage, Track, bases_around, find_tracks, stage_robot
from roboyard.skills.worker import Worker
from roboyard.transforms import Array, inverse_pose, pose_matrix

APPROACH = (-0.12, -0.08, -0.04, 0.0)
"""Distances from an object at which the gripper stops before it holds it (m)."""
LIFTS = (0.05, 0.12)
"""Heights by which an object must be liftable (m)."""
INWARD = (0.0, 0.03, 0.06, 0.1)
"""Ways by which a lifted gripper nears the base where the arm does not reach straight up (m)."""


def grasp(worker: Worker, body: Body, arms: Sequence[str], random: np.random.Generator) -> str:
    """Grasp a body with one of some arms; return the arm.

    Raises:
        SkillError: the body cannot be held, or is not within reach, or is not between the fingers afterwards.
    """
    options: list[tuple[Track, Any]] = []
    reason = f"no arm of {', '.join(arms)} reaches it; move it or the robot"
    for arm in arms:
        grasps = object_grasps(body_points(body), worker.gripper(arm))
        if not grasps:
            wide = 100 * worker.gripper(arm).opening
            reason = (
                f"it is wider than the {wide:.0f} cm between the fingers at every height; push it instead"
            )
            continue
        planner, _ = whole_planner(worker, arm, [body])
        robot = stage_robot(worker, planner, arm)
        stage = Stage(robot, planner.obstacles)
        trunks = trunk_postures(worker, arm, float(grasps[0].pose[2, 3]))
        stages = [stage] * (len(APPROACH) + len(LIFTS))
        draw = partial(_draw_grasps, worker, grasps)
        tracks = find_tracks(worker, arm, draw, trunks, stages, random)
        options += [(track, robot) for track in tracks[:MOST_TRACKS]]
    if not options:
        raise SkillError(reason)
    options.sort(key=lambda option: option[0].cost)
    worker.grip(options[0][0].arm, close=False, seconds=0.3)
    track = approach(worker, [track for track, _ in options])
    robot = next(robot for one, robot in options if one is track)
    closed = len(APPROACH) - 1
    before = np.array(body.position)
    try:
        run(worker, track, 0, closed, robot)
        worker.grip(track.arm, close=True)
        if not is_between_fingers(worker, track.arm, body):
            moved = 100 * float(np.linalg.norm(body.position - before))
            raise SkillError(f"the fingers closed beside it, and it moved by {moved:.0f} cm")
    except SkillError:
        worker.grip(track.arm, close=False)
        back(worker, track.arm, -0.14)
        raise
    worker.take(track.arm, body)
    return track.arm


def _draw_grasps(worker: Worker, grasps: list[Grasp], draws: Array) -> Drawn:
    place = np.minimum(len(grasps) - 1, draws[:, 4] ** 2 * len(grasps)).astype(int)
    poses = np.array([grasp.pose for grasp in grasps])[place]
    cost = 6.0 * np.array([grasp.cost for grasp in grasps])[place]
    facing = np.array([heading(grasp.pose) for grasp in grasps])[place]
    lifted = np.repeat(poses[:, None], len(LIFTS), axis=1)
    lifted[:, :, 2, 3] += LIFTS
    grips = np.concatenate([np.stack([shifted(poses, away) for away in APPROACH], axis=1), lifted], axis=1)
    bases = bases_around(worker, grips[:, len(APPROACH) - 1, :3, 3], facing, draws)
    k = grips.shape[1]
    return Drawn(grips=grips, bases=np.repeat(bases[:, None], k, axis=1), cost=cost)


def is_between_fingers(worker: Worker, arm: str, body: Body) -> bool:
    """Return whether at least two fingers touch a body."""
    fingers = set(worker.gripper(arm).fingers)
    worker.world.detect_contacts()  # those of the last step are gone where a body was added since
    touching = {c.link_a.name for c in worker.world.contacts(worker.robot.body, body)}
    return len(fingers & touching) >= 2


def lift(worker: Worker, arm: str, height: float) -> None:
    """Lift what an arm holds by a height (m).

    Raises:
        SkillError: the arm holds nothing, cannot lift that high, or lost the object.
    """
    body = held_body(worker, arm)
    start = float(body.position[2])
    if not any(slide(worker, arm, _raised(worker, arm, height, inward)) for inward in INWARD):
        raise SkillError(f"the arm does not reach {100 * height:.0f} cm higher; lift less")
    worker.wait(0.3)
    risen = float(body.position[2]) - start
    if risen < 0.5 * height or not is_between_fingers(worker, arm, body):
        worker.release(arm)
        raise SkillError(f"it slipped out of the gripper: it rose by {100 * risen:.0f} cm")


def _raised(worker: Worker, arm: str, height: float, inward: float) -> list[Array]:
    """Return gripper poses straight up by a height (m), and towards the base by `inward` (m)."""
    grip = worker.grip_pose(arm)
    to_base = worker.robot.pose[0][:2] - grip[:2, 3]
    step = np.append(inward * to_base / max(float(np.linalg.norm(to_base)), 1e-9), height)
    rows = np.repeat(grip[None], 5, axis=0)
    rows[:, :3, 3] += np.linspace(0.0, 1.0, 5)[:, None] * step
    return list(rows)


def held_body(worker: Worker, arm: str) -> Body:
    """Return what an arm holds.

    Raises:
        SkillError: nothing.
    """
    if arm not in worker.held:
        raise SkillError(f'arm "{arm}" holds nothing; grasp something first')
    return worker.held[arm].body


def carry(worker: Worker, arm: str) -> bool:
    """Bring what an arm holds near the body, upright as it is; return whether that was possible."""
    grip = worker.grip_pose(arm)
    mount = pose_matrix(*worker.robot.link(worker.mount(arm)).pose)
    base = pose_matrix(*worker.robot.pose)
    side = float(np.sign((inverse_pose(base) @ mount)[1, 3] or 1.0))
    shoulder = worker.robot.link(worker.robot.description.joint_by_name[worker.arm_joints(arm)[0]].child)
    heights = (float(grip[2, 3]), float(shoulder.pose[0][2]) - 0.2)
    for ahead in (0.40, 0.45, 0.5):
        for height in heights:
            goal = grip.copy()
            goal[:3, 3] = base[:3, :3] @ (ahead, 0.25 * side, 0.0) + base[:3, 3]
            goal[2, 3] = max(height, float(grip[2, 3]))
            row = [grip + share * (goal - grip) for share in np.linspace(0, 1, 8)]
            planner, _ = whole_planner(worker, arm)
            robot = stage_robot(worker, planner, arm)
            stage = Stage(robot, planner.obstacles)
            bases = np.repeat(worker.base[None, None], len(row), axis=1)
            drawn = Drawn(grips=np.array(row)[None], bases=bases, cost=np.zeros(1))
            trunk = worker.positions(worker.trunk_joints) if worker.trunk_joints else np.zeros(0)
            tracks = tracks_here(worker, arm, drawn, trunk, stage)
            if tracks:
                run(worker, tracks[0], 0, len(row) - 1, robot)
                return True
    return False
