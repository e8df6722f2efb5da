"""Grasping, lifting and placing objects; opening and closing drawers and doors; lines over surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from roboyard.planning.body_points import body_points
from roboyard.planning.live_world import WorldObstacles
from roboyard.planning.planner import Planner
from roboyard.sim.body import Body
from roboyard.sim.joint import Joint
from roboyard.skills.driving import drive
from roboyard.skills.grasps import Grasp, handle_grasps, object_grasps
from roboyard.skills.gripper_frame import heading, pointing, shifted
from roboyard.skills.joint_tracks import AFTER, BEFORE, draw_joint_tracks, way_of
from roboyard.skills.lines import dense_line, distance_from_line
from roboyard.skills.motion import follow, go, track_motion
from roboyard.skills.outcome import SkillError
from roboyard.skills.places import DROP, surface_spots
from roboyard.skills.stance import trunk_postures
from roboyard.skills.tracks import (
    Drawn,
    Stage,
    Track,
    bases_around,
    find_tracks,
    grip_at,
    postures_of,
    stage_robot,
)
from roboyard.skills.worker import Worker
from roboyard.transforms import Array, inverse_pose, pose_matrix

APPROACH = (-0.12, -0.08, -0.04, 0.0)
"""Distances from an object at which the gripper stops before it holds it (m)."""
LIFTS = (0.05, 0.12)
"""Heights by which an object must be liftable (m)."""
MOST_LEAN = 0.7
"""Largest lean of a gripper on a line, as the tangent of an angle."""
MOST_TRACKS = 4
"""Tracks of which one must be within reach of the base's path."""
ASIDE = 50.0
"""Cost of placing an object a metre beside where it was asked to be."""
MOST_ASIDE = 0.03
"""Largest distance of a placed object from where the gripper let it go (m)."""


# ---------------------------------------------------------------------------------------------- tracks


def _approach(worker: Worker, tracks: Sequence[Track]) -> Track:
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


def _run(worker: Worker, track: Track, first: int, last: int, robot: Any) -> None:
    """Move along the poses `first` to `last` of a track."""
    dense, grips = [track.postures[first]], [track.grips[first]]
    for k in range(first, last):
        for share in (0.5, 1.0):
            posture = track.postures[k] + share * (track.postures[k + 1] - track.postures[k])
            dense.append(posture)
            grips.append(grip_at(worker, track.arm, robot, posture, track.names))
    motion = track_motion(track.names, np.array(dense), np.array(grips))
    follow(worker, motion, arm=track.arm, chain=robot.chain)


def _planner(worker: Worker, arm: str, ignored: Sequence[Body] = ()) -> tuple[Planner, WorldObstacles]:
    made = worker.planner(arm, torso=True, base=True, ignored=ignored)
    return made.planner(), made.surroundings


# ---------------------------------------------------------------------------------------------- grasping


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
        planner, _ = _planner(worker, arm, [body])
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
    track = _approach(worker, [track for track, _ in options])
    robot = next(robot for one, robot in options if one is track)
    closed = len(APPROACH) - 1
    before = np.array(body.position)
    try:
        _run(worker, track, 0, closed, robot)
        worker.grip(track.arm, close=True)
        if not is_between_fingers(worker, track.arm, body):
            moved = 100 * float(np.linalg.norm(body.position - before))
            raise SkillError(f"the fingers closed beside it, and it moved by {moved:.0f} cm")
    except SkillError:
        worker.grip(track.arm, close=False)
        _back(worker, track.arm, -0.14)
        raise
    worker.take(track.arm, body)
    return track.arm


def _draw_grasps(worker: Worker, grasps: list[Grasp], draws: Array) -> Drawn:
    count, k = len(draws), len(APPROACH) + len(LIFTS)
    grips, cost, facing = np.empty((count, k, 4, 4)), np.empty(count), np.empty(count)
    for s in range(count):
        chosen = grasps[int(min(len(grasps) - 1, draws[s, 4] ** 2 * len(grasps)))]
        row = [shifted(chosen.pose, away) for away in APPROACH]
        for height in LIFTS:
            row.append(chosen.pose.copy())
            row[-1][2, 3] += height
        grips[s], cost[s] = row, 6.0 * chosen.cost
        facing[s] = heading(chosen.pose)
    bases = bases_around(worker, grips[:, len(APPROACH) - 1, :3, 3], facing, draws)
    return Drawn(grips=grips, bases=np.repeat(bases[:, None], k, axis=1), cost=cost)


