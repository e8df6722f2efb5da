"""Ball casters that a file draws as several joints without limits through one point."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from roboyard.morphology.skeleton import BASE, Skeleton, is_endless

ONE_POINT = 1e-3
"""Largest distance between joints of one ball (m)."""
FLOOR = 0.3
"""Largest height of a ball's lowest point above the wheels', in radii of the wheels."""


def find_ball_casters(
    skeleton: Skeleton, used: Collection[str], floor: float, radius: float
) -> tuple[str, ...]:
    """Return the joints of ball casters, depth first: at least two without limits through one point, whose
    last link is as low as the wheels.

    Args:
        skeleton: the robot.
        used: joints of wheels.
        floor: height of the wheels' lowest point (m).
        radius: of the wheels (m).
    """
    found: list[str] = []
    for name in skeleton.joint:
        if skeleton.children[name] or name in used:
            continue
        chain = [name]
        while (above := skeleton.parent[chain[0]]) != BASE and above not in used:
            apart = float(np.linalg.norm(skeleton.origin(above) - skeleton.origin(name)))
            if apart > ONE_POINT or len(skeleton.children[above]) > 1:
                break
            chain.insert(0, above)
        loose = all(is_endless(skeleton.joint[one]) for one in chain)
        points = skeleton.points_below(chain[0])
        low = float(points[:, 2].min()) if len(points) else float(skeleton.origin(name)[2]) - radius
        if len(chain) >= 2 and loose and low <= floor + FLOOR * radius:
            found += chain
    return tuple(found)
