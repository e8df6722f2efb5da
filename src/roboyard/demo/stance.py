"""Does the robot stand on the floor, and on what? Decided from its shapes, masses and joints alone.

| kind | when | in the demo |
| --- | --- | --- |
| standing | its weight lies over its feet or wheels, which its joints do not lift | free on the floor |
| held | joints between its base and its feet carry it (legs) | dropped, then held up |
| mounted | anything else: arms, hands, heads, robots whose root is the world | base fixed |
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from roboyard.demo.figure import Figure
from roboyard.demo.sweep import full_range
from roboyard.poses import Array
from roboyard.urdf.model import Joint

Kind = Literal["standing", "held", "mounted"]

WORLD_NAMES = ("world", "map", "odom")
"""Root links of these names, without mass and shape, are the world itself."""
LEAST_MARGIN = 0.005
"""Of the robot's size: how far its weight has to lie inside what it stands on."""
SAMPLES = 25


@dataclass(frozen=True, kw_only=True, eq=False)
class Stance:
    """How a robot meets the floor in its home posture."""

    kind: Kind
    reason: str
    """For people."""
    lowest: float
    """Height of the lowest point above the root link's frame; m."""
    feet: tuple[str, ...]
    """Links that reach the floor."""
    margin: float
    """Of the centre of mass inside the support polygon; negative outside; m."""
    polygon: Array | None
    """(k, 3) half planes a, b, c with a x + b y + c <= 0 inside, unit normals; None without area."""

    def margin_at(self, point: Array) -> Array:
        """(...) distance of (..., >= 2) points to the polygon's edge, negative outside; m."""
        if self.polygon is None:
            return np.full(point.shape[:-1], -np.inf)
        return -(point[..., :2] @ self.polygon[:, :2].T + self.polygon[:, 2]).max(axis=-1)


def decide(figure: Figure) -> Stance:
    """How this robot stands in its home posture."""
    poses = figure.poses({})
    lowest = figure.lowest(poses)
    if not np.isfinite(lowest):
        return _stance("mounted", "it has no shapes to stand on", 0.0, (), None, np.zeros(3))
    size = float(np.ptp(figure.points(poses), axis=0).max())
    tolerance = max(0.002, 0.015 * size)
    feet = tuple(name for name in figure.outlines if figure.lowest(poses, [name]) < lowest + tolerance)
    centre = figure.centre_of_mass(poses)

    def found(kind: Kind, reason: str, on: tuple[str, ...] = feet) -> Stance:
        points = figure.points(poses, on)
        polygon = _polygon(points[points[:, 2] < lowest + tolerance, :2], size)
        return _stance(kind, reason, float(lowest), on, polygon, centre)

    root = figure.description.root
    if root.name.lower() in WORLD_NAMES and root.inertial is None and root.name not in figure.outlines:
        return found("mounted", f'its root link is "{root.name}"')
    legs = _carrying_joints(figure, feet, float(lowest), tolerance)
    if legs:
        lifted = {
            link for name in legs for link in figure.moved_links(figure.description.joint_by_name[name])
        }
        rest = tuple(name for name in feet if name not in lifted)
        if found("standing", "", rest).margin < LEAST_MARGIN * size:
            more = f" and {len(legs) - 1} more" if len(legs) > 1 else ""
            return found("held", f'its joints carry it ("{legs[0]}"{more})')
        feet = rest
    stance = found("standing", "", feet)
    if stance.margin < LEAST_MARGIN * size:
        return found("mounted", "its weight does not lie over its base", feet)
    if not any(_is_moving(figure, name) for name in feet):
        tipping = _tipping_joints(figure, stance)
        if tipping:
            return found("mounted", f'its base is fixed and "{tipping[0]}" would tip it over', feet)
    return found("standing", f"its weight lies {100 * stance.margin:.1f} cm inside what it stands on", feet)


def _stance(
    kind: Kind, reason: str, lowest: float, feet: tuple[str, ...], polygon: Array | None, centre: Array
) -> Stance:
    half = Stance(kind=kind, reason=reason, lowest=lowest, feet=feet, margin=0.0, polygon=polygon)
    margin = float(half.margin_at(centre))
    return Stance(kind=kind, reason=reason, lowest=lowest, feet=feet, margin=margin, polygon=polygon)


def _polygon(points: Array, size: float) -> Array | None:
    from scipy.spatial import ConvexHull, QhullError

    if len(points) < 3:
        return None
    try:
        hull = ConvexHull(points)
    except QhullError:
        return None
    return hull.equations if hull.volume > 1e-4 * size * size else None


def _path(figure: Figure, link: str) -> list[Joint]:
    """The moving joints from a link up to the root."""
    joints = []
    while (joint := figure.description.parent_joint.get(link)) is not None:
        if joint.is_moving:
            joints.append(joint)
        link = joint.parent
    return joints


def _is_moving(figure: Figure, link: str) -> bool:
    return bool(_path(figure, link))


def _carrying_joints(figure: Figure, feet: tuple[str, ...], lowest: float, tolerance: float) -> list[str]:
    """Joints between root and feet that lift the feet: legs, where wheels and casters only roll."""
    driven = {joint.name: joint for joint in figure.joints}
    candidates = dict.fromkeys(joint.name for name in feet for joint in _path(figure, name))
    found = []
    for name in candidates:
        joint = driven.get(name)
        if joint is None:
            continue
        lower, upper = full_range(joint, figure.home[name])
        moved = figure.moved_links(joint)
        heights = figure.lowest(figure.poses({name: np.linspace(lower, upper, SAMPLES)}), moved)
        if np.abs(heights - lowest).max() > 3 * tolerance:
            found.append(name)
    return found


def _tipping_joints(figure: Figure, stance: Stance) -> list[str]:
    found = []
    for joint in figure.joints:
        lower, upper = full_range(joint, figure.home[joint.name])
        poses = figure.poses({joint.name: np.linspace(lower, upper, SAMPLES)})
        if stance.margin_at(figure.centre_of_mass(poses)).min() < 0.3 * stance.margin:
            found.append(joint.name)
    return found
