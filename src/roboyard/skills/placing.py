"""Placing objects on top of others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from roboyard.planning.body_points import body_points
from roboyard.sim.body import Body
from roboyard.skills.grasping import held_body, is_between_fingers
from roboyard.skills.gripper_frame import heading, shifted
from roboyard.skills.outcome import SkillError
from roboyard.skills.places import DROP, surface_spots
from roboyard.skills.stance import trunk_postures
from roboyard.skills.track_moves import approach, run, whole_planner
from roboyard.skills.tracks import Drawn, Stage, Track, bases_around, find_tracks, postures_of, stage_robot
from roboyard.skills.worker import Worker
from roboyard.transforms import Array, inverse_pose

ASIDE = 50.0
"""Cost of placing an object a metre beside where it was asked to be."""
MOST_ASIDE = 0.03
"""Largest distance of a placed object from where the gripper let it go (m)."""
LOWEST = 0.02
"""Height of the part of an object that counts as its foot (m)."""
SLIGHT, MOST_SLID = 0.0005, 0.06
"""Range of what an object slides in the gripper on its way that is made up for above its spot (m)."""


def place(worker: Worker, arm: str, support: Body, random: np.random.Generator, at: Array | None) -> Array:
    """Place what an arm holds on top of a body, near (2,) `at` (m); return the (3,) point below it (m).

    Raises:
        SkillError: there is no free spot within reach, or the object did not stay.
    """
    body = held_body(worker, arm)
    points = body_points(body)
    foot = points[points[:, 2] < points[:, 2].min() + LOWEST]
    radius = 0.5 * float(np.ptp(foot, axis=0)[:2].max())
    above = (body, worker.robot.body)
    spots = surface_spots(worker.world, support, max(radius, 0.01), random, 150, at, above)
    if not spots:
        raise SkillError(f'"{support.name}" has no free level spot for it; clear one')
    grip, bottom = worker.grip_pose(arm), _foot(body)
    planner, _ = whole_planner(worker, arm)
    robot = stage_robot(worker, planner, arm)
    full = Stage(robot, planner.obstacles)
    bare = Stage(stage_robot(worker, planner, arm, bare=[worker.gripper(arm).tool]), planner.obstacles)
    heights, backs = (0.12, 0.06, DROP), (-0.06, -0.12)
    stages = [full, full, bare, bare, bare]

    def draw(spots: Sequence[Array], draws: Array) -> Drawn:
        grips, facing = np.empty((len(draws), len(stages), 4, 4)), np.empty(len(draws))
        cost = np.zeros(len(draws))
        for s, (which, turn) in enumerate(draws[:, 4:6]):
            spot = spots[int(min(len(spots) - 1, which * len(spots)))]
            cost[s] = 0.0 if at is None else ASIDE * float(np.hypot(*(spot[:2] - at)))
            c, n = np.cos(2 * np.pi * turn), np.sin(2 * np.pi * turn)
            motion = np.eye(4)
            motion[:2, :2] = ((c, -n), (n, c))
            motion[:3, 3] = spot - motion[:3, :3] @ bottom
            row = []
            for height in heights:
                row.append(motion @ grip)
                row[-1][2, 3] += height
            grips[s] = [*row, *(shifted(row[-1], back) for back in backs)]
            facing[s] = heading(row[0])
        bases = bases_around(worker, grips[:, 2, :3, 3], facing, draws)
        bases = np.repeat(bases[:, None], len(stages), axis=1)
        return Drawn(grips=grips, bases=bases, cost=cost)

    height = float(spots[0][2] + grip[2, 3] - bottom[2])
    trunks = trunk_postures(worker, arm, height)

    def go_to(choice: Sequence[Array]) -> Track:
        tracks = find_tracks(worker, arm, partial(draw, choice), trunks, stages, random)
        if not tracks:
            raise SkillError(f'no free spot on "{support.name}" is within reach; clear one near its edge')
        return approach(worker, tracks)

    try:
        track = go_to(spots if at is None else spots[:1])  # the nearest spot before all others
    except SkillError:
        if at is None or len(spots) == 1:
            raise
        track = go_to(spots)
    wanted = _moved(track.grips[2] @ inverse_pose(grip), bottom)
    run(worker, track, 0, 1, robot)
    lacks = wanted - _foot(body)
    lacks[2] += heights[1] - DROP
    track = _corrected(worker, track, lacks, stages[1:])
    run(worker, track, 1, 2, robot)
    if not is_between_fingers(worker, arm, body):
        worker.release(arm)
        raise SkillError("it slipped out of the gripper on the way", is_final=True)
    worker.grip(arm, close=False)
    worker.release(arm)
    try:
        run(worker, track, 2, len(track.grips) - 1, robot)
    except SkillError as error:
        raise SkillError(
            f"it was let go, but the gripper did not come away: {error}", is_final=True
        ) from None
    worker.wait(0.5)
    stands = _foot(body)
    gap = abs(float(stands[2]) - float(wanted[2]) + DROP)
    if gap > 0.02:
        raise SkillError(
            f'it does not stand on "{support.name}": it is {100 * gap:.0f} cm off in height', is_final=True
        )
    aside = float(np.hypot(*(stands - wanted)[:2]))
    if aside > MOST_ASIDE:
        raise SkillError(
            f'it moved on "{support.name}" when it was let go: it is {100 * aside:.0f} cm beside its spot',
            is_final=True,
        )
    return stands


def _foot(body: Body) -> Array:
    """Return the (3,) middle of a body's lowest points (m), at the height of the lowest one."""
    points = body_points(body)
    low = points[:, 2].min()
    foot = points[points[:, 2] < low + LOWEST]
    x, y, _ = 0.5 * (foot.min(axis=0) + foot.max(axis=0))
    return np.array([x, y, low])


def _moved(motion: Array, point: Array) -> Array:
    """Return a (3,) point moved by a (4, 4) motion."""
    return motion[:3, :3] @ point + motion[:3, 3]


def _corrected(worker: Worker, track: Track, error: Array, stages: Sequence[Stage]) -> Track:
    """Return a track whose poses after the first two make up for what the object slid in the gripper.

    Args:
        worker: the robot, at the track's second pose.
        track: the way that was planned.
        error: (3,) motion that the object lacks (m); the track stays as it is for less than 0.5 mm, and where
            no posture is found.
        stages: what is checked at the second pose and later.
    """
    if not SLIGHT < float(np.linalg.norm(error)) < MOST_SLID:
        return track
    grips = track.grips[1:].copy()
    grips[0] = worker.grip_pose(track.arm)
    grips[1:, :3, 3] += error
    trunk = worker.positions(worker.trunk_joints) if worker.trunk_joints else np.zeros(0)
    for count in range(len(grips), 2, -1):  # a shorter way back where the whole is out of reach
        bases = np.repeat(worker.base[None, None], count, axis=1)
        drawn = Drawn(grips=grips[None, :count], bases=bases, cost=np.zeros(1))
        found, _ = postures_of(worker, track.arm, drawn, trunk, stages[:count], parked=False)
        if found:
            postures = np.concatenate([track.postures[:1], found[0].postures])
            return replace(track, postures=postures, grips=np.concatenate([track.grips[:1], grips[:count]]))
    return track
