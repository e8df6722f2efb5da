"""A posture in which a robot with four or more legs stands, where the one of the file does not.

Legs are often drawn stretched, or bent at the knee only, since limits exclude zero there: the feet are then
not under the hips and the centre of mass is at the edge of the support polygon. In a standing posture every
foot is below the first joint of its leg, all at one height, with the knees bent; of the postures that do so,
the one with joints nearest to where they were is chosen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.description.semantic import Leg
from roboyard.morphology.joint_ranges import FULL_TURN, full_range
from roboyard.morphology.point_model import PointModel
from roboyard.morphology.support_mode import decide
from roboyard.transforms import Array

FEWEST_LEGS = 4
MOST_JOINTS = 4
"""Legs with more joints are left as they are."""
GOOD_MARGIN = 0.1
"""Share of the robot's size by which its centre of mass is inside the support polygon of a good stance."""
EXTENSION = 0.8
"""Share of the longest leg's length at which it stands."""
SAMPLES = 4096
"""Postures tried for a leg; the same number again around the best, three times."""
TURN_COST = 0.02
"""Cost of a turned joint, in leg lengths squared for a radian squared."""
DIGITS = 2
"""Of the positions, so that legs that are alike get the same (rad or m)."""
END_MARGIN = 0.05
"""Share of a joint's range that is kept free at each end."""


def standing_posture(
    description: RobotDescription, legs: Sequence[Leg], rest: Mapping[str, float]
) -> dict[str, float]:
    """Return positions of the legs' joints in which the robot stands (rad or m); empty where it stands as it
    is, or nothing better was found.

    Args:
        description: the robot; the root link's z axis is up.
        legs: its legs.
        rest: joint name to position before (rad or m).
    """
    if len(legs) < FEWEST_LEGS or any(leg.wheel_joint is not None for leg in legs):
        return {}
    figure = _figure(description, rest)
    if any(name not in figure.home for leg in legs for name in leg.joints):
        return {}
    size = float(np.ptp(figure.points(figure.poses({})), axis=0).max())
    before = decide(figure).margin
    if before >= GOOD_MARGIN * size:
        return {}
    rng = np.random.default_rng(0)
    drawn = [_draw(figure, leg, rng) for leg in legs if 1 < len(leg.joints) <= MOST_JOINTS]
    if len(drawn) < len(legs):
        return {}
    hips = [figure.poses({})[description.joint_by_name[leg.joints[0]].child][:3, 3] for leg in legs]
    lengths = [
        float((hip[2] - _lowest_points(figure, leg, draw)[:, 2]).max())
        for leg, hip, draw in zip(legs, hips, drawn, strict=True)
    ]
    if min(lengths) <= 0:
        return {}
    height = EXTENSION * min(lengths)
    found: dict[str, float] = {}
    for leg, hip, draw in zip(legs, hips, drawn, strict=True):
        found |= _best(figure, leg, hip, height, draw, rng)
    after = decide(_figure(description, {**rest, **found})).margin
    return found if after > max(before, 0.0) else {}


def _figure(description: RobotDescription, posture: Mapping[str, float]) -> PointModel:
    """Return the robot with a posture as its home."""
    figure = PointModel(description)
    figure.home |= {name: posture[name] for name in figure.home if name in posture}
    return figure


def _ranges(figure: PointModel, leg: Leg) -> Array:
    """Return (n, 2) positions that a leg's joints may take, and their ends kept free."""
    rows = []
    for name in leg.joints:
        joint = figure.description.joint_by_name[name]
        lower, upper = full_range(joint, figure.home[name])
        if joint.position_limits() is None:  # a turn either way, so that small ones both ways are near
            lower, upper = figure.home[name] - FULL_TURN / 2, figure.home[name] + FULL_TURN / 2
        free = END_MARGIN * (upper - lower)
        rows.append((lower + free, upper - free))
    return np.array(rows)


def _draw(figure: PointModel, leg: Leg, rng: np.random.Generator) -> Array:
    """Return (SAMPLES, n) positions of a leg's joints within their ranges."""
    ranges = _ranges(figure, leg)
    return rng.uniform(ranges[:, 0], ranges[:, 1], (SAMPLES, len(leg.joints)))


def _lowest_points(figure: PointModel, leg: Leg, values: Array) -> Array:
    """Return the (k, 3) lowest outline point of a leg's links for (k, n) positions of its joints (m)."""
    poses = figure.poses({name: values[:, i] for i, name in enumerate(leg.joints)})
    joint = figure.description.joint_by_name[leg.joints[0]]
    return figure.lowest_points(poses, figure.moved_links(joint))


def _best(
    figure: PointModel, leg: Leg, hip: Array, height: float, values: Array, rng: np.random.Generator
) -> dict[str, float]:
    """Return the positions of a leg's joints with its foot below the hip at a height below it.

    Args:
        figure: the robot.
        leg: the leg.
        hip: (3,) of its first joint (m).
        height: of the hip above the foot (m).
        values: (k, n) positions to start from (rad or m).
        rng: draws the positions around the best.
    """
    ranges = _ranges(figure, leg)
    home = np.array([figure.home[name] for name in leg.joints])
    straight = _lowest_points(figure, leg, home[None])[0]
    best, width = home, ranges[:, 1] - ranges[:, 0]
    for scale in (0.1, 0.02, 0.004, 0.0):
        feet = _lowest_points(figure, leg, values)
        aside = np.hypot(feet[:, 0] - hip[0], feet[:, 1] - straight[1])
        down = hip[2] - feet[:, 2] - height
        cost = (aside**2 + down**2) / height**2 + TURN_COST * ((values - home) ** 2).sum(axis=1)
        best = values[int(cost.argmin())]
        values = rng.normal(best, scale * width, values.shape)
        values = np.clip(values, ranges[:, 0], ranges[:, 1])
    return {name: round(float(value), DIGITS) for name, value in zip(leg.joints, best, strict=True)}
