"""Wheels that a file draws without joints: named as wheels, on fixed joints of the base, on the floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roboyard.description.evidence.model import FileEvidence
from roboyard.description.semantic import BaseKind, DriveKind
from roboyard.morphology.sensors.names import is_mount
from roboyard.morphology.skeleton import BASE, Skeleton
from roboyard.morphology.words import meanings
from roboyard.transforms import Array

FLOOR = 0.1
"""Largest height of a wheel's lowest point above the robot's, as a share of the robot's height."""
MIN_POINTS = 12
"""Fewest extreme points of a shape that can show a circle."""
_PLUGINS: dict[str, tuple[BaseKind, DriveKind | None]] = {
    "differential": ("differential", "plain"),
    "skid": ("differential", "skid"),
    "ackermann": ("ackermann", "ackermann"),
    "holonomic": ("holonomic", None),
}


@dataclass(frozen=True, kw_only=True, slots=True)
class FixedWheels:
    """The base that wheels without joints show."""

    kind: BaseKind
    drive: DriveKind | None
    confidence: float
    evidence: tuple[str, ...]
    is_stated: bool
    """Whether a simulator's plugin states the base too."""


def find_fixed_wheels(skeleton: Skeleton, evidence: FileEvidence | None = None) -> FixedWheels | None:
    """Return the base that wheels on fixed joints show; None where there are not two of them side by side.

    Args:
        skeleton: the robot.
        evidence: what its files state beyond links and joints.
    """
    links = [link for link in skeleton.links[BASE] if _is_wheel(skeleton, link)]
    spots = np.array([skeleton.frames[link][:3, 3] for link in links])
    if len(links) < 2 or float(np.ptp(spots[:, :2], axis=0).max()) < 0.1 * skeleton.size:
        return None
    text = f"{len(links)} wheels on fixed joints, which nothing can turn: {', '.join(links[:4])}"
    for plugin in evidence.plugins if evidence is not None else ():
        if plugin.kind in _PLUGINS:
            kind, drive = _PLUGINS[plugin.kind]
            reasons = (text, f'the plugin "{plugin.filename}" drives them')
            return FixedWheels(kind=kind, drive=drive, confidence=0.7, evidence=reasons, is_stated=True)
    if _are_steered(skeleton, links, evidence):
        reasons = (text, "each of them below a part that a motor steers, as transmissions state")
        return FixedWheels(
            kind="holonomic", drive="swerve", confidence=0.6, evidence=reasons, is_stated=False
        )
    if _stand_around(spots):
        reasons = (text, "they stand at thirds of a circle")
        return FixedWheels(kind="holonomic", drive="omni", confidence=0.45, evidence=reasons, is_stated=False)
    two = len(links) == 2
    return FixedWheels(
        kind="differential" if two else "wheeled",
        drive="plain" if two else None,
        confidence=0.45,
        evidence=(text,),
        is_stated=False,
    )


def _is_wheel(skeleton: Skeleton, link: str) -> bool:
    joint = skeleton.description.parent_joint.get(link)
    if link == skeleton.base_link or joint is None or "wheel" not in meanings(link):
        return False
    heights, points = skeleton.spots, skeleton.link_points(link)
    if is_mount(link) and not _is_disc(points):  # what carries a wheel; a wheel with its motor is round
        return False
    if not len(points):
        return "wheel" in meanings(joint.name)
    floor = float(heights[:, 2].min())
    return float(points[:, 2].min()) - floor <= FLOOR * float(np.ptp(heights[:, 2]))


def _is_disc(points: Array) -> bool:
    """Return whether (k, 3) points are as high as they are wide one way, and round about a level axle."""
    if len(points) < MIN_POINTS:
        return False
    width, depth, height = np.ptp(points, axis=0)
    largest = max(float(width), float(depth))
    if min(largest, float(height)) < 0.9 * max(largest, float(height)):
        return False
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    across = points[:, [0 if width >= depth else 1, 2]] - middle[[0 if width >= depth else 1, 2]]
    return float(np.linalg.norm(across, axis=1).max()) < 1.15 * float(height) / 2


def _stand_around(spots: Array) -> bool:
    """Return whether three wheels (3, 3) stand at about 120 degrees from one another, seen from above."""
    if len(spots) != 3:
        return False
    away = spots[:, :2] - spots[:, :2].mean(axis=0)
    angles = np.sort(np.arctan2(away[:, 1], away[:, 0]))
    between = np.diff([*angles, angles[0] + 2 * np.pi])
    return bool(np.abs(between - 2 * np.pi / 3).max() < np.deg2rad(25))


def _are_steered(skeleton: Skeleton, links: Sequence[str], evidence: FileEvidence | None) -> bool:
    """Return whether the wheels hang from at least three parts which motors steer."""
    above = [skeleton.description.parent_joint[link].parent for link in links]
    parts = {part for part in above if part in skeleton.description.parent_joint}
    if evidence is None or len(parts) < 3 or not all(part in parts for part in above):
        return False
    joints = [skeleton.description.parent_joint[part].name for part in parts]
    words = [meanings(name) for name in joints]
    return all(word & {"caster", "steer"} for word in words) and set(joints) <= set(evidence.actuated)
