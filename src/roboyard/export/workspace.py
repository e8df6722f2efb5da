"""Directions that an arm reaches, seen from the base, by sampled postures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.description.semantic import Arm
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.transforms import Array

SAMPLES = 4096
"""Postures of the arm's joints, evenly spread within their limits."""
SECTOR = 5
"""Width of a sector (degrees)."""
ALL_ROUND = 330
"""Range from which an arm reaches all around (degrees); stops of a turning base leave a small gap."""
FAR = 0.8
"""Share of its longest level reach that an arm reaches in every direction of its range."""


def workspace_range(
    description: RobotDescription, arm: Arm, base_link: str, rest: Mapping[str, float]
) -> tuple[int, int] | None:
    """Return the yaw range, right to left, in which an arm reaches nearly as far as it can (degrees).

    Yaw is about the base link's z axis from its x axis; the range is in steps of 5 degrees and may go beyond
    180. None for an arm that reaches nothing beside the base.

    Args:
        description: of the robot.
        arm: its joints move its end-effector link.
        base_link: link whose frame counts.
        rest: positions of the other joints (rad or m).
    """
    spots = _spots(description, arm, base_link, rest)
    level = np.linalg.norm(spots[:, :2], axis=1)
    farthest = float(level.max(initial=0.0))
    if farthest < 1e-3:
        return None
    count = 360 // SECTOR
    sector = np.floor(np.degrees(np.arctan2(spots[:, 1], spots[:, 0])) / SECTOR).astype(int) % count
    reach = np.zeros(count)
    np.maximum.at(reach, sector, level)
    is_far = reach >= FAR * farthest
    if is_far.all():
        return -180, 180
    best = int(np.argmax(reach))
    low, high = best, best
    while is_far[(low - 1) % count]:
        low -= 1
    while is_far[(high + 1) % count]:
        high += 1
    if (high + 1 - low) * SECTOR >= ALL_ROUND:
        return -180, 180
    turn = 360 * round((low + high + 1) * SECTOR / 2 / 360)
    return low * SECTOR - turn, (high + 1) * SECTOR - turn


def _spots(description: RobotDescription, arm: Arm, base_link: str, rest: Mapping[str, float]) -> Array:
    """Return (n, 3) positions of the end effector in the base's frame, over postures of the arm."""
    rng = np.random.default_rng(0)
    values: dict[str, Array | float] = dict(rest)
    for name in arm.joints:
        joint = description.joint_by_name[name]
        low, high = joint.position_limits() or (-np.pi, np.pi)
        values[name] = rng.uniform(low, high, SAMPLES)
    poses = forward_kinematics(description, values)
    to_base = np.linalg.inv(poses[base_link])
    place = np.broadcast_to(to_base @ poses[arm.end_effector.link], (SAMPLES, 4, 4))
    return place[:, :3, 3]
