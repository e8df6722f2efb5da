"""Points on the inner faces of fingertips: an object between them is grasped."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard.description.model import Vector3
from roboyard.morphology.hands.frames import fixed_tip
from roboyard.morphology.hands.geometry import Finger, HandGeometry
from roboyard.morphology.hands.opening import Grasp
from roboyard.transforms import Array

SMALL = 0.4
"""Branches smaller than this share of the largest finger are motors and covers."""
LinkPoints = tuple[tuple[str, Vector3], ...]
"""Links, each with a point in its frame (m)."""


def grasp_points(hand: HandGeometry, grasp: Grasp) -> tuple[LinkPoints, LinkPoints]:
    """Return a point on each fingertip of the one side and of the other; the fixed jaw is the other side of a
    single jaw.
    """
    poses = hand.poses({})
    size = {
        finger.joints[0]: float(np.ptp(hand.points(finger.links, poses), axis=0).max())
        for side in grasp.sides
        for finger in side
    }
    least = SMALL * max(size.values(), default=0.0)
    first, second = (
        [
            found
            for finger in side
            if size[finger.joints[0]] >= least and (found := _inner(hand, grasp, finger, sign)) is not None
        ]
        for side, sign in zip(grasp.sides, (1.0, -1.0), strict=True)
    )
    if first and not second:
        spot = fixed_tip(hand, grasp, first[0][1])
        nearest = _nearest_palm_link(hand, spot)
        second = [] if nearest is None else [(nearest, spot)]
    if not first or not second:
        return (), ()
    start, end = (
        tuple((link, _in_frame(poses[link], spot)) for link, spot in side) for side in (first, second)
    )
    return start, end


def _inner(hand: HandGeometry, grasp: Grasp, finger: Finger, sign: float) -> tuple[str, Array] | None:
    """Return a finger's last link and the middle of its tip, on the face towards the other side."""
    link, points = hand.tip_link(finger), hand.tip_points(finger, grasp.approach)
    if link is None or points is None:
        return None
    middle, along = points.mean(axis=0), points @ grasp.across
    face = along.max() if sign > 0 else along.min()
    if not grasp.sides[1]:
        face = float(middle @ grasp.across)
    return link, middle + (face - middle @ grasp.across) * grasp.across


def _nearest_palm_link(hand: HandGeometry, spot: Array) -> str | None:
    poses, far = hand.poses({}), {}
    for link in hand.palm_links:
        points: Sequence[Array] | Array = hand.points([link], poses)
        if len(points):
            far[link] = float(np.linalg.norm(np.asarray(points) - spot, axis=1).min())
    return min(far, key=lambda link: far[link]) if far else None


def _in_frame(pose: Array, spot: Array) -> Vector3:
    x, y, z = (float(round(v, 4)) + 0.0 for v in (np.linalg.inv(pose) @ [*spot, 1.0])[:3])
    return (x, y, z)
