"""Read a `<joint>`."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from difflib import get_close_matches
from typing import cast, get_args

from roboyard.description.model import TYPES_WITH_AXIS, Joint, JointType, Limit, Mimic, Vector3
from roboyard.description.urdf.build_context import (
    UNIT_TOLERANCE,
    Context,
    children_of,
    read_pose,
    unread_attributes,
    unread_part,
)
from roboyard.description.urdf.numbers import read_number, read_vector
from roboyard.description.urdf.problems import Problems

_READ = ("origin", "parent", "child", "limit", "dynamics", "mimic")
_TYPES: tuple[str, ...] = get_args(JointType)


def read_joint(element: ET.Element, context: Context) -> Joint | None:
    """The joint; None where its name, type, parent or child is missing, which is reported."""
    problems = context.problems
    name = element.get("name")
    who = f'joint "{name}"'
    if not name:
        problems.error(element, "joint", "a <joint> has no name; give it a unique name")
        return None
    kind = _read_type(element, who, problems)
    with_axis = ("axis",) if kind in TYPES_WITH_AXIS else ()  # elsewhere it says nothing: kept unread
    found, rest = children_of(element, (*_READ, *with_axis))
    parent = _read_end("parent", element, found, who, problems)
    child = _read_end("child", element, found, who, problems)
    origin = read_pose(found.get("origin"), who, problems)
    axis = _read_axis(found.get("axis"), who, problems)
    limit = _read_limit(found.get("limit"), who, problems)
    mimic = _read_mimic(found.get("mimic"), who, problems)
    dynamics = found.get("dynamics")
    damping = friction = None
    if dynamics is not None:
        damping = read_number(dynamics, "damping", who, problems)
        friction = read_number(dynamics, "friction", who, problems)
    if kind is None or parent is None or child is None:
        return None
    extra = (
        *rest,
        *unread_part(found.get("origin"), ("xyz", "rpy", "quat_xyzw")),
        *unread_part(found.get("parent"), ("link",)),
        *unread_part(found.get("child"), ("link",)),
        *unread_part(found.get("axis"), ("xyz",)),
        *unread_part(found.get("limit"), ("lower", "upper", "effort", "velocity")),
        *unread_part(found.get("dynamics"), ("damping", "friction")),
        *unread_part(found.get("mimic"), ("joint", "multiplier", "offset")),
    )
    return Joint(
        name=name,
        type=kind,
        parent=parent,
        child=child,
        origin=origin,
        axis=axis,
        limit=limit,
        damping=damping or 0.0,
        friction=friction or 0.0,
        mimic=mimic,
        extra=extra,
        attributes=unread_attributes(element, "name", "type"),
        source=problems.source(element),
    )


def _read_type(element: ET.Element, who: str, problems: Problems) -> JointType | None:
    kind = element.get("type")
    if kind in _TYPES:
        return cast(JointType, kind)
    if kind is None:
        problems.error(element, who, f"it has no type; give one of {', '.join(_TYPES)}")
        return None
    plain = kind.strip().lower()
    if plain in _TYPES:
        problems.note(element, who, f"type {kind!r} read as {plain!r}")
        return cast(JointType, plain)
    near = get_close_matches(plain, _TYPES, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    problems.error(element, who, f"unknown joint type {kind!r}{hint} (give one of {', '.join(_TYPES)})")
    return None


def _read_end(
    tag: str, element: ET.Element, found: dict[str, ET.Element], who: str, problems: Problems
) -> str | None:
    end = found.get(tag)
    link = None if end is None else end.get("link")
    if not link:
        at = element if end is None else end
        problems.error(at, who, f'it has no {tag} link; add <{tag} link="..."/>')
        return None
    return link


def _read_axis(element: ET.Element | None, who: str, problems: Problems) -> Vector3:
    default = (1.0, 0.0, 0.0)
    if element is None:
        return default
    axis = read_vector(element, "xyz", 3, who, problems)
    if axis is None:
        return default
    length = math.hypot(*axis)
    if length < 1e-12:
        shown = ", ".join(f"{value:g}" for value in axis)
        problems.error(element, who, f"<axis> is ({shown}); give a non-zero axis")
        return default
    if not math.isfinite(length):
        problems.error(element, who, "<axis> is too large; give a unit axis")
        return default
    if abs(length - 1.0) > UNIT_TOLERANCE:
        problems.note(element, who, f"<axis> has length {length:.6g}; scaled to unit length")
    if abs(length - 1.0) < 1e-15:
        return cast(Vector3, axis)
    return (axis[0] / length, axis[1] / length, axis[2] / length)


def _read_limit(element: ET.Element | None, who: str, problems: Problems) -> Limit | None:
    if element is None:
        return None
    return Limit(
        lower=read_number(element, "lower", who, problems),
        upper=read_number(element, "upper", who, problems),
        effort=read_number(element, "effort", who, problems),
        velocity=read_number(element, "velocity", who, problems),
    )


def _read_mimic(element: ET.Element | None, who: str, problems: Problems) -> Mimic | None:
    if element is None:
        return None
    joint = element.get("joint")
    if not joint:
        problems.error(element, who, '<mimic> names no joint; add joint="..."')
        return None
    multiplier = read_number(element, "multiplier", who, problems)
    offset = read_number(element, "offset", who, problems)
    return Mimic(joint=joint, multiplier=1.0 if multiplier is None else multiplier, offset=offset or 0.0)
