"""Which way the joints of a hand open it: the fingers' tips move apart, or away from the fixed jaw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from roboyard.description.semantic import Opening
from roboyard.morphology.hands.geometry import Finger, HandGeometry
from roboyard.morphology.joint_ranges import full_range, home_position
from roboyard.transforms import Array

MIN_CHANGE = 0.02
"""Smallest change of the gap that shows a direction, as a share of the finger's size."""
SNAP = 0.94
"""Cosine of the largest angle at which a direction is taken to be that of a frame's axis."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Grasp:
    """Directions of a hand in its palm's frame, joints at home."""

    approach: Array
    """(3,) unit vector out of the fingertips."""
    across: Array
    """(3,) unit vector from the first side of fingers to the second, upright to `approach`."""
    sides: tuple[tuple[Finger, ...], tuple[Finger, ...]]
    """The fingers on the first and on the second side; the second one is empty for a single jaw."""


def find_grasp(hand: HandGeometry) -> Grasp | None:
    """Return where the hand points and how its fingers oppose; None where no finger has a shape."""
    fingers = [finger for finger in hand.fingers if hand.tip_link(finger) is not None]
    if not fingers:
        return None
    poses = hand.poses({})
    points = [hand.points(finger.links, poses) for finger in fingers]
    centres = np.array([each.mean(axis=0) for each in points])
    axis, is_slide = _common_axis(hand, fingers)
    away = axis if is_slide else None
    approach = _approach(hand, np.concatenate(points), axis)
    if axis is not None and not is_slide:
        away = np.asarray(np.cross(axis, approach), dtype=np.float64)
    if away is None:
        away = _principal(centres) if len(fingers) > 2 else centres[-1] - centres[0]
    across = away - (away @ approach) * approach
    if float(np.linalg.norm(across)) < 1e-6:
        across = np.asarray(np.cross(approach, np.eye(3)[int(np.abs(approach).argmin())]), dtype=np.float64)
    across = across / float(np.linalg.norm(across))
    if len(fingers) == 1:
        return Grasp(approach=approach, across=across, sides=((fingers[0],), ()))
    where = _tip_places(hand, fingers, approach, across)
    if where[0] > 0:
        across, where = -across, -where
    first = tuple(finger for finger, place in zip(fingers, where, strict=True) if place < 0)
    second = tuple(finger for finger, place in zip(fingers, where, strict=True) if place >= 0)
    return Grasp(approach=approach, across=across, sides=(first, second))


def _common_axis(hand: HandGeometry, fingers: Sequence[Finger]) -> tuple[Array | None, bool]:
    """Return the direction of all fingers' first joints and whether they slide; None where they differ."""
    poses = hand.poses({})
    firsts = [hand.joint[finger.joints[0]] for finger in fingers]
    axes = np.array([poses[joint.child][:3, :3] @ np.asarray(joint.axis) for joint in firsts])
    slides = {joint.type == "prismatic" for joint in firsts}
    if len(slides) > 1 or float(np.abs(axes @ axes[0]).min()) < SNAP:
        return None, False
    return axes[0], slides.pop()


def _principal(points: Array) -> Array:
    _, _, rows = np.linalg.svd(points - points.mean(axis=0))
    return rows[0]


def _tip_places(hand: HandGeometry, fingers: Sequence[Finger], approach: Array, across: Array) -> Array:
    """Return where the tips are along `across`, from the middle of all.

    At home they may touch; then the posture counts in which the joints are at that end of their ranges where
    the tips are farther apart.
    """

    def places(posture: dict[str, float]) -> Array:
        poses = hand.poses(posture)
        spots = [float(spot @ across) for spot in hand.tip_centres(fingers, approach, poses)]
        return np.array(spots) - (max(spots) + min(spots)) / 2

    ranges = {}
    for name, joint in hand.joint.items():
        if name not in hand.leaders and joint.position_limits() is not None and joint.mimic is None:
            ranges[name] = full_range(joint, home_position(joint))
    home = places({})
    size = float(
        np.ptp(np.concatenate([hand.points(f.links, hand.poses({})) for f in fingers]), axis=0).max()
    )
    if float(np.ptp(home)) > 0.05 * size:
        return home
    ends = [places({name: limits[end] for name, limits in ranges.items()}) for end in (0, 1)]
    return max((*ends, home), key=lambda spots: float(np.ptp(spots)))


