"""Does the robot stand on the floor, and on what? Decided from its shapes, masses and joints alone.

| kind | when | in the demo |
| --- | --- | --- |
| free | its centre of mass is over its feet or wheels, which its joints do not lift | free on the floor |
| supported | joints between its base and its feet carry it (legs) | dropped, then fixed by its base |
| mounted | anything else: arms, hands, heads, robots whose root is the world | base fixed |
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from roboyard.morphology.joint_ranges import full_range
from roboyard.morphology.point_model import PointModel
from roboyard.morphology.words import stands_for_the_world
from roboyard.transforms import Array

Kind = Literal["free", "supported", "mounted"]

LEAST_MARGIN = 0.005
"""Of the robot's size: how far its weight has to lie inside what it stands on."""
SAMPLES = 25


@dataclass(frozen=True, kw_only=True, eq=False)
class SupportMode:
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
    levers: Mapping[str, float]
    """Driven joints between the root and the feet, and how far from their axis the floor pushes; m."""
    polygon: Array | None
    """(k, 3) half planes a, b, c with a x + b y + c <= 0 inside, unit normals; None without area."""

    def margin_at(self, point: Array) -> Array:
        """Return the (n,) distance of (n, 3) points to the support polygon's edge, negative outside (m)."""
        return _margin(self.polygon, point)


def decide(figure: PointModel) -> SupportMode:
    """How this robot stands in its home posture."""
    poses = figure.poses({})
    lowest = figure.lowest(poses)
    if not np.isfinite(lowest):
        return SupportMode(
            kind="mounted",
            reason="it has no shapes to stand on",
            lowest=0.0,
            feet=(),
            margin=-np.inf,
            levers={},
            polygon=None,
        )
    size = float(np.ptp(figure.points(poses), axis=0).max())
    tolerance = max(0.002, 0.015 * size)
    feet = tuple(name for name in figure.outlines if figure.lowest(poses, [name]) < lowest + tolerance)
    centre = figure.centre_of_mass(poses)

    def found(kind: Kind, reason: str, on: tuple[str, ...] = feet) -> SupportMode:
        soles = [
            points[points[:, 2] < points[:, 2].min() + 0.04 * tolerance]
            for points in _each(figure, poses, on)
        ]
        polygon = _polygon(np.concatenate([np.empty((0, 3)), *soles])[:, :2], size)
        return SupportMode(
            kind=kind,
            reason=reason,
            lowest=float(lowest),
            feet=on,
            margin=float(_margin(polygon, centre)),
            levers=_levers(figure, poses, on),
            polygon=polygon,
        )

    root = figure.description.root
    if stands_for_the_world(root) and root.name not in figure.outlines:
        return found("mounted", f'its root link is "{root.name}"')
    touching = {link.name for link in figure.description.links if link.collisions}
    if not touching.intersection(feet):
        return found("mounted", "the links that reach the floor have no collision shapes")
    if not figure.joints:
        return found("free", "it has no joints to drive")
    if figure.base_mass <= 0.0:
        return found("mounted", "its base has no mass in its file")
    legs = _carrying_joints(figure, feet, float(lowest), tolerance)
    if legs:
        lifted = {
            link for name in legs for link in figure.moved_links(figure.description.joint_by_name[name])
        }
        rest = tuple(name for name in feet if name not in lifted)
        if found("free", "", rest).margin < LEAST_MARGIN * size:
            held = found("supported", f"its joints carry it ({_first_of(legs)})")
            if held.margin < 0 and _is_one_limb(figure, feet):  # an arm whose hand hangs lower than its base
                return found(
                    "mounted", f'its centre of mass is not over the link that reaches the floor ("{feet[0]}")'
                )
            return held
        feet = rest
    stance = found("free", "", feet)
    if stance.margin < LEAST_MARGIN * size:
        return found("mounted", "its centre of mass is not over its base", feet)
    if not any(figure.path(name) for name in feet):
        tipping = _tipping_joints(figure, stance)
        if tipping:
            return found("mounted", f'its base is fixed and "{tipping[0]}" would tip it over', feet)
    return found(
        "free", f"its centre of mass is {100 * stance.margin:.1f} cm inside its support polygon", feet
    )


def _is_one_limb(figure: PointModel, feet: tuple[str, ...]) -> bool:
    """True where one driven joint moves all of the feet."""
    paths = [{joint.name for joint in figure.path(name)}.intersection(figure.home) for name in feet]
    return bool(set.intersection(*paths))


def _first_of(names: list[str]) -> str:
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return f'"{names[0]}"{more}'


def _margin(polygon: Array | None, point: Array) -> Array:
    if polygon is None:
        return np.full(point.shape[:-1], -np.inf)
    return -(point[..., :2] @ polygon[:, :2].T + polygon[:, 2]).max(axis=-1)


def _levers(figure: PointModel, poses: Mapping[str, Array], feet: tuple[str, ...]) -> dict[str, float]:
    """Largest distance of a foot's lowest point from the axis of each driven joint above it; m."""
    found: dict[str, float] = {}
    for name in feet:
        points = figure.points(poses, [name])
        contact = points[points[:, 2].argmin()]
        for joint in figure.path(name):
            if joint.name not in figure.home or joint.type == "prismatic":
                continue
            frame = poses[joint.child]
            arm = np.cross(frame[:3, :3] @ np.array(joint.axis), contact - frame[:3, 3])
            found[joint.name] = max(found.get(joint.name, 0.0), float(np.linalg.norm(arm)))
    return found


def _each(figure: PointModel, poses: Mapping[str, Array], links: tuple[str, ...]) -> list[Array]:
    return [figure.points(poses, [name]) for name in links]


def _polygon(points: Array, size: float) -> Array | None:
    from roboyard._qhull import qhull

    ConvexHull, QhullError = qhull()

    if len(points) < 3:
        return None
    try:
        hull = ConvexHull(points)
    except QhullError:
        return None
    return hull.equations if hull.volume > 1e-4 * size * size else None


def _carrying_joints(figure: PointModel, feet: tuple[str, ...], lowest: float, tolerance: float) -> list[str]:
    """Joints between root and feet that lift the feet: legs, where wheels and casters only roll."""
    driven = {joint.name: joint for joint in figure.joints}
    candidates = dict.fromkeys(joint.name for name in feet for joint in figure.path(name))
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


def _tipping_joints(figure: PointModel, stance: SupportMode) -> list[str]:
    found = []
    for joint in figure.joints:
        lower, upper = full_range(joint, figure.home[joint.name])
        poses = figure.poses({joint.name: np.linspace(lower, upper, SAMPLES)})
        if stance.margin_at(figure.centre_of_mass(poses)).min() < 0.3 * stance.margin:
            found.append(joint.name)
    return found