def is_between_fingers(worker: Worker, arm: str, body: Body) -> bool:
    """Return whether at least two fingers touch a body."""
    fingers = set(worker.gripper(arm).fingers)
    worker.world.detect_contacts()  # those of the last step are gone where a body was added since
    touching = {c.link_a.name for c in worker.world.contacts(worker.robot.body, body)}
    return len(fingers & touching) >= 2


def _back(worker: Worker, arm: str, distance: float) -> None:
    """Move a gripper along its axis by a distance (m) where postures allow it; fingers may touch objects."""
    grip = worker.grip_pose(arm)
    steps = np.linspace(0.0, distance, 4)
    _slide(worker, arm, [shifted(grip, float(step)) for step in steps])


def _slide(worker: Worker, arm: str, grips: Sequence[Array]) -> bool:
    """Move a gripper through poses with the base at rest; return whether postures were found for them."""
    planner, _ = _planner(worker, arm)
    robot = stage_robot(worker, planner, arm)
    free = Stage(stage_robot(worker, planner, arm, bare=robot.links[1:]), planner.obstacles)
    names = worker.trunk_joints
    row = np.array(grips)[None]
    bases = np.repeat(worker.base[None, None], len(grips), axis=1)
    trunk = worker.positions(names) if names else np.zeros(0)
    tracks = _tracks_here(worker, arm, Drawn(grips=row, bases=bases, cost=np.zeros(1)), trunk, free)
    if not tracks:
        return False
    _run(worker, tracks[0], 0, len(grips) - 1, robot)
    return True


def _tracks_here(worker: Worker, arm: str, drawn: Drawn, trunk: Array, stage: Stage) -> list[Track]:
    return postures_of(worker, arm, drawn, trunk, [stage] * drawn.grips.shape[1], parked=False)[0]


def lift(worker: Worker, arm: str, height: float) -> None:
    """Lift what an arm holds by a height (m).

    Raises:
        SkillError: the arm holds nothing, cannot lift that high, or lost the object.
    """
    body = _held(worker, arm)
    start = float(body.position[2])
    grips = []
    for share in np.linspace(0.0, 1.0, 5):
        grips.append(worker.grip_pose(arm))
        grips[-1][2, 3] += share * height
    if not _slide(worker, arm, grips):
        raise SkillError(f"the arm does not reach {100 * height:.0f} cm higher; lift less")
    worker.wait(0.3)
    risen = float(body.position[2]) - start
    if risen < 0.5 * height or not is_between_fingers(worker, arm, body):
        worker.release(arm)
        raise SkillError(f"it slipped out of the gripper: it rose by {100 * risen:.0f} cm")


def _held(worker: Worker, arm: str) -> Body:
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
            planner, _ = _planner(worker, arm)
            robot = stage_robot(worker, planner, arm)
            stage = Stage(robot, planner.obstacles)
            bases = np.repeat(worker.base[None, None], len(row), axis=1)
            drawn = Drawn(grips=np.array(row)[None], bases=bases, cost=np.zeros(1))
            trunk = worker.positions(worker.trunk_joints) if worker.trunk_joints else np.zeros(0)
            tracks = _tracks_here(worker, arm, drawn, trunk, stage)
            if tracks:
                _run(worker, tracks[0], 0, len(row) - 1, robot)
                return True
    return False


