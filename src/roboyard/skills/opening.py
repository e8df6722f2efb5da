"""Opening and closing drawers and doors by their handles."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from roboyard.sim.joint import Joint
from roboyard.skills.grasps import handle_grasps
from roboyard.skills.joint_tracks import AFTER, BEFORE, draw_joint_tracks, way_of
from roboyard.skills.outcome import SkillError
from roboyard.skills.stance import trunk_postures
from roboyard.skills.track_moves import MOST_TRACKS, approach, back, run, whole_planner
from roboyard.skills.tracks import Stage, Track, find_tracks, stage_robot
from roboyard.skills.worker import Worker


def move_joint(
    worker: Worker, joint: Joint, goal: float, arms: Sequence[str], random: np.random.Generator
) -> float:
    """Move a drawer or a door to a position (rad or m) by its handle; return where it ended.

    Raises:
        SkillError: there is no handle within reach, or the joint did not follow.
    """
    way = way_of(joint, goal)
    options: list[tuple[Track, Any]] = []
    reason = f"no arm of {', '.join(arms)} reaches its handle along the whole way; open it less far"
    for arm in arms:
        gripper = worker.gripper(arm)
        grasps = handle_grasps(joint.child, gripper)
        if not grasps:
            reason = "it has no handle that fits between the fingers; push it instead"
            continue
        planner, surroundings = whole_planner(worker, arm)
        robot = stage_robot(worker, planner, arm)
        open_fingers = stage_robot(worker, planner, arm, bare=(*gripper.fingers, worker.palm(arm)))
        stages = [Stage(robot, planner.obstacles)] + [Stage(open_fingers, planner.obstacles)] * (
            len(BEFORE) - 1
        )
        for value in way.values[1:]:
            there = surroundings.with_moved(way.geoms, way.motion(float(value)))
            stages.append(Stage(open_fingers, there))
        stages += [stages[-1]] * len(AFTER)
        trunks = trunk_postures(worker, arm, float(grasps[0].pose[2, 3]))
        draw = partial(draw_joint_tracks, worker, way, grasps)
        tracks = find_tracks(worker, arm, draw, trunks, stages, random)
        options += [(track, robot) for track in tracks[:MOST_TRACKS]]
    if not options:
        raise SkillError(reason)
    options.sort(key=lambda option: option[0].cost)
    worker.grip(options[0][0].arm, close=False, seconds=0.3)
    track = approach(worker, [track for track, _ in options])
    robot = next(robot for one, robot in options if one is track)
    closed, last = len(BEFORE) - 1, len(track.postures) - 1
    opened = last - len(AFTER)
    failure: SkillError | None = None
    try:
        run(worker, track, 0, closed, robot)
        worker.grip(track.arm, close=True)
        run(worker, track, closed, opened, robot)
    except SkillError as error:
        failure = error
    worker.grip(track.arm, close=False)
    try:
        if failure is None:
            run(worker, track, opened, last, robot)
        else:
            back(worker, track.arm, -0.12)
    except SkillError as error:
        failure = failure or error
    reached = float(joint.position)
    start = float(way.values[0])
    if abs(reached - goal) > 0.25 * abs(goal - start):
        unit = "rad" if way.is_hinge else "m"
        cause = f": {failure}" if failure else "; the gripper slipped off the handle"
        raise SkillError(f"it moved to {reached:.2f} {unit} of {goal:.2f} {unit}{cause}")
    return reached
