"""Motions that the skills share: to a track's base and first posture, along a track, and straight ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from roboyard.planning.live_world import WorldObstacles
from roboyard.planning.planner import Planner
from roboyard.sim.body import Body
from roboyard.skills.driving import drive
from roboyard.skills.gripper_frame import shifted
from roboyard.skills.motion import follow, go, track_motion
from roboyard.skills.outcome import SkillError
from roboyard.skills.tracks import Drawn, Stage, Track, grip_at, postures_of, stage_robot
from roboyard.skills.worker import Worker
from roboyard.transforms import Array

MOST_TRACKS = 4
"""Tracks of which one must be within reach of the base's path."""


def whole_planner(worker: Worker, arm: str, ignored: Sequence[Body] = ()) -> tuple[Planner, WorldObstacles]:
    """Return the planner of base, trunk and an arm, and its obstacles but for some bodies."""
    made = worker.planner(arm, torso=True, base=True, ignored=ignored)
    return made.planner(), made.surroundings


def approach(worker: Worker, tracks: Sequence[Track]) -> Track:
    """Drive to the base of one of some tracks, and move the arm to its first posture; return the track.

    Raises:
        SkillError: none can be reached.
    """
    last = SkillError("no posture is within reach")
    for track in tracks[:MOST_TRACKS]:
        try:
            if worker.base_joints:
                drive(worker, [track.base])
            names = [name for name in track.names if name not in worker.base_joints]
            goal = track.postures[0, len(worker.base_joints) :]
            planner = worker.planner(track.arm, torso=True)
            order = [names.index(name) for name in planner.joint_names]
            go(worker, goal[order], track.arm, torso=True)
            return track
        except SkillError as error:
            last = error
    raise last


def run(worker: Worker, track: Track, first: int, last: int, robot: Any) -> None:
    """Move along the poses `first` to `last` of a track."""
    dense, grips = [track.postures[first]], [track.grips[first]]
    for k in range(first, last):
        for share in (0.5, 1.0):
            posture = track.postures[k] + share * (track.postures[k + 1] - track.postures[k])
            dense.append(posture)
            grips.append(grip_at(worker, track.arm, robot, posture, track.names))
    motion = track_motion(track.names, np.array(dense), np.array(grips))
    follow(worker, motion, arm=track.arm, chain=robot.chain)


def back(worker: Worker, arm: str, distance: float) -> None:
    """Move a gripper along its axis by a distance (m) where postures allow it; fingers may touch objects."""
    grip = worker.grip_pose(arm)
    steps = np.linspace(0.0, distance, 4)
    slide(worker, arm, [shifted(grip, float(step)) for step in steps])


def slide(worker: Worker, arm: str, grips: Sequence[Array]) -> bool:
    """Move a gripper through poses (4, 4) with the base at rest; return whether postures were found."""
    planner, _ = whole_planner(worker, arm)
    robot = stage_robot(worker, planner, arm)
    free = Stage(stage_robot(worker, planner, arm, bare=robot.links[1:]), planner.obstacles)
    names = worker.trunk_joints
    row = np.array(grips)[None]
    bases = np.repeat(worker.base[None, None], len(grips), axis=1)
    trunk = worker.positions(names) if names else np.zeros(0)
    tracks = tracks_here(worker, arm, Drawn(grips=row, bases=bases, cost=np.zeros(1)), trunk, free)
    if not tracks:
        return False
    run(worker, tracks[0], 0, len(grips) - 1, robot)
    return True


def tracks_here(worker: Worker, arm: str, drawn: Drawn, trunk: Array, stage: Stage) -> list[Track]:
    """Return the tracks that an arm can follow from where the robot stands, the present posture first.

    Args:
        worker: the robot.
        arm: name of the arm.
        drawn: gripper poses, with the base where it is.
        trunk: (n,) positions of the trunk's joints (rad or m).
        stage: robot and obstacles.
    """
    return postures_of(worker, arm, drawn, trunk, [stage] * drawn.grips.shape[1], parked=False)[0]
