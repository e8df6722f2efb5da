"""A lean of two legs that brings the centre of mass of a robot over the middle of its feet.

Drawn upright, many humanoids have it near their heels, and a sway of a centimetre tips them over. First each
foot is turned until most of its length is on the floor. Then the legs turn about level axes across the
walking direction at hip and ankle, by the same angle in opposite directions, which moves the body forwards or
backwards while body and feet stay level.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from roboyard.description.model import RobotDescription, Vector3
from roboyard.description.semantic import Leg
from roboyard.morphology.point_model import PointModel
from roboyard.morphology.support_mode import decide
from roboyard.transforms import Array

LEGS = 2
ALONG = 0.98
"""Least |cosine| between an axis and the direction across."""
MOST_LEAN, STEPS = 0.2, 40
"""Largest lean (rad), and the number of leans tried to each side."""
LEAST_GAIN = 0.1
"""Share by which the margin has to grow."""
LEAN_COST = 0.02
"""Share of the robot's size by which the margin has to grow for a lean of one radian."""
ENOUGH = 0.06
"""Margin from which a robot does not lean, as a share of its size: ankles carry what is not above them."""
MOST_TURN, TURNS = 0.4, 40
"""Largest turn of an ankle that levels its foot (rad), and the number of turns tried to each side."""
FLAT = 1.5e-3
"""Height of a foot's points above its lowest that are on the floor (m)."""
LONGER = 2.0
"""Factor by which the length on the floor has to grow for an ankle to turn."""
DIGITS = 3


def centred_legs(
    description: RobotDescription, legs: Sequence[Leg], rest: Mapping[str, float], forward: Vector3
) -> dict[str, float]:
    """Return new positions of hips and ankles (rad); empty where a robot does not stand on two legs, or no
    lean brings its centre of mass further inside its support polygon.

    Args:
        description: the robot; the root link's z axis is up.
        legs: its legs.
        rest: joint name to position before (rad or m).
        forward: direction in which it walks, in the root link's frame.
    """
    if len(legs) != LEGS or any(leg.wheel_joint is not None for leg in legs):
        return {}
    figure = PointModel(description)
    figure.home |= {name: rest[name] for name in figure.home if name in rest}
    stance = decide(figure)
    poses = figure.poses({})
    across = np.cross((0.0, 0.0, 1.0), forward)
    turns: dict[str, float] = {}
    soles: dict[str, float] = {}
    for leg in legs:
        signs = {name: _sign(description, poses, name, across) for name in leg.joints}
        level = [name for name in leg.joints if signs[name]]
        if len(level) < 2 or any(name not in figure.home for name in level):
            return {}
        turns |= {level[0]: signs[level[0]], level[-1]: -signs[level[-1]]}
        soles |= _level_sole(figure, level[-1], np.asarray(forward, dtype=float))
    if soles:
        rest = {**rest, **soles}
        figure.home |= soles
        stance = decide(figure)
    if stance.polygon is None:
        return soles
    size = float(np.ptp(figure.points(poses), axis=0).max())
    if stance.margin >= ENOUGH * size:
        return soles
    leans = np.linspace(-MOST_LEAN, MOST_LEAN, 2 * STEPS + 1)
    leans = leans[[_within(description, rest, turns, float(lean)) for lean in leans]]
    margins = np.array([_margin(description, rest, turns, float(lean)) for lean in leans])
    scores = np.minimum(margins, ENOUGH * size) - LEAN_COST * size * np.abs(leans)
    best = int(scores.argmax()) if len(leans) else 0
    if not len(leans) or margins[best] <= (1.0 + LEAST_GAIN) * max(stance.margin, 0.0):
        return soles
    return {name: round(rest[name] + sign * float(leans[best]), DIGITS) for name, sign in turns.items()}


def _level_sole(figure: PointModel, ankle: str, forward: Array) -> dict[str, float]:
    """Return the position of an ankle at which most of its foot's length is on the floor (rad); empty where
    the foot is level already.
    """
    joint = figure.description.joint_by_name[ankle]
    here = figure.home[ankle]
    turns = np.linspace(-MOST_TURN, MOST_TURN, 2 * TURNS + 1)
    limits = joint.position_limits()
    if limits is not None:
        turns = turns[(here + turns >= limits[0]) & (here + turns <= limits[1])]
    lengths = []
    for turn in (0.0, *turns):
        points = figure.points(figure.poses({ankle: here + turn}), figure.moved_links(joint))
        if not len(points):
            return {}
        on_floor = points[points[:, 2] < points[:, 2].min() + FLAT]
        lengths.append(float(np.ptp(on_floor @ forward)))
    best = int(np.argmax(np.asarray(lengths) - LEAN_COST * np.abs((0.0, *turns))))
    if lengths[best] <= LONGER * lengths[0] + FLAT:
        return {}
    return {ankle: round(here + float(turns[best - 1]), DIGITS)}


def _sign(description: RobotDescription, poses: Mapping[str, Array], name: str, across: Array) -> float:
    """Return 1 or -1 where a joint turns about the direction across, either way round; 0 elsewhere."""
    joint = description.joint_by_name[name]
    if joint.type != "revolute":
        return 0.0
    along = float(poses[joint.child][:3, :3] @ np.asarray(joint.axis) @ across)
    return float(np.sign(along)) if abs(along) > ALONG else 0.0


def _within(
    description: RobotDescription, rest: Mapping[str, float], turns: Mapping[str, float], lean: float
) -> bool:
    for name, sign in turns.items():
        limits = description.joint_by_name[name].position_limits()
        if limits is not None and not limits[0] <= rest[name] + sign * lean <= limits[1]:
            return False
    return True


def _margin(
    description: RobotDescription, rest: Mapping[str, float], turns: Mapping[str, float], lean: float
) -> float:
    """Return the distance of the centre of mass to the edge of the support polygon under a lean (m)."""
    figure = PointModel(description)
    leant = {**rest, **{name: rest[name] + sign * lean for name, sign in turns.items()}}
    figure.home |= {name: leant[name] for name in figure.home if name in leant}
    return decide(figure).margin
