"""Wheels of a robot by their joints, shapes and names: what turns without limits about a level axle, is round
about it and reaches the floor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
LEG_LINKS = 4
"""Fewest links with names of legs with which round parts on the body are motors rather than wheels."""
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
    round_parts, plain = [], []
    for name in skeleton.joint:
        above = skeleton.path(name)[:-1]
        if _turns_level(skeleton, name) and not any(_has_rollers(skeleton, up) for up in above[-1:]):
            part = _round_part(skeleton, name)
            round_parts += [part] if part is not None else []
            plain += [name] if part is None else []
    found = _on_the_floor(skeleton, round_parts)
    if not found:
        found = _without_shape(skeleton, [*plain, *(part.joint for part in round_parts)])
    else:
        others = [*plain, *(part.joint for part in round_parts if part not in found)]
        found += [part for name in others if (part := _like_another(skeleton, name, found)) is not None]
    casters = [name for part in found for name in part.swivels if "caster" in meanings(name)]
    if len(found) == 1 and not _is_named(skeleton, found[0].joint) and not casters:
        return ()  # the last joint of an arm may look like one wheel
    if not any(_is_named(skeleton, part.joint) for part in found):
        found = _without_hip_motors(skeleton, found)
    order = list(skeleton.joint)
    return tuple(sorted(_below_a_carriage(skeleton, found), key=lambda part: order.index(part.joint)))


def _without_hip_motors(skeleton: Skeleton, parts: list[RollingPart]) -> list[RollingPart]:
    """Return wheels; of a robot whose links are legs by name only those that end a chain, since motors are
    round as well.
    """
    links = [link for links in skeleton.links.values() for link in links]
    if sum("leg" in meanings(link) for link in links) < LEG_LINKS:
        return parts
    above = {part.joint: skeleton.parent[part.joint] for part in parts}
    return [p for p in parts if above[p.joint] != BASE and len(skeleton.children[above[p.joint]]) == 1]


def _below_a_carriage(skeleton: Skeleton, parts: Sequence[RollingPart]) -> list[RollingPart]:
    """Return wheels without the joints above all of them, which move the robot on its wheels."""
    above = [{*part.swivels, *part.others} for part in parts]
    shared = set.intersection(*above) if len(parts) >= 2 else set()
    if not any(shared & set(part.others) for part in parts):
        return list(parts)
    if skeleton.mass(BASE) == 0 and not len(skeleton.points(BASE)):
        return []  # they turn below a joint of the world: gears, a mill
    return [
        replace(
            part,
            swivels=tuple(name for name in part.swivels if name not in shared),
            others=tuple(name for name in part.others if name not in shared),
        )
        for part in parts
    ]


def _on_the_floor(skeleton: Skeleton, parts: Sequence[RollingPart]) -> list[RollingPart]:
    if not parts:
        return []
    lowest = min(part.bottom for part in parts)
    floor = min(lowest, float(skeleton.points(BASE)[:, 2].min(initial=lowest)))
    return [part for part in parts if _reaches(skeleton, part, floor, lowest)]


def _reaches(skeleton: Skeleton, part: RollingPart, floor: float, lowest: float) -> bool:
    if _is_named(skeleton, part.joint) and part.bottom <= lowest + part.radius:
        return True
    return part.bottom <= floor + MAX_HEIGHT * part.radius


def _like_another(skeleton: Skeleton, name: str, found: Sequence[RollingPart]) -> RollingPart | None:
    """Return a wheel whose own shape does not show it, but whose axle is like another wheel's: as high, and
    mirrored or named as a wheel.
    """
    spot, axis = skeleton.origin(name), skeleton.axis(name)
    for other in found:
        level = abs(float(spot[2] - other.centre[2])) < 0.35 * other.radius
        if not level or abs(float(axis @ other.axis)) < 0.95:
            continue
        apart = spot - skeleton.origin(other.joint)
        along = abs(float(apart @ other.axis))
        is_mirror = along > other.radius and float(np.linalg.norm(apart)) < 1.05 * along
        if is_mirror or _is_named(skeleton, name):
            return _part(
                skeleton, name, other.radius, spot, False, f'on an axle like that of "{other.joint}"'
            )
    return None


def _without_shape(skeleton: Skeleton, names: Sequence[str]) -> list[RollingPart]:
    """Return wheels of which no shape is known: named so, or mirrored, with the radius that their inertia
    gives.
    """
    spots = {name: skeleton.origin(name) for name in names}
    found = []
    for name in names:
        words = meanings(name) | meanings(skeleton.joint[name].child)
        if "rotor" in words or (len(skeleton.points(name)) and "wheel" not in words):
            continue
        mirrored = any(
            np.linalg.norm(spots[other][[0, 2]] - spots[name][[0, 2]])
            < 0.1 * abs(float(spots[other][1] - spots[name][1]))
            for other in names
            if other != name
        )
        above = [skeleton.joint[up] for up in skeleton.path(name)[:-1]]
        ends_limb = len(above) >= 2 and not any(is_endless(joint) for joint in above)
        if not ("wheel" in words or (mirrored and (len(above) <= 1 or ends_limb))):
            continue
        radius = _radius_of_inertia(skeleton, name)
        if radius is not None:
            text = f"no shape is known; its inertia is that of a disc of radius {radius:.2g} m"
            found.append(_part(skeleton, name, radius, spots[name], False, text))
    if len(found) < 2:
        return []
    lowest = min(part.bottom for part in found)
    return [part for part in found if part.bottom <= lowest + part.radius]


def _radius_of_inertia(skeleton: Skeleton, name: str) -> float | None:
    """Return the radius of the disc with the mass and the inertia of a body (m); None without these."""
    for link in skeleton.links[name]:
        inertial = skeleton.description.link_by_name[link].inertial
        if inertial is None or not inertial.mass > 0:
            continue
        rotation = (skeleton.frames[link] @ inertial.origin.matrix())[:3, :3]
        axis = rotation.T @ skeleton.axis(name)
        about = float(axis @ inertial.matrix() @ axis)
        if about > 0:
            return float(np.sqrt(2.0 * about / inertial.mass))
    return None


def _is_named(skeleton: Skeleton, name: str) -> bool:
    return "wheel" in meanings(name) | meanings(skeleton.joint[name].child)


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


def _turns_level(skeleton: Skeleton, name: str) -> bool:
    """Return whether a joint turns without limits about a level axle, and carries nothing but rollers."""
    joint = skeleton.joint[name]
    named = _is_named(skeleton, name)
    if not is_endless(joint) and not (named and joint.type == "revolute" and _range(skeleton, name) >= 3.0):
        return False
    below = skeleton.below(name)[1:]
    return abs(skeleton.axis(name)[2]) <= MAX_TILT and (not below or _has_rollers(skeleton, name))


def _has_rollers(skeleton: Skeleton, name: str) -> bool:
    below = skeleton.below(name)[1:]
    return len(below) >= MIN_ROLLERS and all(skeleton.parent[child] == name for child in below)


def _round_part(skeleton: Skeleton, name: str) -> RollingPart | None:
    """Return the wheel that a level joint turns; None where its shape is not round."""
    rollers = _has_rollers(skeleton, name)
    measured = _radius(skeleton, name, rollers=rollers)
    if measured is None:
        return None
    radius, centre = measured
    return _part(skeleton, name, radius, centre, rollers, f"round about a level axle, radius {radius:.3g} m")


def _part(
    skeleton: Skeleton, name: str, radius: float, centre: Array, rollers: bool, seen: str
) -> RollingPart:
    joint = skeleton.joint[name]
    above = skeleton.path(name)[:-1]
    swivels = tuple(up for up in above if _is_swivel(skeleton, up))
    return RollingPart(
        joint=name,
        link=joint.child,
        centre=centre,
        axis=skeleton.axis(name),
        radius=radius,
        swivels=swivels,
        others=tuple(up for up in above if up not in swivels),
        has_rollers=rollers,
        evidence=(seen, "turns without limits" if is_endless(joint) else "its name says wheel"),
    )


def _is_swivel(skeleton: Skeleton, name: str) -> bool:
    joint = skeleton.joint[name]
    if joint.type not in ("revolute", "continuous"):
        return False
    said = "steer" in meanings(name) & meanings(joint.child)
    said = said or ("caster" in meanings(name) and is_endless(joint))
    return abs(skeleton.axis(name)[2]) > UPRIGHT or said


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
