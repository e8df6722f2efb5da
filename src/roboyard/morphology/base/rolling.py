"""Wheels of a robot by their joints, shapes and names: what turns without limits about a level axle, is round
about it and reaches the floor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roboyard.morphology.skeleton import BASE, Skeleton, is_endless
from roboyard.morphology.words import meanings
from roboyard.transforms import Array

MAX_TILT = 0.3
"""Largest sine of the angle between an axle and the floor; wheels of some bases are cambered."""
MIN_ROUNDNESS = 0.88
"""Smallest radius across the axle as a share of the largest; an octagon has 0.92."""
MAX_HEIGHT = 0.3
"""Largest height of a wheel's lowest point above the floor, as a share of its radius."""
DIRECTIONS = 24
"""Directions around the axle in which the radius is measured."""
UPRIGHT = 0.85
"""Smallest |z| of an axis that counts as upright."""
MIN_ROLLERS = 5
"""Smallest number of joints on a wheel's rim that are its rollers."""
LEG_RANGE = 0.5
"""Smallest motion of a joint that can lift a wheel as a leg does (rad)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class RollingPart:
    """A wheel with the joints that carry it, in the frame of the base link."""

    joint: str
    link: str
    centre: Array
    """(3,) middle of the wheel on its axle (m)."""
    axis: Array
    """(3,) unit vector of the joint."""
    radius: float
    """m"""
    swivels: tuple[str, ...]
    """Joints above it about upright axes, base first."""
    others: tuple[str, ...]
    """Other joints above it, base first: suspension, or those of a leg."""
    has_rollers: bool
    evidence: tuple[str, ...]

    @property
    def bottom(self) -> float:
        """Height of its lowest point (m)."""
        level = float(np.sqrt(max(0.0, 1.0 - self.axis[2] ** 2)))
        return float(self.centre[2]) - self.radius * level

    @property
    def roll(self) -> Array:
        """(3,) unit vector, level: where a positive velocity of the joint rolls it."""
        direction = np.cross(self.axis, [0.0, 0.0, 1.0])
        return direction / np.linalg.norm(direction)


def find_rolling_parts(skeleton: Skeleton) -> tuple[RollingPart, ...]:
    """Return the wheels that reach the floor, depth first."""
    candidates = [part for name in skeleton.joint if (part := _candidate(skeleton, name)) is not None]
    if not candidates:
        return ()
    base = skeleton.points(BASE)
    lowest = min(part.bottom for part in candidates)
    floor = min(lowest, float(base[:, 2].min(initial=lowest)))
    found = [part for part in candidates if _reaches(part, floor, lowest)]
    if len(found) == 1 and "wheel" not in meanings(found[0].joint) | meanings(found[0].link):
        return ()  # the last joint of an arm may look like one wheel
    return tuple(found)


def leg_joints(skeleton: Skeleton, part: RollingPart) -> tuple[str, ...]:
    """Return the joints above a wheel that can lift it as a leg does, base first; empty for a suspension."""
    names = [name for name in part.others if skeleton.joint[name].type != "prismatic"]
    moving = [name for name in names if _range(skeleton, name) > LEG_RANGE]
    words = [meanings(name) | meanings(skeleton.joint[name].child) for name in names]
    legs, hung = sum("leg" in word for word in words), sum("suspension" in word for word in words)
    if hung > legs or len(moving) < 2:
        return ()
    return tuple(skeleton.path(part.joint)[:-1]) if len(moving) >= 3 or legs else ()


def _range(skeleton: Skeleton, name: str) -> float:
    limits = skeleton.joint[name].position_limits()
    return np.inf if limits is None else limits[1] - limits[0]


def _reaches(part: RollingPart, floor: float, lowest: float) -> bool:
    named = "wheel" in meanings(part.joint) | meanings(part.link)
    if named and part.bottom <= lowest + part.radius:
        return True
    return part.bottom <= floor + MAX_HEIGHT * part.radius


def _candidate(skeleton: Skeleton, name: str) -> RollingPart | None:
    """Return what turns about a level axle as a wheel does; None where joint or shape are no wheel's."""
    joint = skeleton.joint[name]
    named = "wheel" in meanings(name) | meanings(joint.child)
    if not is_endless(joint) and not (named and joint.type == "revolute" and _range(skeleton, name) >= 3.0):
        return None
    axis = skeleton.axis(name)
    if abs(axis[2]) > MAX_TILT:
        return None
    below = skeleton.below(name)[1:]
    rollers = len(below) >= MIN_ROLLERS and all(skeleton.parent[child] == name for child in below)
    if below and not rollers:
        return None
    measured = _radius(skeleton, name, rollers=rollers)
    if measured is None:
        if not named:
            return None
        floor = float(skeleton.all_points[:, 2].min(initial=np.inf))
        height = float(skeleton.origin(name)[2]) - floor
        measured = (height, skeleton.origin(name)) if np.isfinite(height) and height > 0 else None
        seen = "it has no round shape, its name says wheel"
    else:
        seen = f"round about a level axle, radius {measured[0]:.3g} m"
    if measured is None:
        return None
    above = skeleton.path(name)[:-1]
    swivels = tuple(up for up in above if _is_swivel(skeleton, up))
    evidence = (seen, "turns without limits") if is_endless(joint) else (seen, "its name says wheel")
    return RollingPart(
        joint=name,
        link=joint.child,
        centre=measured[1],
        axis=axis,
        radius=measured[0],
        swivels=swivels,
        others=tuple(up for up in above if up not in swivels),
        has_rollers=rollers,
        evidence=evidence,
    )


def _is_swivel(skeleton: Skeleton, name: str) -> bool:
    joint = skeleton.joint[name]
    return joint.type in ("revolute", "continuous") and abs(skeleton.axis(name)[2]) > UPRIGHT


def _radius(skeleton: Skeleton, name: str, *, rollers: bool) -> tuple[float, Array] | None:
    """Return radius and centre of the collision or visual shapes, the first that are round about the joint's
    axis; None where neither are.
    """
    for visual in (False, True):
        bodies: Sequence[str] = skeleton.below(name) if rollers else (name,)
        points = np.concatenate([skeleton.points(body, visual=visual) for body in bodies])
        if len(points) < 6:
            continue
        origin, axis = skeleton.origin(name), skeleton.axis(name)
        up = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
        up /= np.linalg.norm(up)
        angle = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        around = np.outer(np.cos(angle), up) + np.outer(np.sin(angle), np.cross(axis, up))
        radii = ((points - origin) @ around.T).max(axis=0)
        radius = float(radii.max())
        if radius > 0 and radii.min() >= MIN_ROUNDNESS * radius:
            along = (points - origin) @ axis
            return radius, origin + axis * float(along.min() + along.max()) / 2
    return None
