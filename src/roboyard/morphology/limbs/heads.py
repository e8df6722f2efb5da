"""Heads: short chains on top of a robot, or such that carry cameras, by joints, place and names."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from roboyard.morphology.skeleton import Skeleton
from roboyard.morphology.words import meanings, share

MOST_JOINTS = 8
"""Of a head with its eyes."""
ARMS = 2
"""Number of arms beside a pan and tilt that show a head."""
UPRIGHT = 0.8
NEAR = 0.15
"""Distance between the axes of a pan and tilt, as a share of the robot's size."""
NEEDED = 3.0
"""Smallest sum of evidence."""


def looks_like_head(
    skeleton: Skeleton, joint: str, palms: Mapping[str, tuple[str, ...]], *, alone: bool = False
) -> bool:
    """Return whether a joint begins a head.

    Args:
        skeleton: the robot.
        joint: the first joint of the chain.
        palms: bodies with fingers.
        alone: whether the robot has no other limb; then only a name or a camera shows a head.
    """
    below = skeleton.below(joint)
    if len(below) > MOST_JOINTS or skeleton.depth(joint) > 4 or any(name in palms for name in below):
        return False
    between = _hands_beside(skeleton, joint, palms) >= ARMS and _is_pan_tilt(skeleton, joint)
    slides = (name for name in below if skeleton.joint[name].type == "prismatic")
    if any(skeleton.is_driven(name) for name in slides):  # a lift that follows the arm may carry a head
        return False
    return head_score(skeleton, joint, alone=alone) + 2.0 * between >= NEEDED


def _hands_beside(skeleton: Skeleton, joint: str, palms: Mapping[str, tuple[str, ...]]) -> int:
    """Return how many chains on the body that carries a chain end in hands."""
    beside = (name for name in skeleton.children[skeleton.parent[joint]] if name != joint)
    return sum(any(below in palms for below in skeleton.below(name)) for name in beside)


def _is_pan_tilt(skeleton: Skeleton, joint: str) -> bool:
    """Return whether a chain is a turn about an upright axis and one about a level axis, side by side."""
    below = skeleton.below(joint)
    if len(below) != 2 or any(skeleton.joint[name].type not in ("revolute", "continuous") for name in below):
        return False
    pan, tilt = below
    apart = float(np.linalg.norm(skeleton.origin(tilt) - skeleton.origin(pan)))
    upright = abs(skeleton.axis(pan)[2]) > UPRIGHT and abs(skeleton.axis(tilt)[2]) < 1.0 - UPRIGHT
    return upright and apart < NEAR * skeleton.size


def head_score(skeleton: Skeleton, joint: str, *, alone: bool = False) -> float:
    """Return the sum of the evidence that a chain is a head."""
    below = skeleton.below(joint)
    names = [text for name in below for text in (name, skeleton.joint[name].child)]
    score = 3.5 * share("head", names)
    for part in ("arm", "leg", "wheel", "steer", "trunk"):
        score -= 3.0 * share(part, names)
    lidars = [n for n in names if "lidar" in meanings(n) and not meanings(n) & {"head", "camera"}]
    score -= 4.0 * (len(lidars) > 0 and len(below) == 1)
    links = [link for name in below for link in skeleton.links[name]]
    score += 1.5 * any("camera" in meanings(link) for link in links)
    if alone:
        return score
    everything, own = skeleton.all_points, skeleton.points_below(joint)
    height = float(np.ptp(everything[:, 2])) if len(everything) else 0.0
    if height <= 0:
        return score
    top = own[:, 2].max() if len(own) else skeleton.origin(joint)[2]
    on_top = float(top) > everything[:, 2].max() - 0.1 * height
    width = float(np.ptp(everything[:, 1]))
    middle = float(everything[:, 1].min()) + width / 2
    centred = abs(float(skeleton.origin(joint)[1]) - middle) < 0.2 * width
    short = skeleton.reach(joint) < 0.35 * skeleton.size
    score += 1.5 * on_top + 0.5 * centred - 2.0 * (not short)
    score += 0.5 * (skeleton.depth(joint) <= 3) + 0.5 * (abs(skeleton.axis(joint)[2]) > 0.8)
    return score