def place(worker: Worker, arm: str, support: Body, random: np.random.Generator, at: Array | None) -> Array:
    """Place what an arm holds on top of a body, near (2,) `at` (m); return the (3,) point below it (m).

    Raises:
        SkillError: there is no free spot within reach, or the object did not stay.
    """
    body = _held(worker, arm)
    points = body_points(body)
    foot = points[points[:, 2] < points[:, 2].min() + 0.02]
    middle = 0.5 * (foot.min(axis=0) + foot.max(axis=0))
    radius = 0.5 * float(np.ptp(foot, axis=0)[:2].max())
    spots = surface_spots(worker.world, support, max(radius, 0.01), random, 150, at)
    if not spots:
        raise SkillError(f'"{support.name}" has no free level spot for it; clear one')
    grip, bottom = worker.grip_pose(arm), np.array([middle[0], middle[1], points[:, 2].min()])
    planner, _ = _planner(worker, arm)
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

    def approach(choice: Sequence[Array]) -> Track:
        tracks = find_tracks(worker, arm, partial(draw, choice), trunks, stages, random)
        if not tracks:
            raise SkillError(f'no free spot on "{support.name}" is within reach; clear one near its edge')
        return _approach(worker, tracks)

    try:
        track = approach(spots if at is None else spots[:1])  # the nearest spot before all others
    except SkillError:
        if at is None or len(spots) == 1:
            raise
        track = approach(spots)
    _run(worker, track, 0, 2, robot)
    if not is_between_fingers(worker, arm, body):
        worker.release(arm)
        raise SkillError("it slipped out of the gripper on the way", is_final=True)
    worker.grip(arm, close=False)
    worker.release(arm)
    try:
        _run(worker, track, 2, 4, robot)
    except SkillError as error:
        raise SkillError(
            f"it was let go, but the gripper did not come away: {error}", is_final=True
        ) from None
    worker.wait(0.5)
    motion = track.grips[2] @ inverse_pose(grip)
    wanted = motion[:3, :3] @ bottom + motion[:3, 3]
    now = body_points(body)
    gap = abs(float(now[:, 2].min()) - float(wanted[2]) + DROP)
    if gap > 0.02:
        raise SkillError(
            f'it does not stand on "{support.name}": it is {100 * gap:.0f} cm off in height', is_final=True
        )
    foot = now[now[:, 2] < now[:, 2].min() + 0.02]
    stands = 0.5 * (foot.min(axis=0) + foot.max(axis=0))
    aside = float(np.hypot(*(stands - wanted)[:2]))
    if aside > MOST_ASIDE:
        raise SkillError(
            f'it moved on "{support.name}" when it was let go: it is {100 * aside:.0f} cm beside its spot',
            is_final=True,
        )
    return stands


# ---------------------------------------------------------------------------------------------- joints


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
        planner, surroundings = _planner(worker, arm)
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
    track = _approach(worker, [track for track, _ in options])
    robot = next(robot for one, robot in options if one is track)
    closed, last = len(BEFORE) - 1, len(track.postures) - 1
    opened = last - len(AFTER)
    failure: SkillError | None = None
    try:
        _run(worker, track, 0, closed, robot)
        worker.grip(track.arm, close=True)
        _run(worker, track, closed, opened, robot)
    except SkillError as error:
        failure = error
    worker.grip(track.arm, close=False)
    try:
        if failure is None:
            _run(worker, track, opened, last, robot)
        else:
            _back(worker, track.arm, -0.12)
    except SkillError as error:
        failure = failure or error
    reached = float(joint.position)
    start = float(way.values[0])
    if abs(reached - goal) > 0.25 * abs(goal - start):
        unit = "rad" if way.is_hinge else "m"
        cause = f": {failure}" if failure else "; the gripper slipped off the handle"
        raise SkillError(f"it moved to {reached:.2f} {unit} of {goal:.2f} {unit}{cause}")
    return reached


# ---------------------------------------------------------------------------------------------- lines


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
        planner, _ = _planner(worker, arm)
        robot = stage_robot(worker, planner, arm)
        stage = Stage(robot, planner.obstacles)
        draw = partial(_draw_lines, worker, line, along)
        trunks = trunk_postures(worker, arm, float(line[:, 2].mean()))
        tracks = find_tracks(worker, arm, draw, trunks, [stage] * (len(line) + 2), random)
        if tracks:
            break
    if not tracks:
        raise SkillError(f"no arm of {', '.join(arms)} reaches the whole line; make it shorter")
    track = _approach(worker, tracks)
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
        _run(worker, track, 0, 1, robot)
        begun = True
        _run(worker, track, 1, len(line), robot)
        begun = False
        _run(worker, track, len(line), len(line) + 1, robot)
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
