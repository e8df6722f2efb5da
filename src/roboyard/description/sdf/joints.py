"""Joints of SDF as URDF joints: one with several motions becomes a chain of links without mass."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from roboyard._records import dataclass
from roboyard.description.sdf.frames import Frame, pose_of_frame
from roboyard.description.sdf.parts import axis_element, dynamics_element
from roboyard.description.sdf.values import is_true, made, number_of, numbers_of, origin, text_of
from roboyard.description.urdf.xml import LocatedElement, line_of
from roboyard.errors import DescriptionError
from roboyard.transforms import Array

UNLIMITED = 1e15
"""Limits from here on are none: SDF's default is 1e16 rad."""
ONE_SIDED = 1e9
"""Written where a file limits one side only (rad or m)."""
_JOINT_FRAME_AXES = (1, 5)
"""The first version in which axes are in the joint's frame and no longer in the model's."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """One motion of a joint."""

    type: str
    """As URDF calls it."""
    axis: Array | None = None
    """(3,) in the outermost model's frame; None for a ball."""
    element: ET.Element | None = None
    """SDF's axis, with its limits and damping."""
    suffix: str = ""
    """Of its name, after the joint's."""
    follows: tuple[str, float, float] | None = None
    """The joint that it follows, multiplier and offset; an empty name for the joint's first motion."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ends:
    """The links that a joint connects in the tree."""

    parent: str
    child: str
    T_parent_child: Array
    """(4, 4) pose of the child's frame, which is at the joint's anchor, at position zero."""
    R_child: Array
    """(3, 3) rotation of the child's frame in the outermost model."""
    is_turned: bool
    """Whether the file calls the child here the parent."""


def motions_of(joint: Frame, note: Callable[[str], None]) -> list[Motion]:
    """Return what a joint can do, first what is next to its parent; nothing for a fixed joint.

    Raises:
        DescriptionError: its type is not known, or an axis is no direction.
    """
    element, kind = joint.element, (joint.element.get("type") or "").strip().lower()
    if kind in ("fixed", ""):
        if not kind:
            raise DescriptionError(f'joint "{joint.name}" has no type; give one', line=line_of(element))
        return []
    if kind == "ball":
        return [Motion(type="spherical")]
    first = _motion(joint, "axis", note)
    if kind == "gearbox":
        note(f"the ratio of gearbox {joint.name!r} is omitted: it moves freely")
    match kind:
        case "revolute" | "prismatic" | "gearbox":
            return [first if kind != "prismatic" else replace(first, type="prismatic")]
        case "continuous":
            return [replace(first, type="continuous")]
        case "universal" | "revolute2":
            return [first, replace(_motion(joint, "axis2", note), suffix="_axis2")]
        case "screw":
            travel = Motion(
                type="prismatic", axis=first.axis, suffix="_travel", follows=("", _travel(element), 0.0)
            )
            return [first, travel]
        case _:
            raise DescriptionError(
                f'joint "{joint.name}": unknown type {kind[:40]!r}; give revolute, continuous, prismatic, '
                "fixed, ball, universal, revolute2, screw or gearbox",
                line=line_of(element),
            )


def joint_elements(
    joint: Frame, motions: list[Motion], ends: Ends, free_name: Callable[[str], str]
) -> tuple[list[LocatedElement], list[LocatedElement]]:
    """Return the links between a joint's motions, and one URDF joint for each motion."""
    if not motions:
        fixed = _element(joint.name, "fixed", joint, ends.T_parent_child, ends.parent, ends.child)
        return [], [fixed]
    ordered = list(reversed(motions)) if ends.is_turned else motions
    links: list[LocatedElement] = []
    joints: list[LocatedElement] = []
    above, pose = ends.parent, ends.T_parent_child
    for k, motion in enumerate(ordered):
        child = ends.child
        if k < len(ordered) - 1:
            child = free_name(f"{ends.child}_{joint.name}{motion.suffix}_link")
            links.append(made("link", joint.element, name=child))
        kind = "revolute" if motion.type == "revolute" and _range(motion) else motion.type
        kind = "continuous" if motion.type == "revolute" and not _range(motion) else kind
        part = _element(f"{joint.name}{motion.suffix}", kind, joint, pose, above, child)
        if motion.axis is not None:
            direction = ends.R_child.T @ motion.axis
            like = joint.element if motion.element is None else motion.element
            part.append(axis_element(like, -direction if ends.is_turned else direction))
        part.extend(_limits(motion, kind))
        if motion.follows is not None:
            leader, multiplier, offset = motion.follows
            name = leader or f"{joint.name}{motions[0].suffix}"
            part.append(
                made("mimic", joint.element, joint=name, multiplier=repr(multiplier), offset=repr(offset))
            )
        joints.append(part)
        above, pose = child, np.eye(4)
    return links, joints


