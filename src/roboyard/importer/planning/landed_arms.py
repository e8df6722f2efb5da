"""A rest posture of a flying robot in which it lands on its base, not on an arm that hangs below it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import product

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.description.semantic import Arm
from roboyard.morphology.point_model import PointModel

CLEARANCE = 0.01
"""Height of an arm above the lowest point of the base (m)."""
TURNS = np.radians((0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0))
MARGIN = np.radians(3.0)
"""Distance of turned joints to their limits (rad)."""
MOST_JOINTS = 3
"""Number of an arm's first joints that are turned."""

Posture = Mapping[str, float]


def landed_arms(
    description: RobotDescription,
    arms: tuple[Arm, ...],
    rest: Posture,
    touches: Callable[[Posture], bool] = lambda posture: False,
) -> dict[str, float]:
    """Return new positions (rad) of the first joints of each arm that reaches below the base; empty where
    none does, or where no turn by multiples of 45 degrees brings it above.

    Args:
        description: the robot; the root link's z axis is up.
        arms: its arms.
        rest: joint name to position before (rad or m).
        touches: whether a posture causes new contacts.
    """
    figure = PointModel(description)
    figure.home |= {name: rest[name] for name in figure.home if name in rest}
    of_arm = {arm.name: _moved(figure, arm) for arm in arms}
    moved = {link for links in of_arm.values() for link in links}
    base = [name for name in figure.outlines if name not in moved]
    floor = figure.lowest(figure.poses({}), base)
    found: dict[str, float] = {}
    for arm in arms:
        links = [name for name in figure.outlines if name in of_arm[arm.name]]
        if not figure.lowest(figure.poses(found), links) < floor:
            continue
        for posture in _candidates(description, arm, rest):
            above = figure.lowest(figure.poses({**found, **posture}), links) >= floor + CLEARANCE
            if above and not touches({**rest, **found, **posture}):
                found |= posture
                break
    return {name: value for name, value in found.items() if value != rest[name]}


def _moved(figure: PointModel, arm: Arm) -> set[str]:
    """Return the links that an arm moves."""
    first = figure.description.joint_by_name[arm.joints[0]]
    return set(figure.moved_links(first))


def _candidates(description: RobotDescription, arm: Arm, rest: Posture) -> list[dict[str, float]]:
    """Return positions of an arm's first joints, those with the smallest turns first."""
    names = [name for name in arm.joints if description.joint_by_name[name].type != "prismatic"][:MOST_JOINTS]
    choices = []
    for name in names:
        low, high = description.joint_by_name[name].position_limits() or (-np.inf, np.inf)
        values = [float(rest[name] + turn) for turn in TURNS]
        choices.append([v for v in values if v == rest[name] or low + MARGIN <= v <= high - MARGIN])
    postures = [dict(zip(names, values, strict=True)) for values in product(*choices)]
    return sorted(postures, key=lambda one: sum(abs(value - rest[name]) for name, value in one.items()))
