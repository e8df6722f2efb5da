"""Proof that two links of a robot never touch, by distances between their hulls."""

from __future__ import annotations

import numpy as np

from roboyard.planning.hull_judge import SURE, HullJudge, judge_of
from roboyard.planning.spheres.sphere_model import Pair, SphereModel, link_contents, sphere_robot
from roboyard.shapes.cache import content_key, load_arrays, store_arrays
from roboyard.transforms import Array

MARGIN = 5e-4
"""Distance that the hulls of such links keep (m)."""
MOST_JOINTS = 3
"""Joints between the two links up to which a proof is tried; with more, it takes too many boxes."""
MOST_BOXES = 20_000
"""Boxes of configurations that are looked at."""
VERSION = 1


def proven_apart(model: SphereModel) -> frozenset[Pair]:
    """Return the rough pairs of a model, names sorted, that never touch within the joints' limits; cached."""
    key = content_key(
        "apart", VERSION, MARGIN, MOST_JOINTS, MOST_BOXES, *link_contents(model), sorted(model.rough)
    )
    stored = load_arrays("apart", key)
    if stored is None:
        stored = {"pairs": np.array(sorted(_proven(model)), dtype=str).reshape(-1, 2)}
        store_arrays("apart", key, stored)
    return frozenset((str(a), str(b)) for a, b in stored["pairs"].reshape(-1, 2))


def _proven(model: SphereModel) -> set[Pair]:
    if not model.rough:
        return set()
    robot = sphere_robot(model, model.coordinate_names)
    judge = judge_of(robot, ())
    sliding = np.zeros(robot.chain.size, dtype=bool)
    sliding[robot.chain.q_index[robot.chain.is_prismatic]] = True
    endless = sliding & ~(np.isfinite(robot.chain.lower) & np.isfinite(robot.chain.upper))
    return {
        pair
        for pair, reach in zip(robot.rough, robot.rough_reach, strict=True)
        if not (reach[endless] > 0).any()
        and never_touch(judge, pair, reach, robot.arrays.lower, robot.arrays.upper)
    }


def never_touch(judge: HullJudge, pair: Pair, reach: Array, lower: Array, upper: Array) -> bool:
    """Return whether two links stay apart in all configurations between limits; False where it is not proven.

    The distance at the middle of a box of configurations, less what the joints can move the links by within
    the box, bounds it from below; boxes in which that does not suffice are halved.

    Args:
        judge: the robot's hulls, without surroundings.
        pair: the links.
        reach: (n,) most that two points of the links move relative to each other for each unit of each joint
            (m/rad or 1).
        lower: (n,) limits (rad or m).
        upper: (n,)
    """
    joints = np.flatnonzero(reach)
    if len(joints) > MOST_JOINTS:
        return False
    middle, half = (lower + upper) / 2, np.zeros(len(reach))
    half[joints] = (upper - lower)[joints] / 2
    boxes = [(middle, half)]
    for _ in range(MOST_BOXES):
        if not boxes:
            return True
        middle, half = boxes.pop()
        room = judge.pair_distance(middle, pair) - SURE - MARGIN
        if room < 0.0:
            return False
        if half @ reach <= room:
            continue
        joint = int(np.argmax(half * reach))
        half = half.copy()
        half[joint] /= 2
        for side in (-1.0, 1.0):
            at = middle.copy()
            at[joint] += side * half[joint]
            boxes.append((at, half))
    return not boxes
