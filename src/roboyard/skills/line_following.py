"""Moving a gripper along lines over surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from roboyard.skills.gripper_frame import pointing, shifted
from roboyard.skills.lines import dense_line, distance_from_line
from roboyard.skills.outcome import SkillError
from roboyard.skills.stance import trunk_postures
from roboyard.skills.track_moves import approach, run, whole_planner
from roboyard.skills.tracks import Drawn, Stage, Track, bases_around, find_tracks, stage_robot
from roboyard.skills.worker import Worker
from roboyard.transforms import Array

MOST_LEAN = 0.7
"""Largest lean of a gripper on a line, as the tangent of an angle."""


def follow_line(
    worker: Worker, points: Array, along: Array, arms: Sequence[str], random: np.random.Generator
) -> float:
    """Move a gripper through (k, 3) points (m), pointing `along` (3,); return the largest deviation (m).

    Raises:
        SkillError: the line is not within reach, or the gripper left it.
    """
    line = dense_line(points)
    tracks: list[Track] = []
    robot: Any = None
    for arm in arms:
        planner, _ = whole_planner(worker, arm)
        robot = stage_robot(worker, planner, arm)
        stage = Stage(robot, planner.obstacles)
        draw = partial(_draw_lines, worker, line, along)
        trunks = trunk_postures(worker, arm, float(line[:, 2].mean()))
        tracks = find_tracks(worker, arm, draw, trunks, [stage] * (len(line) + 2), random)
        if tracks:
            break
    if not tracks:
        raise SkillError(f"no arm of {', '.join(arms)} reaches the whole line; make it shorter")
    track = approach(worker, tracks)
    worst = 0.0
    watch = worker.watch
    begun = False

    def measure() -> None:
        nonlocal worst
        watch()
        if begun:
            at = worker.grip_pose(track.arm)[:3, 3]
            worst = max(worst, distance_from_line(at, line))

    worker.watch = measure
    try:
        run(worker, track, 0, 1, robot)
        begun = True
        run(worker, track, 1, len(line), robot)
        begun = False
        run(worker, track, len(line), len(line) + 1, robot)
    finally:
        worker.watch = watch
    return worst


def _draw_lines(worker: Worker, line: Array, along: Array, draws: Array) -> Drawn:
    count, k = len(draws), len(line) + 2
    grips, cost = np.empty((count, k, 4, 4)), np.empty(count)
    for s, (turn, tilt, about) in enumerate(draws[:, 4:7]):
        side = np.cross(along, (np.cos(2 * np.pi * turn), np.sin(2 * np.pi * turn), 0.3))
        lean = np.cross(along, (np.cos(2 * np.pi * about), np.sin(2 * np.pi * about), 0.3))
        way = along / np.linalg.norm(along) + MOST_LEAN * tilt * lean / np.linalg.norm(lean)
        row = [pointing(way, side, at) for at in line]
        grips[s] = [shifted(row[0], -0.08), *row, shifted(row[-1], -0.08)]
        cost[s] = 0.3 * tilt
    middle = np.repeat(line.mean(axis=0)[None], count, axis=0)
    bases = bases_around(worker, middle, np.full(count, np.nan), draws)
    return Drawn(grips=grips, bases=np.repeat(bases[:, None], k, axis=1), cost=cost)
