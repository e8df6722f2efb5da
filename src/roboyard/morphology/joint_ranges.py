"""The range of motion of a joint, bounded where its description gives no limits or very wide ones."""

from __future__ import annotations

import math

from roboyard.description.model import Joint

FREE_SLIDE = 0.1
"""Motion each way of a prismatic joint without limits (m)."""
LONGEST_SLIDE = 100.0
"""Largest motion each way of a prismatic joint (m)."""
FULL_TURN = 2 * math.pi


def full_range(joint: Joint, home: float) -> tuple[float, float]:
    """Return the lower and upper end of a joint's motion: its limits, but at most one turn (rad or m).

    A continuous joint makes one turn from home; a revolute joint with limits more than a turn apart
    makes half a turn each way; a prismatic joint without limits moves 0.1 m each way.

    Args:
        joint: a revolute, continuous or prismatic joint.
        home: its home position (rad or m).
    """
    limits = joint.position_limits()
    if joint.type == "prismatic":
        lower, upper = limits or (home - FREE_SLIDE, home + FREE_SLIDE)
        return max(lower, home - LONGEST_SLIDE), min(upper, home + LONGEST_SLIDE)
    if limits is None:
        return home, home + FULL_TURN
    if limits[1] - limits[0] > FULL_TURN:
        return max(limits[0], home - math.pi), min(limits[1], home + math.pi)
    return limits


def home_position(joint: Joint) -> float:
    """Return zero where the limits allow it, else the middle of the range (rad or m)."""
    limits = joint.position_limits()
    if limits is None or limits[0] <= 0.0 <= limits[1]:
        return 0.0
    return 0.5 * (limits[0] + limits[1])
