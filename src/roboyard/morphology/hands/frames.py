"""The link of an end effector and its grasp frame: the vendor's own where there is one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard.description.geometry import pose_from_matrix
from roboyard.description.model import Pose, RobotDescription
from roboyard.morphology.hands.geometry import HandGeometry
from roboyard.morphology.hands.opening import Grasp
from roboyard.morphology.sensors.names import named_kinds, words
from roboyard.transforms import Array

_GRASP = ("grasp", "grasping", "tcp", "pinch")
_TOOL = ("tool", "tool0", "ee", "eef", "effector", "endeffector", "tip", "tooltip")
_NONE = ("ft", "force", "torque", "sensor", "camera", "mount", "adapter", "flange", "target", "collision")
_ONE_FINGER = ("finger", "jaw", "thumb")
"""Parts of names with which a tip is that of one finger."""
_LEFT, _RIGHT = ("left", "l", "lf"), ("right", "r", "rf")


def vendor_frame(links: Sequence[str]) -> str | None:
    """Return the link that its name makes a grasp or tool frame; the best of several, else None."""
    best: tuple[int, int, str] | None = None
    for index, link in enumerate(links):
        parts = words(link)
        if any(word in _NONE for word in parts) or named_kinds(link):
            continue
        joined = "".join(parts)
        if any(word in _GRASP for word in parts):
            rank = 3
        elif any(word in _TOOL for word in parts) or "endeffector" in joined or "toolframe" in joined:
            rank = 0 if any(word in joined for word in _ONE_FINGER) else 2
        else:
            rank = 0
        if rank and (best is None or (rank, index) > best[:2]):
            best = rank, index, link
    return None if best is None else best[2]


def end_link(description: RobotDescription, links: Sequence[str]) -> str:
    """Return the end-effector link of an arm without gripper.

    It is the vendor's tool frame, else the last link with a shape, else the body's first link.

    Args:
        description: the robot.
        links: the links of the arm's last body, that next to the joint first.
    """
    named = vendor_frame(links)
    if named is not None:
        return named
    shaped = [
        link
        for link in links
        if not named_kinds(link)
        and (description.link_by_name[link].visuals or description.link_by_name[link].collisions)
    ]
    return shaped[0] if shaped else links[0]


def grasp_frame(hand: HandGeometry, grasp: Grasp, link: str) -> Pose:
    """Return the frame between the fingertips in a link's frame: z out of the tips, y from left to right."""
    poses = hand.poses({})
    sides = (hand.tip_centres(side, grasp.approach) for side in grasp.sides)
    tips = [np.mean(spots, axis=0) for spots in sides if spots]
    if len(tips) == 1:
        tips.append(fixed_tip(hand, grasp, tips[0]))
    middle = np.mean(tips, axis=0)
    y = grasp.across if _first_is_left(hand, grasp) else -grasp.across
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack([np.cross(y, grasp.approach), y, grasp.approach])
    frame[:3, 3] = middle
    return pose_from_matrix(np.linalg.inv(poses[link]) @ frame)


def fixed_tip(hand: HandGeometry, grasp: Grasp, tip: Array) -> Array:
    """Return the point (3,) of the fixed jaw opposite a moving jaw's tip (3,) (m); that tip without one."""
    points = hand.points(hand.palm_links, hand.poses({}))
    if not len(points):
        return tip
    along = points @ grasp.approach
    far = points[along >= along.max() - 0.3 * max(float(np.ptp(along)), 1e-6)]
    return far[np.linalg.norm(far - tip, axis=1).argmin()]


def _first_is_left(hand: HandGeometry, grasp: Grasp) -> bool:
    """Return whether the first side is the left one; so it is where the names say neither."""
    first, second = ([name for f in side for name in (*f.joints, *f.links)] for side in grasp.sides)
    if not first or not second:
        return True
    left = _count(first, _LEFT) - _count(second, _LEFT)
    right = _count(second, _RIGHT) - _count(first, _RIGHT)
    return left + right >= 0


def _count(names: Sequence[str], sides: Sequence[str]) -> float:
    return sum(sum(word in sides for word in words(name)) for name in names) / len(names)