def _element(name: str, kind: str, joint: Frame, pose: Array, parent: str, child: str) -> LocatedElement:
    element = made("joint", joint.element, name=name, type=kind)
    element.append(origin(pose))
    element.append(made("parent", joint.element, link=parent))
    element.append(made("child", joint.element, link=child))
    return element


def _motion(joint: Frame, tag: str, note: Callable[[str], None]) -> Motion:
    element = joint.element.find(tag)
    if element is None:
        element = made(tag, joint.element)
    stiffness = number_of(element, "dynamics/spring_stiffness", 0.0)
    if stiffness:
        note(f"the spring of joint {joint.name!r} ({stiffness:g} N m/rad or N/m) is omitted")
    return Motion(
        type="revolute", axis=_axis(joint, element), element=element, follows=_follows(joint, element)
    )


def _axis(joint: Frame, element: ET.Element) -> Array:
    """Return the (3,) direction of an axis in the outermost model's frame."""
    xyz = element.find("xyz")
    text = text_of(element, "xyz") or "0 0 1"
    direction = numbers_of(text, 3)
    if direction is None or math.hypot(*direction) < 1e-12:
        raise DescriptionError(
            f'joint "{joint.name}": <xyz>{text[:60]}</xyz> is no direction; give three numbers, not all zero',
            line=line_of(element if xyz is None else xyz),
        )
    frame = joint
    named = "" if xyz is None else (xyz.get("expressed_in") or "").strip()
    version = joint.scope.model.version
    if named:
        frame = joint.scope.find(named, element)
    elif is_true(element, "use_parent_model_frame") or version < _JOINT_FRAME_AXES:
        frame = joint.scope.own
    return pose_of_frame(frame)[:3, :3] @ np.array(direction) / math.hypot(*direction)


def _follows(joint: Frame, axis: ET.Element) -> tuple[str, float, float] | None:
    mimic = axis.find("mimic")
    name = "" if mimic is None else (mimic.get("joint") or "").strip()
    if mimic is None or not name:
        return None
    leader = joint.scope.find(name, mimic).name
    if mimic.get("axis") == "axis2":
        leader += "_axis2"
    multiplier = number_of(mimic, "multiplier", 1.0)
    offset = number_of(mimic, "offset", 0.0) - multiplier * number_of(mimic, "reference", 0.0)
    return leader, multiplier, offset


def _travel(joint: ET.Element) -> float:
    """Return how far a screw moves in one radian (m), along its axis for a right-handed thread."""
    pitch = number_of(joint, "screw_thread_pitch", math.nan)
    if math.isfinite(pitch):
        return pitch / (2 * math.pi)
    turns = number_of(joint, "thread_pitch", 1.0)  # rad/m, left-handed
    return -1.0 / turns if turns else 0.0


def _range(motion: Motion) -> tuple[float, float] | None:
    """Return the limits of a motion; None where it has none."""
    lower = number_of(motion.element, "limit/lower", -math.inf)
    upper = number_of(motion.element, "limit/upper", math.inf)
    if lower <= -UNLIMITED and upper >= UNLIMITED:
        return None
    return (lower if lower > -UNLIMITED else -ONE_SIDED), (upper if upper < UNLIMITED else ONE_SIDED)


def _limits(motion: Motion, kind: str) -> list[LocatedElement]:
    """Return the `<limit>` and `<dynamics>` of a motion."""
    axis = motion.element
    if axis is None or motion.axis is None:
        return []
    values: dict[str, str] = {}
    ends = None if kind == "continuous" else _range(motion)
    if ends is not None:
        values |= {"lower": repr(ends[0]), "upper": repr(ends[1])}
    for key in ("effort", "velocity"):
        most = number_of(axis, f"limit/{key}", -1.0)
        if 0 <= most < UNLIMITED:
            values[key] = repr(most)
    limit = axis.find("limit")
    parts = [made("limit", axis if limit is None else limit, **values)] if values else []
    dynamics = dynamics_element(axis)
    return parts if dynamics is None or not dynamics.attrib else [*parts, dynamics]
