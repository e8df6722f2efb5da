"""Joints above the first real body that represent how the base moves: planar, or slides and turns without
end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from roboyard.description.model import Joint, RobotDescription
from roboyard.description.semantic import BaseKind

FREE_TYPES = ("floating", "planar", "spherical")
FREE_SLIDE = 20.0
"""Shortest range of a slide that represents driving (m)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class VirtualBase:
    """The motion that joints without mechanical parts represent."""

    kind: BaseKind
    joints: tuple[str, ...]
    """Root first."""
    evidence: tuple[str, ...]


def find_virtual_base(description: RobotDescription, base_link: str) -> VirtualBase | None:
    """Return the motion that the joints above a link represent; None where they are a gantry, or float."""
    above: list[Joint] = []
    while base_link in description.parent_joint:
        above.insert(0, description.parent_joint[base_link])
        base_link = above[0].parent
    moving = [joint for joint in above if joint.is_moving]
    names = tuple(joint.name for joint in moving)
    if not moving:
        return None
    if any(joint.type == "planar" for joint in moving):
        return VirtualBase(kind="holonomic", joints=names, evidence=(f'"{names[0]}" is a planar joint',))
    if is_planar_motion(moving) and not any(has_shape(description, joint.parent) for joint in above):
        text = f"{', '.join(names)} slide two level ways and turn, and move no mechanical part"
        return VirtualBase(kind="holonomic", joints=names, evidence=(text,))
    slides = [joint for joint in moving if joint.type == "prismatic"]
    level = [joint for joint in slides if abs(joint.axis[2]) < 0.5]
    if len(moving) > len(level) + 1 or not all(is_free_slide(joint) for joint in slides) or not level:
        return None
    kind: BaseKind = "holonomic" if len(level) == 2 else "differential"
    text = f"{', '.join(names)} move no mechanical part, as far as one likes"
    return VirtualBase(kind=kind, joints=names, evidence=(text,))


def guide_joints(description: RobotDescription, base_link: str) -> tuple[str, ...]:
    """Return the joints, root first, by which the world guides a base: slides and turns between a root
    without shape and the base, as of a planar walker; empty where others are between them.
    """
    found: list[Joint] = []
    while base_link in description.parent_joint:
        if base_link != description.root.name and found and has_shape(description, base_link):
            return ()
        joint = description.parent_joint[base_link]
        found += [joint] if joint.is_moving else []
        base_link = joint.parent
    if has_shape(description, description.root.name) or any(joint.type in FREE_TYPES for joint in found):
        return ()
    return tuple(joint.name for joint in reversed(found))


def is_free_slide(joint: Joint) -> bool:
    """Return whether a slide has no limits, or such that represent driving."""
    limits = joint.position_limits()
    return joint.type == "prismatic" and (limits is None or limits[1] - limits[0] >= FREE_SLIDE)


def is_planar_motion(moving: Sequence[Joint]) -> bool:
    """Return whether joints are two level slides across each other and a turn about the upright axis."""
    slides = [joint for joint in moving if joint.type == "prismatic"]
    turns = [joint for joint in moving if joint.type in ("revolute", "continuous")]
    if (len(slides), len(turns), len(moving)) != (2, 1, 3):
        return False
    (ax, ay, az), (bx, by, bz) = (joint.axis for joint in slides)
    across = abs(ax * bx + ay * by + az * bz) < 0.1
    return across and max(abs(az), abs(bz)) < 0.1 and abs(turns[0].axis[2]) > 0.95


def has_shape(description: RobotDescription, link: str) -> bool:
    """Return whether a link has a visual or collision shape."""
    found = description.link_by_name[link]
    return bool(found.visuals or found.collisions)