def _approach(hand: HandGeometry, points: Array, axis: Array | None) -> Array:
    """Return the unit direction from the wrist to the fingers, upright to `axis`, along an axis of the palm
    where one is near.
    """
    poses = hand.poses({})
    start = poses[hand.palm_links[0]][:3, 3] if hand.palm_links else np.zeros(3)
    roots = np.array([poses[hand.joint[finger.joints[0]].child][:3, 3] for finger in hand.fingers])
    for out in (points.mean(axis=0) - start, points.mean(axis=0) - roots.mean(axis=0)):
        flat = out if axis is None else out - (out @ axis) * axis
        length = float(np.linalg.norm(flat))
        if length > 1e-3:
            break
    else:
        return np.array([0.0, 0.0, 1.0])
    unit = flat / length
    nearest = int(np.abs(unit).argmax())
    if abs(unit[nearest]) >= SNAP:
        return np.eye(3)[nearest] * np.sign(unit[nearest])
    return unit


def opening_of(hand: HandGeometry, grasp: Grasp, name: str) -> tuple[Opening | None, float]:
    """Return the direction of a joint that opens the hand, and the change of the gap over its range (m).

    Only the joint and its followers move. The change is 0 and the direction None where the tips show none.
    """
    joint = hand.joint[name]
    home = home_position(joint)
    lower, upper = full_range(joint, home)
    if joint.position_limits() is None:
        lower, upper = home - 0.5, home + 0.5
    poses = hand.poses({name: np.array([lower, upper])})
    moved = [f for f in hand.fingers if _moves(hand, name, f)]
    moved.sort(key=lambda f: name not in f.joints)
    tips = ((f, hand.tip_points(f, grasp.approach, poses)) for f in moved)
    finger, tip = next(((f, tip) for f, tip in tips if tip is not None), (None, None))
    if finger is None or tip is None:
        return None, 0.0
    change = _change(hand, grasp, finger, poses, tip)
    size = max(float(np.ptp(hand.points(finger.links, hand.poses({})), axis=0).max()), 1e-3)
    if abs(change) < MIN_CHANGE * size:
        return None, 0.0
    return ("increasing" if change > 0 else "decreasing"), abs(change)


def _moves(hand: HandGeometry, name: str, finger: Finger) -> bool:
    """Return whether a joint or one of its followers is a finger's."""
    follows = [other for other, leader in hand.leaders.items() if leader.leader == name]
    return name in finger.joints or any(other in finger.joints for other in follows)


def _change(
    hand: HandGeometry, grasp: Grasp, finger: Finger, poses: Mapping[str, Array], tip: Array
) -> float:
    """Return the growth of the gap between a finger's (2, k, 3) tip and what it closes against (m)."""
    first, second = grasp.sides
    if not second:
        fixed = hand.points(hand.palm_links, hand.poses({}))
        if not len(fixed):
            return 0.0
        gaps = [float(np.linalg.norm(end[:, None] - fixed[None], axis=-1).min()) for end in tip]
        return gaps[1] - gaps[0]
    sign = 1.0 if finger in second else -1.0
    against = hand.tip_centres(first if finger in second else second, grasp.approach, poses)
    if not against:
        return 0.0
    ends = tip.mean(axis=-2)
    other = np.mean([np.broadcast_to(spot, ends.shape) for spot in against], axis=0)
    apart = sign * ((ends - other) @ grasp.across)
    return float(apart[1] - apart[0])
